"""End stops of continuous runs at exact instants."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp
from event_plants import BALL, FREE, GRID, k, limited, stopped, system, times, u, v, x
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from ulna.loop import EndStop, Saturation
from ulna.sim import TIME, Crossing, EventKind, Held, Taylor, simulate

G = 9.8


@pytest.mark.parametrize("restitution", [0.3, 0.8, 1.0])
def test_a_ball_bounces_at_the_times_of_the_closed_form(restitution: float) -> None:
    run = simulate(stopped(BALL, lower=0.0, restitution=restitution), (1.0, 0.0), GRID)
    fall = math.sqrt(2 / G)
    bounces = times(run, EventKind.BOUNCED)
    flights = 2 * fall * restitution ** np.arange(1, len(bounces))
    assert len(bounces) > 5
    np.testing.assert_allclose(bounces, fall + np.concatenate(([0.0], np.cumsum(flights))), rtol=0, atol=1e-13)
    assert run["x"].min() >= 0.0
    if restitution == 1.0:
        np.testing.assert_allclose(G * run["x"] + run["v"] ** 2 / 2, G, atol=1e-12)


def test_a_ball_comes_to_rest_when_its_last_bounce_is_over() -> None:
    run = simulate(stopped(BALL, lower=0.0, restitution=0.5), (1.0, 0.0), GRID)
    (rest,) = times(run, EventKind.END_STOP_ENTERED)
    exact = math.sqrt(2 / G) * (1 + 2 * 0.5 / (1 - 0.5))
    assert rest == pytest.approx(exact, abs=2e-9 * 5.0)
    assert not run.states[exact < GRID].any()


@pytest.mark.parametrize("floor", [0.738, -12.3])
def test_a_floor_that_is_not_at_zero_lets_no_ball_through(floor: float) -> None:
    run = simulate(stopped(BALL, lower=floor, restitution=0.06), (1.0 + floor, 0.0), GRID)
    exact = math.sqrt(2 / G) * (1 + 2 * 0.06 / (1 - 0.06))
    (rest,) = times(run, EventKind.END_STOP_ENTERED)
    assert rest == pytest.approx(exact, abs=1e-6)
    assert np.array_equal(run.final_state, [floor, 0.0])
    assert run["x"].min() == floor


def test_positions_stay_between_their_stops_whatever_pushes_them() -> None:
    random = np.random.default_rng(1)
    pushed = system({"x": v, "v": u - k * sp.sin(x)}, inputs="u", k=1)
    for _ in range(12):
        low, high = -random.uniform(0.01, 2), random.uniform(0.01, 2)
        wall = EndStop(position="x", velocity="v", lower=low, upper=high, restitution=random.uniform(0, 0.9))
        run = simulate(
            limited(pushed, end_stops=(wall,), saturation=Saturation(lower=-10, upper=10)),
            (random.choice([low, high, 0.5 * (low + high)]), 0.0),
            np.linspace(0, 6, 61),
            inputs={"u": random.uniform(1, 30) * sp.sin(random.uniform(0.3, 15) * TIME + random.uniform(0, 6))},
            parameters={"k": random.uniform(0.1, 20)},
            engine=Taylor(optimise=False),
        )
        assert run["x"].min() >= low - 1e-12
        assert run["x"].max() <= high + 1e-12
        assert run.events


def test_a_pendulum_that_hits_a_stop_keeps_its_energy_times_the_square_of_the_restitution() -> None:
    pendulum = system({"x": v, "v": -sp.sin(x)})
    run = simulate(stopped(pendulum, upper=1.6, lower=-0.5, restitution=0.7), (1.5, 0.0), np.linspace(0, 20, 401))
    hits = [event for event in run.events if event.kind is EventKind.BOUNCED]

    def field(_: float, z: np.ndarray) -> list[float]:
        return [z[1], -math.sin(z[0])]

    def wall(_: float, z: np.ndarray) -> float:
        return z[0] + 0.5

    wall.terminal, wall.direction = True, -1.0  # type: ignore[attr-defined]
    begin, state = 0.0, np.array([1.5, 0.0])
    for hit in hits:
        path = solve_ivp(field, (begin, 20), state, "DOP853", rtol=1e-13, atol=1e-13, events=wall)
        begin, state = path.t[-1], np.array([-0.5, -0.7 * path.y[1, -1]])
        assert hit.time == pytest.approx(begin, abs=1e-9)
        np.testing.assert_allclose(hit.state, state, atol=1e-9)
        assert hit.direction == -1
    energies = [-math.cos(-0.5) + 0.5 * event.state[1] ** 2 for event in hits]
    swing = -math.cos(1.5)
    for energy in energies:
        swing = -math.cos(-0.5) + 0.49 * (swing + math.cos(-0.5))
        assert energy == pytest.approx(swing, abs=1e-12)


def test_a_mass_pushed_against_a_stop_leaves_it_when_the_force_turns() -> None:
    run = simulate(stopped(FREE, upper=0.5), (0.5, 0.0), np.linspace(0, 6, 61), inputs={"u": sp.sin(TIME)})
    assert [event.kind for event in run.events] == [EventKind.END_STOP_ENTERED, EventKind.END_STOP_LEFT]
    assert run.events[0].time == 0.0
    assert run.events[1].time == pytest.approx(math.pi, abs=1e-14)
    # x'' = sin t from rest at π.
    later = np.maximum(run.times - math.pi, 0.0)
    np.testing.assert_allclose(run["x"], 0.5 - (later - np.sin(later)), atol=1e-13)


def test_a_mass_that_leaves_a_stop_slowly_finds_it_again() -> None:
    # Released with zero speed and zero acceleration: the way back starts at the stop itself.
    run = simulate(stopped(FREE, upper=0.0), (0.0, 0.0), 7.0, inputs={"u": sp.cos(TIME)})
    # x'' = cos t from rest at π/2, x = −cos t − (t − π/2): never back; with the wall below it is.
    assert times(run, EventKind.END_STOP_LEFT) == [pytest.approx(math.pi / 2, abs=1e-14)]
    back = simulate(stopped(FREE, upper=0.0), (0.0, 0.0), 7.0, inputs={"u": sp.sin(TIME) - sp.Rational(1, 2)})

    # From 5π/6 on x'' = sin t − 1/2 < 0, later > 0 again.
    def position(t: float, start: float) -> float:
        return -math.sin(t) + math.sin(start) + math.cos(start) * (t - start) - (t - start) ** 2 / 4

    entered = times(back, EventKind.END_STOP_ENTERED)
    left = times(back, EventKind.END_STOP_LEFT)
    first = brentq(lambda t: position(t, 0.0), 0.5, 3.0, xtol=1e-15)
    assert entered == [pytest.approx(first, abs=1e-13)]
    assert left == [pytest.approx(5 * math.pi / 6, abs=1e-13)]
    assert position(7.0, 5 * math.pi / 6) == pytest.approx(back.final_state[0], abs=1e-12)


def test_a_velocity_that_stood_at_zero_at_a_stop_is_watched_again_after_it() -> None:
    # At rest until π/2, then v = sin t − 1 and x = −cos t − (t − π/2).
    run = simulate(
        stopped(FREE, upper=0.0, lower=-10.0),
        (0.0, 0.0),
        np.linspace(0, 9, 91),
        inputs={"u": sp.cos(TIME)},
        events=(
            Crossing(name="turn", expression=v + sp.Rational(1, 2)),
            Crossing(name="rest", expression=v + x / 1000),
        ),
    )
    turns = [event.time for event in run.events if event.signal == "turn"]
    np.testing.assert_allclose(turns, [5 * math.pi / 6, 13 * math.pi / 6, 17 * math.pi / 6], atol=1e-12)
    assert [event.kind for event in run.events if event.signal == "rest"] == []


def test_a_held_input_that_jumps_lets_go_at_its_jump() -> None:
    force = Held(times=np.array([0.0, 1.0]), values=np.array([1.0, -1.0]))
    run = simulate(stopped(FREE, upper=0.125), (0.0, 0.0), GRID, inputs={"u": force})
    assert [(event.kind, event.time) for event in run.events] == [
        (EventKind.END_STOP_ENTERED, pytest.approx(0.5, abs=1e-14)),
        (EventKind.END_STOP_LEFT, 1.0),
    ]
    np.testing.assert_allclose(run["x"][GRID >= 1], 0.125 - (GRID[GRID >= 1] - 1) ** 2 / 2, atol=1e-13)


def test_without_force_a_mass_that_stops_dead_stays_and_an_elastic_one_comes_back() -> None:
    puck = system({"x": v, "v": 0})
    dead = simulate(stopped(puck, lower=-1.0, upper=1.0), (0.0, 1.0), 5.0)
    np.testing.assert_allclose(dead.final_state, (1.0, 0.0), atol=1e-15)
    elastic = simulate(stopped(puck, lower=-1.0, upper=1.0, restitution=1.0), (0.0, 1.0), 5.0)
    np.testing.assert_allclose(times(elastic, EventKind.BOUNCED), (1.0, 3.0), atol=1e-13)
    np.testing.assert_allclose(elastic.final_state, (1.0, 1.0), atol=1e-13)


def test_a_geared_position_is_stopped_through_its_velocity() -> None:
    geared = system({"x": -2 * v, "v": k}, k=1)
    run = simulate(stopped(geared, lower=-1.0), (0.0, 0.0), 3.0)
    # x = −t²: at the stop at 1, pushed into it from then on.
    assert times(run, EventKind.END_STOP_ENTERED) == [pytest.approx(1.0, abs=1e-14)]
    assert run.final_state.tolist() == [-1.0, 0.0]
