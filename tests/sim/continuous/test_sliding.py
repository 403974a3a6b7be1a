"""Sticking and sliding begin and end at exact instants; where the equations do not say how to go on, this is said."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from ulna.base import SimulationError
from ulna.loop import EndStop, Hardware, Loop
from ulna.sim import TIME, EventKind, Held, Implicit, Interpolated, Outcome, Trajectory, simulate
from ulna.system import Parameter, Signal, System

x, y, v, w, u, t = sp.symbols("x y v w u t", real=True)
sign = sp.sign


def plant(rates: dict[str, object], **parameters: float) -> System:
    free = set().union(*(sp.sympify(rate).free_symbols for rate in rates.values()))
    return System(
        name="plant",
        states=tuple(Signal(name=name) for name in rates),
        rates=tuple(map(sp.sympify, rates.values())),
        inputs=(Signal(name="u"),) if u in free else (),
        parameters=tuple(Parameter(name=name, value=value) for name, value in parameters.items()),
    )


def told(run: Trajectory, kind: EventKind) -> list[tuple[float, str]]:
    return [(event.time, event.signal) for event in run.events if event.kind is kind]


def held(run: Trajectory) -> list[tuple[float, str]]:
    return told(run, EventKind.HELD)


def released(run: Trajectory) -> list[tuple[float, str]]:
    return told(run, EventKind.RELEASED)


def test_a_block_with_dry_and_viscous_friction_stops_and_stays() -> None:
    m, b, fc, force, start = 0.5, 2.0, 3.0, 2.0, 1.0
    block = plant({"x": v, "v": (u - b * v - fc * sign(v)) / m})
    # v = (v0 + a/b) e^(−b t/m) − a/b of a = fc − force.
    rest = (fc - force) / b
    stop = m / b * math.log((start + rest) / rest)
    way = m / b * start - rest * stop
    for times in (3.0, np.linspace(0.0, 3.0, 301)):
        run = simulate(block, [0.0, start], times, inputs={"u": force})
        assert run.outcome is Outcome.FINISHED
        assert held(run) == [(pytest.approx(stop, abs=1e-12), "v = 0")]
        np.testing.assert_allclose(run.final_state, [way, 0.0], rtol=0, atol=1e-12)
        assert run.final_state[1] == 0.0
    assert [(mode.held, mode.end) for mode in run.modes] == [((), pytest.approx(stop)), (("v = 0",), 3.0)]
    still = simulate(block, [0.0, 0.0], np.linspace(0.0, 3.0, 31), inputs={"u": force})
    assert not still.states.any()
    assert held(still) == [(0.0, "v = 0")]


def test_a_threshold_and_a_surface_between_two_states_hold_the_motion() -> None:
    chatter = simulate(plant({"x": sp.Piecewise((-1, x > 0.5), (1, True))}), [0.0], 2.0)
    assert chatter.final_state[0] == 0.5
    assert held(chatter) == [(0.5, "x = 0.5")]
    # Closing at 7/2 over 1/2; then α (−2, 3/2) + (1 − α) (1, −1) with equal parts: α = 4/11.
    above = x > y
    both = plant({"x": sp.Piecewise((-2, above), (1, True)), "y": sp.Piecewise((1.5, above), (-1, True))})
    run = simulate(both, [1.5, 1.0], np.linspace(0.0, 1.0, 11))
    assert held(run)[0][0] == pytest.approx(1 / 7, abs=1e-14)
    meeting = 1.5 - 2 / 7
    np.testing.assert_allclose(run.final_state, meeting - 1 / 11 * (6 / 7), atol=1e-13)


def test_friction_at_a_turning_point_of_just_its_own_force_holds() -> None:
    # Half swings about ±1/5; the spring then pulls with exactly the friction.
    for times in (10.0, np.linspace(0, 10, 101)):
        run = simulate(plant({"x": v, "v": -sign(v) - 5 * x}), (1.0, 0.0), times)
        assert held(run)[-1][0] == pytest.approx(2 * math.pi / math.sqrt(5), abs=1e-12)
        np.testing.assert_allclose(run.final_state, [0.2, 0.0], rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("given", "ends"),
    [(TIME / 2, 2.0), (Interpolated(times=np.array([0.0, 4.0]), values=np.array([0.0, 2.0])), 2.0), (sp.sin(TIME), 0)],
)
def test_a_growing_force_lets_go_at_its_instant(given: object, ends: float) -> None:
    run = simulate(plant({"x": v, "v": 2 * (u - sign(v))}), [0.0, 0.0], np.linspace(0.0, 4.0, 9), inputs={"u": given})
    if ends:
        assert released(run) == [(pytest.approx(ends, abs=1e-12), "v = 0")]
        # v' = 2 (t/2 − 1) from 2 s on.
        np.testing.assert_allclose(run.final_state, [8 / 6, 2.0], atol=1e-11)
    else:
        assert not run.states.any()  # sin t only touches the friction


def test_a_force_that_jumps_lets_go_and_a_reversal_sticks_between() -> None:
    steps = Held.known(times=np.array([0.0, 1.0, 2.0, 4.0]), values=np.array([0.5, 2.0, 0.0, -2.0]))
    run = simulate(plant({"x": v, "v": u - sign(v)}), [0.0, 0.0], np.linspace(0.0, 5.0, 11), inputs={"u": steps})
    assert held(run) == [(0.0, "v = 0"), (pytest.approx(3.0, abs=1e-12), "v = 0")]
    assert [time for time, _ in released(run)] == [1.0, 4.0]
    np.testing.assert_allclose(run.final_state, [0.5 + 0.5 - 0.5, -1.0], atol=1e-12)


def test_stick_and_slip_on_a_belt_keeps_the_period_of_its_closed_form() -> None:
    # Slip: circle about the kinetic friction through the point of release; stick: along the belt to the static one.
    static, kinetic, belt = 1.0, 0.6, 0.5
    friction = sp.Piecewise((static, sp.Eq(v, belt)), (kinetic, True)) * sign(v - belt)
    run = simulate(plant({"x": v, "v": -x - friction}), [0.0, belt], np.linspace(0.0, 40.0, 401))
    # Filippov's solution knows the two sides only: what holds it is the kinetic friction, and it slips from there.
    assert [time for time, _ in released(run)] == [pytest.approx(kinetic / belt, abs=1e-12)]
    stribeck = kinetic + (static - kinetic) * sp.exp(-20 * sp.Abs(v - belt))
    run = simulate(plant({"x": v, "v": -x - stribeck * sign(v - belt)}), [0.0, belt], np.linspace(0.0, 40.0, 401))
    slips, sticks = [time for time, _ in released(run)], [time for time, _ in held(run)][1:]

    def slip(_time: float, state: np.ndarray) -> list[float]:
        force = kinetic + (static - kinetic) * math.exp(-20 * (belt - state[1]))
        return [state[1], -state[0] + force]

    def back(time: float, state: np.ndarray) -> float:
        return state[1] - belt if time > 0.1 else -1.0

    back.terminal, back.direction = True, 1  # type: ignore[attr-defined]
    alone = solve_ivp(slip, (0.0, 20.0), [static, belt], events=back, rtol=1e-11, atol=1e-12, method="DOP853")
    period = alone.t[-1] + (static - alone.y[0, -1]) / belt
    assert np.diff(slips) == pytest.approx(period, abs=1e-8)
    assert np.array(sticks) - slips[: len(sticks)] == pytest.approx(alone.t[-1], abs=1e-8)


def test_a_sliding_line_is_reached_and_followed() -> None:
    run = simulate(plant({"x": v, "v": -2 * sign(v + 3 * x)}), [0.1, -0.15], np.linspace(0.0, 3.0, 31))
    ((time, name),) = held(run)
    assert name in ("3*x + v = 0", "v + 3*x = 0")
    late = run.times > time
    np.testing.assert_allclose(run["v"][late], -3 * run["x"][late], atol=1e-14)
    start = run["x"][late][0]
    np.testing.assert_allclose(run["x"][late], start * np.exp(-3 * (run.times[late] - run.times[late][0])), atol=1e-13)


def test_two_blocks_stick_to_each_other_and_to_the_floor() -> None:
    v1, v2 = sp.symbols("v1 v2", real=True)
    between = 3 * sign(v1 - v2)
    blocks = plant({"v1": u - between, "v2": (between - sign(v2)) / 2})
    pulled = simulate(blocks, [0.0, 0.0], np.linspace(0.0, 8.0, 9), inputs={"u": TIME})
    # Together from u = 1 on, a = (t − 1)/3; apart where t − a = 3: at 4 s.
    assert released(pulled) == [
        (pytest.approx(1.0, abs=1e-12), "v2 = 0"),
        (pytest.approx(4.0, abs=1e-12), "v1 - v2 = 0"),
    ]
    np.testing.assert_allclose(pulled.final_state, [1.5 + 24.0 - 12.0, 1.5 + 4.0], atol=1e-11)
    coasting = simulate(blocks, [4.0, 1.0], np.linspace(0.0, 8.0, 9))
    # v1 falls at 3, v2 rises at 1; they meet at 3/4 s with 7/4, and stop after another 7/4 · 3 s.
    assert [time for time, _ in held(coasting)] == pytest.approx([0.75, 6.0], abs=1e-12)
    np.testing.assert_allclose(coasting.final_state, 0.0, atol=1e-15)


def test_a_row_of_ten_blocks_breaks_loose_one_after_the_other() -> None:
    places, speeds = sp.symbols("x0:10", real=True), sp.symbols("v0:10", real=True)
    forces = [-sign(speed) for speed in speeds]
    for k in range(9):
        spring = 10 * (places[k + 1] - places[k])
        forces[k] += spring
        forces[k + 1] -= spring
    forces[9] += u
    rates = {str(a): b for a, b in zip((*places, *speeds), (*speeds, *forces), strict=True)}
    run = simulate(plant(rates), np.zeros(20), np.linspace(0.0, 1.5, 16), inputs={"u": 3 * TIME})
    first, second = released(run)[:2]
    # x'' = 3 t − 1 − 10 x from 1/3 s on; the next block lets go where 10 x = 1.
    late = solve_ivp(
        lambda time, s: [s[1], 3 * time - 1 - 10 * s[0]],
        (1 / 3, 3.0),
        [0.0, 0.0],
        events=_terminal(lambda _time, s: s[0] - 0.1),
        rtol=1e-12,
        atol=1e-13,
    )
    assert first == (pytest.approx(1 / 3, abs=1e-12), "v9 = 0")
    assert second == (pytest.approx(late.t[-1], abs=1e-9), "v8 = 0")


def _terminal(function: object) -> object:
    function.terminal = True  # type: ignore[attr-defined]
    return function


@pytest.mark.parametrize("couplings", [(0.5, -1 / 3), (-0.5, 0.5), (0.9, 0.9)])
def test_two_relays_hold_both_surfaces(couplings: tuple[float, float]) -> None:
    a, b = couplings
    run = simulate(plant({"x": -sign(x) + a * sign(y), "y": b * sign(x) - sign(y)}), [1.0, 0.7], 40.0)
    assert len(run.modes[-1].held) == 2
    assert not run.final_state.any()


def test_a_jump_that_leads_away_on_both_sides_is_said_to_do_so() -> None:
    run = simulate(plant({"x": sign(x)}), [0.0], 1.0, throw=False)
    assert run.outcome is Outcome.AMBIGUOUS
    assert told(run, EventKind.AMBIGUOUS) == [(0.0, "x = 0")]
    assert simulate(plant({"x": sign(x)}), [0.1], 1.0).final_state[0] == pytest.approx(1.1)
    with pytest.raises(SimulationError, match=r"more than one motion can follow.*beside the surface"):
        simulate(plant({"x": sign(x)}), [0.0], 1.0)


def test_switchings_that_pile_up_are_named_with_their_instant() -> None:
    # Twisting: a half swing takes the speed down by √3.
    run = simulate(plant({"x": v, "v": -2 * sign(x) - sign(v)}), [1.0, 0.0], 10.0, throw=False)
    root = math.sqrt(2.0)
    end = root + (root / 3 + root / math.sqrt(3)) / (1 - 1 / math.sqrt(3))
    assert run.outcome is Outcome.ZENO
    ((time, name),) = told(run, EventKind.ZENO)
    assert time == pytest.approx(end, abs=1e-7)
    assert name in ("x = 0", "v = 0")
    np.testing.assert_allclose(run.final_state, 0.0, atol=1e-7)


def test_an_end_stop_takes_a_velocity_off_the_surface_that_held_it() -> None:
    v1, v2 = sp.symbols("v1 v2", real=True)
    # Two blocks move together until one of them bounces.
    carried = plant({"x": v1, "v1": -sign(v1 - v2) / 4, "v2": sign(v1 - v2) / 4})
    stop = EndStop(position="x", velocity="v1", lower=-10.0, upper=1.0, restitution=0.5)
    loop = Loop(plant=carried, hardware=Hardware(end_stops=(stop,)))
    run = simulate(loop, [0.0, 1.0, 1.0], np.linspace(0.0, 5.0, 11))
    assert [time for time, _ in held(run)] == pytest.approx([0.0, 1.0 + 1.5 / 0.5], abs=1e-9)
    assert [time for time, _ in released(run)] == pytest.approx([1.0], abs=1e-9)
    np.testing.assert_allclose(run.final_state[1:], 0.25, atol=1e-12)


def test_the_implicit_engine_holds_as_well() -> None:
    pytest.importorskip("sksundae")
    fast = plant({"i": 1e5 * (u - sp.Symbol("i", real=True)), "v": sp.Symbol("i", real=True) - sign(v) - v})
    run = simulate(fast, [0.0, 1.0], np.linspace(0.0, 3.0, 7), inputs={"u": 0.5}, engine=Implicit())
    assert run.final_state[1] == 0.0
    # v' = i − 1 − v; the winding takes 1e-5 s.
    assert held(run)[0][0] == pytest.approx(math.log(3.0), abs=1e-4)


def test_a_level_between_clamps_leaves_them_when_the_flow_turns() -> None:
    full = sp.And(x >= 2, u > 0)
    empty = sp.And(x <= 0, u < 0)
    clamped = plant({"x": sp.Piecewise((0, full), (0, empty), (u, True))})
    run = simulate(clamped, [1.0], np.linspace(0.0, 12.0, 121), inputs={"u": 2 * sp.sin(TIME)})
    times = run.times
    # Full at cos t = 1/2, empty at cos t = 0 after the turn at π, full again at cos t = 0 after 2 π.
    right = np.select(
        [times < math.pi / 3, times < math.pi, times < 1.5 * math.pi, times < 2 * math.pi, times < 2.5 * math.pi],
        [3 - 2 * np.cos(times), 2.0, -2 * np.cos(times), 0.0, 2 - 2 * np.cos(times)],
        np.where(times < 3 * math.pi, 2.0, np.where(times < 3.5 * math.pi, -2 * np.cos(times), 0.0)),
    )
    np.testing.assert_allclose(run["x"], right, rtol=0, atol=1e-9)


def test_an_empty_tank_stays_empty_until_it_is_fed_again() -> None:
    feed = Held.known(times=np.array([0.0, 5.0]), values=np.array([0.0, 0.5]))
    tank = plant({"x": u - sp.sqrt(sp.Max(x, 0))})
    run = simulate(tank, [1.0], np.linspace(0.0, 10.0, 21), inputs={"u": feed})
    assert not run["x"][4:11].any()
    root = math.sqrt(run.final_state[0])
    assert -2 * root - math.log(1 - 2 * root) == pytest.approx(5.0, abs=1e-7)
