"""Saturation of continuous runs, entered and left at exact instants."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp
from event_plants import GRID, limited, loop_of, system, times, u, v, x
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import ulna
from ulna.loop import EndStop, Hardware, Loop, Saturation
from ulna.sim import TIME, EventKind, simulate


def test_a_saturated_double_integrator_switches_at_the_instants_of_the_closed_form() -> None:
    loop = loop_of(-x - v, saturation={"u": Saturation(lower=-1, upper=1)})
    grid = np.linspace(0, 20, 201)
    run = simulate(loop, (10.0, 0.0), grid)
    # u = −1 from x = 10: x = 10 − t²/2, v = −t, the command −x − v = −1 at t² − … = 0.
    left = -1 + math.sqrt(1 + 2 * 9)
    kinds = [event.kind for event in run.events]
    assert kinds == [EventKind.SATURATION_ENTERED, EventKind.SATURATION_LEFT] * 2
    assert [event.direction for event in run.events] == [-1, -1, 1, 1]
    assert run.events[0].time == 0.0
    assert run.events[1].time == pytest.approx(left, abs=1e-13)

    def linear(t: float) -> np.ndarray:
        """Unsaturated from `left` on: x'' + x' + x = 0."""
        start = np.array([10 - left**2 / 2, -left])
        w, s = math.sqrt(0.75), t - left
        a, b = start[0], (start[1] + start[0] / 2) / w
        decay = math.exp(-s / 2)
        place = decay * (a * math.cos(w * s) + b * math.sin(w * s))
        speed = decay * w * (b * math.cos(w * s) - a * math.sin(w * s)) - place / 2
        return np.array([place, speed])

    entered = brentq(lambda t: -linear(t).sum() - 1.0, left + 0.1, left + 1.0, xtol=1e-15)
    assert run.events[2].time == pytest.approx(entered, abs=1e-13)
    np.testing.assert_allclose(run.events[2].state, linear(entered), atol=1e-13)
    speed = linear(entered)[1]
    # u = 1: the command −x − v is back at 1 where s²/2 + s (speed + 1) is zero again.
    assert run.events[3].time == pytest.approx(entered - 2 * (speed + 1), abs=1e-12)
    first = grid[grid <= left]
    np.testing.assert_allclose(run["x"][grid <= left], 10 - first**2 / 2, atol=1e-13)
    assert (run["u"].min(), run["u"].max()) == (-1.0, 1.0)
    np.testing.assert_allclose(run.further["u_command"].values, -run["x"] - run["v"], atol=1e-14)
    assert np.array_equal(run.further["u_limited"].values, run["u"])


def test_a_spring_that_saturates_keeps_its_energy() -> None:
    # The force −sat(4 x) has the potential 2 x² within 1/4 and |x| − 1/8 beyond.
    loop = loop_of(-4 * x, saturation=Saturation(lower=-1, upper=1))
    run = simulate(loop, (3.0, 0.5), np.linspace(0, 60, 601))
    place = np.abs(run["x"])
    energy = run["v"] ** 2 / 2 + np.where(place < 0.25, 2 * place**2, place - 0.125)
    assert len(run.events) > 20
    np.testing.assert_allclose(energy, 3.0, rtol=0, atol=1e-11)


def test_a_saturated_loop_agrees_with_scipy_restarted_at_every_switch() -> None:
    loop = loop_of(-4 * sp.sin(x) - v / 2, saturation=Saturation(lower=-0.5, upper=0.7))
    grid = np.linspace(0, 15, 151)
    run = simulate(loop, (2.0, 0.0), grid)

    def command(z: np.ndarray) -> float:
        return -4 * math.sin(z[0]) - z[1] / 2

    def upper(_: float, z: np.ndarray) -> float:
        return command(z) - 0.7

    def lower(_: float, z: np.ndarray) -> float:
        return command(z) + 0.5

    def field(_: float, z: np.ndarray) -> list[float]:
        return [z[1], min(0.7, max(-0.5, command(z)))]

    reference = solve_ivp(
        field, (0, 15), (2.0, 0.0), "DOP853", rtol=1e-12, atol=1e-12, max_step=2e-3, events=(upper, lower)
    )
    found = np.sort(np.concatenate(reference.t_events))
    mine = [event.time for event in run.events if event.time > 0]
    assert len(mine) == len(found) > 4
    np.testing.assert_allclose(mine, found, atol=1e-8)
    np.testing.assert_allclose(run.final_state, reference.y[:, -1], atol=1e-9)


