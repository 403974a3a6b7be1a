"""Settling, crossings and other events of continuous runs, and mistakes in asking for them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from event_plants import BALL, GRID, SPRING, k, limited, stopped, system, u, v, x
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from ulna.base import UlnaError
from ulna.loop import EndStop, Hardware, Saturation
from ulna.sim import TIME, Crossing, Direction, EventKind, Outcome, Settling, simulate
from ulna.system import Parameter


def test_an_oscillator_settles_at_the_last_entry_into_its_band() -> None:
    damped = system({"x": v, "v": -25 * x - 2 * v})
    run = simulate(damped, (1.0, 0.0), GRID, events=(Settling(output="x"),))
    w = math.sqrt(24)

    def path(t: float) -> float:
        return math.exp(-t) * (math.cos(w * t) + math.sin(w * t) / w)

    fine = np.linspace(0, 5, 20001)
    outside = fine[np.abs([path(t) for t in fine]) > 0.02][-1]
    exact = brentq(lambda t: abs(path(t)) - 0.02, outside, outside + 5 / 20000, xtol=1e-15)
    (event,) = run.events
    assert (event.kind, event.signal) == (EventKind.SETTLED, "x")
    assert event.time == pytest.approx(exact, abs=1e-13)
    assert abs(event.state[0]) == pytest.approx(0.02, abs=1e-14)
    # It came into the band from where it was: upwards from below, downwards from above.
    assert event.direction == (1 if path(exact - 1e-6) < -0.02 else -1)
    mirrored = simulate(damped, (-1.0, 0.0), GRID, events=(Settling(output="x"),))
    assert mirrored.events[0].direction == -event.direction


def test_a_run_that_leaves_its_band_at_the_end_has_not_settled() -> None:
    run = simulate(SPRING, (1.0, 0.0), GRID, events=(Settling(output="x"), Settling(output="v")))
    assert run.events == ()


def test_crossings_are_found_with_their_direction() -> None:
    every = (
        Crossing(name="zero", expression=x),
        Crossing(name="up", expression="x", direction=Direction.RISING),
        Crossing(name="late", expression="x - k*t", direction=Direction.FALLING),
    )
    run = simulate(replace(SPRING, parameters=(Parameter(name="k", value=sp.S(1)),)), (1.0, 0.0), 9.0, events=every)
    zeros = np.arange(1, 6, 2) * math.pi / 2
    found = {
        name: [(event.time, event.direction) for event in run.events if event.signal == name]
        for name in ("zero", "up", "late")
    }
    assert found["zero"] == [(pytest.approx(t, abs=1e-13), s) for t, s in zip(zeros, (-1, 1, -1), strict=True)]
    assert found["up"] == [(pytest.approx(zeros[1], abs=1e-13), 1)]
    assert found["late"] == [(pytest.approx(brentq(lambda t: math.cos(t) - t, 0, 1, xtol=1e-15), abs=1e-13), -1)]
    assert [event.time for event in run.events] == sorted(event.time for event in run.events)


def test_crossings_agree_with_scipy_at_tight_tolerance() -> None:
    van_der_pol = system({"x": v, "v": k * (1 - x**2) * v - x}, k=2)
    run = simulate(van_der_pol, (2.0, 0.0), 30.0, events=(Crossing(name="c", expression=x * v - sp.Rational(1, 2)),))

    def crossing(_: float, z: np.ndarray) -> float:
        return z[0] * z[1] - 0.5

    reference = solve_ivp(
        lambda _, z: [z[1], 2 * (1 - z[0] ** 2) * z[1] - z[0]],
        (0, 30),
        (2.0, 0.0),
        "DOP853",
        rtol=1e-13,
        atol=1e-13,
        max_step=0.02,
        events=crossing,
    )
    assert len(run.events) == len(reference.t_events[0]) > 8
    np.testing.assert_allclose([event.time for event in run.events], reference.t_events[0], atol=1e-9)
    np.testing.assert_allclose([event.state for event in run.events], reference.y_events[0], atol=1e-9)


def test_a_terminal_crossing_ends_the_run_there() -> None:
    over = Crossing(name="down", expression=x, direction=Direction.FALLING, terminal=True)
    thrown = simulate(BALL, (0.0, 4.9), GRID, events=(over,))
    assert thrown.outcome is Outcome.STOPPED
    assert not thrown.outcome.finished
    assert thrown.times[-1] == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(thrown.final_state, (0.0, -4.9), atol=1e-13)
    assert np.array_equal(thrown.times[:-1], GRID[GRID < thrown.times[-1]])
    assert thrown.events[-1].state == tuple(thrown.final_state.tolist())


def test_what_never_passes_zero_is_no_event() -> None:
    touching = (Crossing(name="far", expression=x - 2), Crossing(name="square", expression=x**2 + v**2))
    assert simulate(SPRING, (1.0, 0.0), 20.0, events=touching).events == ()


def test_a_touch_of_zero_that_turns_back_is_no_passage() -> None:
    # x² touches zero at every zero of x; its double roots are not on both sides of zero.
    run = simulate(SPRING, (1.0, 0.0), 20.0, events=(Crossing(name="touch", expression=x**2),))
    assert run.events == ()
    just = simulate(SPRING, (1.0, 0.0), 9.0, events=(Crossing(name="just", expression=x**2 - sp.Float(1e-12)),))
    assert [event.direction for event in just.events] == [-1, 1] * 3


def test_passages_shortly_after_one_another_are_all_found() -> None:
    # Twice within 2e-5 s, far below the step.
    close = Crossing(name="close", expression=(TIME - 1) * (TIME - 1 - sp.Float(2e-5)))
    run = simulate(SPRING, (1.0, 0.0), 5.0, events=(close,))
    np.testing.assert_allclose([event.time for event in run.events], (1.0, 1.00002), atol=1e-10)


def test_an_event_in_the_middle_leaves_the_path_alone() -> None:
    plain = simulate(SPRING, (1.0, 0.0), GRID)
    watched = simulate(SPRING, (1.0, 0.0), GRID, events=(Crossing(name="far", expression=1000000 * x),))
    assert len(watched.events) == 2
    np.testing.assert_allclose(watched.states, plain.states, atol=1e-13)


def test_blowing_up_is_an_event_too() -> None:
    growing = system({"x": x**2, "v": 0 * x})
    run = simulate(growing, (1.0, 0.0), GRID, throw=False, events=(Crossing(name="ten", expression=x - 10),))
    assert [(event.kind, event.time) for event in run.events] == [
        (EventKind.CROSSED, pytest.approx(0.9, abs=1e-13)),
        (EventKind.BLEW_UP, pytest.approx(1.0 - 1e-12, abs=1e-13)),
    ]
    assert run.outcome is Outcome.BLEW_UP


def test_the_same_events_come_out_of_every_grid() -> None:
    ball = stopped(BALL, lower=0.0, restitution=0.6)
    coarse = simulate(ball, (1.0, 0.0), 3.0)
    fine = simulate(ball, (1.0, 0.0), np.linspace(0, 3, 3001))
    assert len(coarse.events) == len(fine.events)
    np.testing.assert_allclose([e.time for e in coarse.events], [e.time for e in fine.events], atol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"events": [Crossing(name="e", expression="x - w")]}, "event 'e'.*unknown symbol 'w'"),
        ({"events": [Crossing(name="e", expression=sp.Symbol("w", real=True))]}, "event 'e' of 'plant': .*uses w"),
        ({"events": [Crossing(name="e", expression=sp.Symbol("x"))]}, "symbols are real"),
        ({"events": [Settling(output="w")]}, "settling of 'w': there is no such output. Known: x, v"),
        ({"end_stops": (EndStop(position="x", velocity="v", lower=0.5),)}, "x = 0 does not lie between 0.5 and inf"),
        (
            {"end_stops": (EndStop(position="w", velocity="v", upper=1.0),)},
            "it has no state w. Its states: x, v",
        ),
        (
            {"end_stops": (EndStop(position="v", velocity="x", upper=1.0),)},
            r"v' = .* does not stand still with x = 0",
        ),
        (
            {"saturation": {"w": Saturation(lower=-1, upper=1)}},
            "no signal w there. Known: u",
        ),
    ],
)
def test_wrong_events_are_refused_in_plain_words(arguments: dict, message: str) -> None:
    plant = system({"x": v, "v": u - k * x - 1}, inputs="u", k=2)
    events = arguments.pop("events", ())
    with pytest.raises(UlnaError, match=message):
        simulate(limited(plant, **arguments), (0.0, 0.0), 2.0, events=events)


@pytest.mark.parametrize(
    "make",
    [
        lambda: EndStop(position="x", velocity="v", lower=1.0, upper=-1.0),
        lambda: EndStop(position="x", velocity="v", upper=1.0, restitution=1.5),
        lambda: Saturation(lower=1.0, upper=-1.0),
        lambda: Settling(output="x", fraction=0.0),
        lambda: Settling(output="x", target=math.nan),
        lambda: Hardware(end_stops=(EndStop(position="x", velocity="v", upper=1.0),) * 2),
    ],
)
def test_rules_that_make_no_sense_are_refused(make: object) -> None:
    with pytest.raises(UlnaError):
        make()  # type: ignore[operator]


def test_a_plant_without_inputs_cannot_be_limited() -> None:
    with pytest.raises(UlnaError, match="no inputs"):
        simulate(limited(SPRING, saturation=Saturation(lower=-1, upper=1)), (1.0, 0.0), 1.0)
