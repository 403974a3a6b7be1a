"""Metrics against the closed forms of a second-order step, and cases where they do not apply."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from ulna.base import SimulationError
from ulna.sim import TIME, metrics, simulate
from ulna.sim.metrics import input_metrics, output_metrics
from ulna.system import Signal, System

x, v, u = sp.symbols("x v u", real=True)
SECOND_ORDER = System(
    name="second order",
    states=(Signal(name="x"), Signal(name="v")),
    rates=(v, 4 * (u - x) - 2 * v),  # ω = 2 rad/s, ζ = 1/2
    inputs=(Signal(name="u"),),
    outputs=(Signal(name="x"), Signal(name="effort")),
    readouts=(x, u - x),
)
TIMES = np.linspace(0.0, 10.0, 20_001)


def test_second_order_step_has_its_textbook_figures() -> None:
    run = simulate(SECOND_ORDER, (0, 0), TIMES, inputs={"u": 1})
    figures = metrics(run, targets={"x": 1.0}).outputs["x"]
    damped = math.sqrt(3.0)
    assert figures.overshoot == pytest.approx(math.exp(-math.pi / math.sqrt(3)), rel=1e-6)

    def remaining(t: float) -> float:
        return math.exp(-t) * math.sin(damped * t + math.acos(0.5)) / math.sqrt(0.75)

    assert abs(remaining(figures.settling_time)) == pytest.approx(0.02, rel=1e-5)
    assert all(abs(remaining(t)) <= 0.02 for t in np.linspace(figures.settling_time + 1e-4, 10, 500))
    begun, done = (brentq(lambda t, goal=goal: 1 - remaining(t) - goal, 0, 1.2) for goal in (0.1, 0.9))
    assert figures.rise_time == pytest.approx(done - begun, rel=1e-6)
    assert figures.steady_error == pytest.approx(0.0, abs=1e-4)
    assert figures.peak_error == 1.0


def test_effort_of_a_sine_is_known() -> None:
    run = simulate(SECOND_ORDER, (0, 0), np.linspace(0, 4 * math.pi, 4001), inputs={"u": 3 * sp.sin(TIME)})
    effort = metrics(run).inputs["u"]
    assert effort.peak == pytest.approx(3.0, rel=1e-5)
    assert effort.rms == pytest.approx(3 / math.sqrt(2), rel=1e-6)


def test_an_output_can_be_reported_as_effort() -> None:
    run = simulate(SECOND_ORDER, (0, 0), TIMES, inputs={"u": 1})
    figures = metrics(run, effort=("effort",))
    assert set(figures.outputs) == {"x"}
    assert set(figures.inputs) == {"u", "effort"}
    assert figures.inputs["effort"].peak == 1.0


def test_what_never_arrives_takes_forever() -> None:
    times = np.linspace(0, 1, 11)
    figures = output_metrics(times, 1 - times / 10, 0.0)
    assert (figures.rise_time, figures.settling_time, figures.overshoot) == (math.inf, math.inf, 0.0)
    assert figures.steady_error == pytest.approx(0.9)


def test_starting_on_the_target_has_no_rise() -> None:
    figures = output_metrics(np.array([0.0, 1.0]), np.array([0.0, 0.0]), 0.0)
    assert math.isnan(figures.rise_time)
    assert figures.peak_error == 0.0


def test_an_exponential_settles_after_ln_fifty_time_constants() -> None:
    figures = output_metrics(TIMES, np.exp(-TIMES), 0.0)
    assert figures.settling_time == pytest.approx(math.log(50), rel=1e-6)
    assert figures.rise_time == pytest.approx(math.log(9), rel=1e-6)


@given(scale=st.floats(0.01, 100), shift=st.floats(-50, 50), start=st.floats(-20, 20))
def test_times_and_overshoot_do_not_depend_on_scale_offset_and_start(scale: float, shift: float, start: float) -> None:
    times = TIMES[::40]
    values = np.exp(-times) * np.cos(3 * times)
    plain, moved = output_metrics(times, values, 0.0), output_metrics(times + start, scale * values + shift, shift)
    for name in ("rise_time", "settling_time", "overshoot"):
        assert getattr(moved, name) == pytest.approx(getattr(plain, name), rel=1e-6)


def test_effort_of_a_constant_is_itself() -> None:
    figures = input_metrics(np.array([0.0, 1.0, 4.0]), np.array([-2.0, -2.0, -2.0]))
    assert (figures.peak, figures.rms) == (2.0, 2.0)


def test_unknown_names_are_refused() -> None:
    run = simulate(SECOND_ORDER, (0, 0), 1.0)
    with pytest.raises(SimulationError, match="which are not outputs"):
        metrics(run, targets={"v": 1.0})
    with pytest.raises(SimulationError, match="no such signal"):
        metrics(run, effort=("w",))
