"""Simulations against closed forms and other integrators."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import ulna
from ulna.base import SimulationError, UlnaError
from ulna.program import to_python
from ulna.sim import TIME, Held, Interpolated, Outcome, Taylor, Trajectory, simulate
from ulna.sim.continuous.flow import Flow
from ulna.symbolic.compiling import kernel
from ulna.system import Parameter, Signal, System

x, y, u, k = sp.symbols("x y u k", real=True)


def system(rates: dict[str, sp.Expr], *, inputs: str = "", parameters: dict[str, object] | None = None) -> System:
    """A system whose states are its outputs."""
    states = tuple(Signal(name=name) for name in rates)
    return System(
        name="plant",
        states=states,
        rates=tuple(map(sp.S, rates.values())),
        inputs=tuple(Signal(name=name, unit="V") for name in inputs.split()),
        outputs=states,
        readouts=tuple(signal.symbol for signal in states),
        parameters=tuple(
            Parameter(name=name, value=None if value is None else sp.Rational(str(value)))
            for name, value in (parameters or {}).items()
        ),
    )


PENDULUM = system({"x": y, "y": -sp.sin(x) - y / 5})
DRIVEN = system({"x": u - x}, inputs="u")
GRID = np.linspace(0.0, 5.0, 101)


def test_linear_system_follows_the_matrix_exponential() -> None:
    matrix = sp.Matrix(3, 3, [0, 1, 0, 0, 0, 1, -30, -21, -sp.Rational(13, 2)])
    states = sp.symbols("a b c", real=True)
    linear = system({s.name: rate for s, rate in zip(states, matrix * sp.Matrix(states), strict=True)})
    initial = np.array([1.0, -2.0, 0.5])
    trajectory = simulate(linear, initial, GRID)
    numbers = np.array(matrix.tolist(), dtype=float)
    exact = np.array([expm(numbers * t) @ initial for t in GRID])
    np.testing.assert_allclose(trajectory.states, exact, rtol=0, atol=1e-12)


def test_pendulum_agrees_with_scipy_along_the_path() -> None:
    f = to_python(kernel("f", (x, y), {"x'": y, "y'": -sp.sin(x) - y / 5}))
    reference = solve_ivp(lambda _, z: f(*z), (0, 5), (2.0, 1.0), "DOP853", t_eval=GRID, rtol=1e-13, atol=1e-13)
    trajectory = simulate(PENDULUM, (2.0, 1.0), GRID)
    np.testing.assert_allclose(trajectory.states, reference.y.T, rtol=0, atol=1e-10)


def test_the_error_follows_the_tolerance() -> None:
    oscillator = system({"x": y, "y": -x})
    exact = np.stack([np.cos(GRID), -np.sin(GRID)], axis=1)
    tolerances = np.array([1e-4, 1e-6, 1e-8, 1e-10])
    errors = [
        np.abs(simulate(oscillator, (1, 0), GRID, engine=Taylor(tolerance=t, optimise=False)).states - exact).max()
        for t in tolerances
    ]
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert 0.7 < slope < 1.3
    assert all(error < 10 * tolerance for error, tolerance in zip(errors, tolerances, strict=True))


def test_many_states_are_compiled_compactly_and_stay_exact() -> None:
    count = 16
    states = sp.symbols(f"q0:{count}", real=True)
    chain = system({s.name: (states[k - 1] if k else 0) - s for k, s in enumerate(states)})
    matrix = np.eye(count, k=-1) - np.eye(count)
    run = simulate(chain, np.ones(count), GRID[::20])
    exact = [expm(matrix * t) @ np.ones(count) for t in GRID[::20]]
    np.testing.assert_allclose(run.states, exact, rtol=0, atol=1e-12)


def test_threads_do_not_disturb_each_other() -> None:
    starts = [(0.1 * k, 1.0) for k in range(24)]
    alone = [simulate(PENDULUM, start, GRID).states for start in starts]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda start: simulate(PENDULUM, start, GRID).states, starts))
    assert all(np.array_equal(a, b) for a, b in zip(alone, together, strict=True))


def test_a_run_that_starts_beyond_the_bound_may_come_back() -> None:
    run = simulate(system({"x": -x}), [1e13], GRID)
    np.testing.assert_allclose(run["x"], 1e13 * np.exp(-GRID), rtol=1e-12)


def test_a_final_time_alone_gives_the_same_last_state_as_a_grid() -> None:
    short = simulate(PENDULUM, (2.0, 1.0), 5.0)
    assert short.times.tolist() == [0.0, 5.0]
    np.testing.assert_allclose(short.final_state, simulate(PENDULUM, (2.0, 1.0), GRID).final_state, atol=1e-13)


def test_the_same_call_gives_the_same_bits() -> None:
    first, second = (simulate(PENDULUM, (2.0, 1.0), GRID).states for _ in range(2))
    assert np.array_equal(first, second)


def test_a_run_may_start_later_than_zero() -> None:
    late = simulate(system({"x": u}, inputs="u"), [0.0], (2.0, 3.0), inputs={"u": TIME})
    assert late.final_state[0] == pytest.approx((9 - 4) / 2, abs=1e-13)


def test_initial_states_may_be_given_by_name() -> None:
    by_name = simulate(PENDULUM, {"y": 1.0, "x": 2.0}, 5.0)
    assert np.array_equal(by_name.states, simulate(PENDULUM, (2.0, 1.0), 5.0).states)


def test_quadratic_growth_blows_up_at_the_right_time() -> None:
    growing = system({"x": x**2})
    trajectory = simulate(growing, [1.0], GRID, throw=False)
    assert trajectory.outcome is Outcome.BLEW_UP
    assert trajectory.times[-1] == pytest.approx(1.0 - 1e-12, abs=1e-13)
    assert trajectory.final_state[0] == pytest.approx(1e12, rel=1e-2)
    np.testing.assert_allclose(trajectory.states[:20, 0], 1 / (1 - GRID[:20]), rtol=1e-11)
    with pytest.raises(
        SimulationError, match=r"at 1 s the norm of the state passed the bound \(x = 1e\+12\)"
    ) as caught:
        simulate(growing, [1.0], 5.0)
    partial = caught.value.value
    assert isinstance(partial, Trajectory)
    assert partial.outcome is Outcome.BLEW_UP


def test_exponential_growth_stops_at_a_bound_of_ones_own() -> None:
    unstable = system({"x": 3 * x})
    run = simulate(unstable, [1.0], GRID, engine=Taylor(bound=100.0), throw=False)
    assert run.outcome is Outcome.BLEW_UP
    assert run.times[-1] == pytest.approx(math.log(100.0) / 3, abs=1e-12)
    assert simulate(unstable, [1.0], 5.0).outcome is Outcome.FINISHED


def test_leaving_the_domain_is_told_apart_from_blowing_up() -> None:
    draining = simulate(system({"x": -sp.sqrt(x) - 1}), [1.0], GRID, throw=False)
    assert draining.outcome is Outcome.EDGE
    assert np.isfinite(draining.states).all()
    nowhere = simulate(system({"x": sp.log(x)}), [-1.0], GRID, throw=False)
    assert (nowhere.outcome, len(nowhere.times)) == (Outcome.EDGE, 1)


def test_running_out_of_steps_is_reported() -> None:
    run = simulate(PENDULUM, (2.0, 1.0), GRID, engine=Taylor(maximum_steps=3), throw=False)
    assert run.outcome is Outcome.STEP_LIMIT
    with pytest.raises(SimulationError, match="number of steps"):
        simulate(PENDULUM, (2.0, 1.0), 5.0, engine=Taylor(maximum_steps=3))


def test_parameters_change_between_runs_without_compiling(monkeypatch: pytest.MonkeyPatch) -> None:
    decay = system({"x": -k * x}, parameters={"k": 1})
    assert simulate(decay, [1.0], 1.0).final_state[0] == pytest.approx(math.exp(-1), abs=1e-14)
    monkeypatch.setattr(Flow, "_compiled", lambda *_, **__: pytest.fail("compiled anew"))
    for value in (0.5, 2.0, 0.0):
        run = simulate(decay, [1.0], 1.0, parameters={"k": value})
        assert run.final_state[0] == pytest.approx(math.exp(-value), abs=1e-14)
        assert run.parameters == {"k": value}


def test_equal_systems_share_one_compiled_flow(monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = (system({"x": -k * sp.tanh(x)}, parameters={"k": 3}) for _ in range(2))
    simulate(first, [1.0], 1.0)
    monkeypatch.setattr(Flow, "_compiled", lambda *_, **__: pytest.fail("compiled anew"))
    simulate(second, [1.0], 1.0)


def test_constant_and_absent_inputs() -> None:
    assert simulate(DRIVEN, [2.0], 1.0).final_state[0] == pytest.approx(2 * math.exp(-1), abs=1e-14)
    driven = simulate(DRIVEN, [0.0], GRID, inputs={"u": 3})
    np.testing.assert_allclose(driven["x"], 3 * (1 - np.exp(-GRID)), atol=1e-13)
    assert np.array_equal(driven["u"], np.full(len(GRID), 3.0))


def test_formula_of_time_and_parameters() -> None:
    scaled = system({"x": u - x}, inputs="u", parameters={"k": 2})
    run = simulate(scaled, [0.0], GRID, inputs={"u": k * sp.sin(TIME)})
    np.testing.assert_allclose(run["x"], np.sin(GRID) - np.cos(GRID) + np.exp(-GRID), atol=1e-13)
    np.testing.assert_allclose(run["u"], 2 * np.sin(GRID), atol=1e-15)


def test_held_samples_are_exact_between_their_jumps() -> None:
    held = Held(times=np.array([0.0, 1.03, 2.5]), values=np.array([1.0, -2.0, 0.0]))
    run = simulate(DRIVEN, [0.0], GRID, inputs={"u": held})
    first = 1 - math.exp(-1.03)
    second = -2 + (first + 2) * math.exp(-1.47)
    exact = np.where(
        GRID < 1.03,
        1 - np.exp(-GRID),
        np.where(GRID < 2.5, -2 + (first + 2) * np.exp(1.03 - GRID), second * np.exp(2.5 - GRID)),
    )
    np.testing.assert_allclose(run["x"], exact, atol=1e-13)
    assert np.array_equal(run.times, GRID)
    assert simulate(DRIVEN, [0.0], 5.0, inputs={"u": held}).final_state[0] == pytest.approx(exact[-1], abs=1e-13)


def test_interpolated_samples_are_straight_lines() -> None:
    line = Interpolated.of(lambda t: 2 * t, [0.0, 0.7, 5.0])
    run = simulate(DRIVEN, [0.0], GRID, inputs={"u": line})
    np.testing.assert_allclose(run["x"], 2 * (GRID - 1 + np.exp(-GRID)), atol=1e-13)
    np.testing.assert_allclose(run["u"], 2 * GRID, atol=1e-14)


def test_saturation_is_entered_and_left_exactly() -> None:
    limited = system({"x": sp.Min(sp.Max(u, -1), 1)}, inputs="u")
    run = simulate(limited, [0.0], GRID, inputs={"u": 2 * sp.sin(TIME)})

    def integral(t: float) -> float:
        edges = [0.0, math.pi / 6, 5 * math.pi / 6, 7 * math.pi / 6, 11 * math.pi / 6]
        pieces = [lambda s: -2 * math.cos(s), lambda s: s, lambda s: -2 * math.cos(s), lambda s: -s]
        return sum(p(min(max(t, a), b)) - p(a) for p, a, b in zip(pieces, edges[:-1], edges[1:], strict=True))

    np.testing.assert_allclose(run["x"], [integral(t) for t in GRID], atol=1e-12)


def test_a_bouncing_force_of_the_state_is_located() -> None:
    # One-sided spring: half periods of π/2 and π/20 in turn.
    spring = system({"x": y, "y": sp.Piecewise((-4 * x, x > 0), (-400 * x, True))})
    half = np.pi / 2 + np.pi / 20
    run = simulate(spring, (0.0, 1.0), (0.0, half, 2 * half))
    np.testing.assert_allclose(run.states, [[0, 1], [0, 1], [0, 1]], atol=1e-11)


def test_a_guard_that_starts_at_zero_takes_the_side_it_moves_to() -> None:
    for direction in (1.0, -1.0):
        moving = system({"x": sp.S(direction) + 0 * x, "y": sp.Heaviside(x)})
        assert simulate(moving, (0.0, 0.0), 2.0).final_state[1] == pytest.approx(
            2.0 if direction > 0 else 0.0, abs=1e-5
        )


def test_dry_friction_at_rest_stays_at_rest() -> None:
    assert simulate(system({"x": -sp.sign(x)}), [0.0], 1.0).final_state[0] == 0.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"initial": [1.0]}, r"shape \(1,\) instead of \(2,\).*x, y"),
        ({"initial": [1.0, math.nan]}, "y = nan"),
        ({"initial": np.array(["a", "b"])}, "row of numbers"),
        ({"initial": {"x": 1.0, "z": 0.0}}, "missing: y; unknown: z"),
        ({"times": [0.0, 1.0, 1.0]}, "1 s follows 1 s"),
        ({"times": [-1.0, 1.0]}, "-1 s is negative"),
        ({"times": -5.0}, "-5 s is negative"),
        ({"times": [0.0]}, "at least two"),
        ({"times": [0.0, math.nan]}, "not a finite"),
        ({"parameters": {"q": 1.0}}, "no such parameter"),
        ({"parameters": {"k": math.inf}}, "inf"),
        ({"parameters": {"k": 0.0}}, r"not finite for these parameters \(zero: k\)"),
        ({"inputs": {"w": 1.0}}, "no input w"),
        ({"inputs": {"u": math.nan}}, "nan"),
        ({"inputs": {"u": "sin"}}, "a str cannot drive it"),
        ({"inputs": {"u": x * TIME}}, "uses x"),
        ({"inputs": {"u": Held(times=np.array([1.0]), values=np.array([0.0]))}}, "given from 1 s to 1 s"),
        ({"inputs": {"u": Interpolated(times=np.array([0.0, 1.0]), values=np.zeros(2))}}, "given from 0 s to 1 s"),
    ],
)
def test_wrong_calls_are_refused_in_plain_words(arguments: dict, message: str) -> None:
    plant = system({"x": y / k, "y": u - x}, inputs="u", parameters={"k": 2})
    with pytest.raises(SimulationError, match=message):
        simulate(plant, **{"initial": (0.0, 0.0), "times": 2.0, **arguments})


def test_parameters_without_value_are_named() -> None:
    open_ended = system({"x": -k * x}, parameters={"k": None})
    with pytest.raises(SimulationError, match="without a value: k"):
        simulate(open_ended, [1.0], 1.0)
    assert simulate(open_ended, [1.0], 1.0, parameters={"k": 1.0}).outcome is Outcome.FINISHED


@pytest.mark.parametrize("settings", [{"tolerance": 0.0}, {"bound": -1.0}, {"bound": math.nan}, {"maximum_steps": 0}])
def test_settings_out_of_range_are_refused(settings: dict) -> None:
    with pytest.raises(SimulationError):
        Taylor(**settings)


@pytest.mark.parametrize(
    ("times", "values"), [([0.0, 1.0], [1.0]), ([1.0, 0.0], [1.0, 2.0]), ([0.0], [math.nan]), ([], [])]
)
def test_samples_that_make_no_sense_are_refused(times: list[float], values: list[float]) -> None:
    for kind in (Held, Interpolated):
        with pytest.raises(SimulationError):
            kind(times=np.array(times), values=np.array(values))


def test_a_plant_may_be_given_by_its_name_or_its_file(tmp_path: Path) -> None:
    plant = ulna.model("duffing").with_values()
    path = tmp_path / "swing.toml"
    ulna.write_system(plant, path)
    wanted = simulate(plant, [1, 0], 1.0).states
    assert np.array_equal(simulate("duffing", [1, 0], 1.0).states, wanted)
    assert np.array_equal(simulate(path, [1, 0], 1.0).states, wanted)
    with pytest.raises(UlnaError, match="Did you mean duffing"):
        simulate("dufing", [1, 0], 1.0)