def test_a_limited_input_of_a_plant_is_clipped_exactly() -> None:
    run = simulate(
        limited(system({"x": u}, inputs="u"), saturation=Saturation(lower=-1, upper=math.inf)),
        [0.0],
        GRID,
        inputs={"u": 2 * sp.sin(TIME)},
    )
    edges = [7 * math.pi / 6, 11 * math.pi / 6]
    assert [event.time for event in run.events] == [pytest.approx(edges[0], abs=1e-14)]
    exact = [2 - 2 * math.cos(t) if t < edges[0] else 2 - 2 * math.cos(edges[0]) - (t - edges[0]) for t in run.times]
    np.testing.assert_allclose(run["x"], exact, atol=1e-13)
    np.testing.assert_allclose(run.further["u_limited"].values, np.maximum(run["u"], -1.0))


def test_the_observer_of_a_closed_loop_reads_the_limited_input() -> None:
    arm = ulna.model("one_link_arm").with_values()
    law = ulna.state_feedback(ulna.controller_form(arm), ulna.Poles("-2+2*sqrt(3)*j", "-2-2*sqrt(3)*j", -8))
    observer = ulna.exact_observer(ulna.observer_form(arm), ulna.Poles(-9, -10, -11))
    compensator = ulna.compensator(law, observer)
    tight = Hardware(saturation={"u": Saturation(lower=-15, upper=15)})
    run = simulate(Loop(plant=arm, controller=compensator, hardware=tight), (1, 0, 0), GRID)
    assert times(run, EventKind.SATURATION_ENTERED)
    assert abs(run["u"]).max() == 15.0
    # The error of the exact observer obeys a linear equation whatever the input, if it is told the input.
    free = simulate(Loop(plant=arm, controller=compensator), (1, 0, 0, 0, 0, 0), GRID)
    assert abs(free["u"]).max() > 20.0
    np.testing.assert_allclose(run["theta_hat"] - run["theta"], free["theta_hat"] - free["theta"], atol=1e-11)


def test_limits_that_are_never_reached_change_nothing() -> None:
    wide = loop_of(
        -x - v,
        saturation={"u": Saturation(lower=-100, upper=100)},
        end_stops=(EndStop(position="x", velocity="v", lower=-50.0, upper=50.0),),
    )
    run = simulate(wide, (10.0, 0.0), GRID)
    np.testing.assert_allclose(run.states, simulate(loop_of(-x - v), (10.0, 0.0), GRID).states, atol=1e-12)
    assert run.events == ()


@pytest.mark.parametrize("command", [-4 * sp.sign(v + x), sp.Piecewise((-4, v + x > 0), (4, True))])
def test_a_relay_behind_a_limit_slides_by_what_the_limit_leaves(command) -> None:
    run = simulate(loop_of(command, saturation={"u": Saturation(lower=-2, upper=2)}), (1.0, 0.0), np.linspace(0, 5, 51))
    # x = 1 − t² until v + x = 0 at t = √2 − 1, then x' = −x.
    met = math.sqrt(2) - 1
    assert [event.kind for event in run.events] == [EventKind.HELD]
    assert run.events[0].time == pytest.approx(met, abs=1e-13)
    assert run["x"][-1] == pytest.approx((1 - met**2) * math.exp(met - 5), rel=1e-9)
