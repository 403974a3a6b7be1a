"""References: smooth, from rest to rest, within their limits, with true derivatives."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import example, given
from hypothesis import strategies as st

from ulna.base import SimulationError
from ulna.sim.inputs import TIME
from ulna.sim.references import MotionLimits, Reference, minimum_jerk, through_points

LIMITS = MotionLimits(speed=2.0, acceleration=8.0, lower=-1.0, upper=1.5)
ANGLE = st.floats(-1.0, 1.5).map(lambda value: round(value, 6))


def _dense(reference: Reference, derivatives: int = 3) -> np.ndarray:
    return reference.samples(np.linspace(reference.knots[0], reference.knots[-1], 4001), derivatives=derivatives)


@given(start=ANGLE, target=ANGLE)
def test_a_point_to_point_reference_touches_a_limit_and_breaks_none(start: float, target: float) -> None:
    if abs(target - start) < 1e-3:
        return
    angle, speed, acceleration, _ = _dense(minimum_jerk(start, target, limits=LIMITS))
    assert abs(speed).max() <= 2.0 * (1 + 1e-9)
    assert abs(acceleration).max() <= 8.0 * (1 + 1e-9)
    assert max(abs(speed).max() / 2.0, abs(acceleration).max() / 8.0) > 0.9999
    assert angle.min() >= min(start, target) - 1e-9
    assert angle.max() <= max(start, target) + 1e-9


@example(points=[1.0, 0.0, 0.0, 1.0])
@given(points=st.lists(ANGLE, min_size=2, max_size=6))
def test_a_reference_through_points_passes_them_and_keeps_the_limits(points: list[float]) -> None:
    if max(np.abs(np.diff(points))) < 1e-3:
        return
    free = MotionLimits(speed=2.0, acceleration=8.0, jerk=200.0)
    reference = through_points(points, limits=free)
    assert reference.samples(reference.knots, derivatives=0)[0][[0, -1]] == pytest.approx(
        [points[0], points[-1]], abs=1e-9
    )
    _, speed, acceleration, jerk = _dense(reference)
    assert abs(speed).max() <= 2.0 * (1 + 1e-6)
    assert abs(acceleration).max() <= 8.0 * (1 + 1e-6)
    assert abs(jerk).max() <= 200.0 * (1 + 1e-6)


def test_a_reference_through_two_points_is_the_minimum_jerk_one() -> None:
    times = np.linspace(-0.5, 3.0, 101)
    spline = through_points([0.0, 1.0], limits=LIMITS, times=[0.0, 1.5])
    assert spline.samples(times) == pytest.approx(
        minimum_jerk(0.0, 1.0, limits=LIMITS, duration=1.5).samples(times), abs=1e-9
    )


def test_via_points_are_met_at_their_times_with_four_continuous_derivatives() -> None:
    times = [0.0, 1.0, 2.5, 4.0]
    points = [0.0, 0.8, -0.5, 0.3]
    reference = through_points(points, limits=LIMITS, times=times)
    assert reference.samples(times, derivatives=0)[0] == pytest.approx(points, abs=1e-12)
    for knot in reference.knots[1:-1]:
        before, after = (reference.samples([knot + shift], derivatives=4)[:, 0] for shift in (-1e-9, 1e-9))
        assert before == pytest.approx(after, abs=1e-4)


def test_the_spline_has_less_jerk_than_a_perturbed_curve_through_the_same_points() -> None:
    times = [0.0, 1.0, 2.0]
    reference = through_points([0.0, 1.0, 0.2], limits=LIMITS, times=times)
    at = np.linspace(0.0, 2.0, 20001)
    jerk = reference.samples(at)[3]
    # t³ (1 − t)³ (2 − t)³ vanishes with two derivatives at the ends and with its value at the via point.
    bump = np.polynomial.Polynomial.fromroots([0, 0, 0, 1, 2, 2, 2]).deriv(3)(at)
    for size in (-0.1, 0.1):
        assert np.trapezoid((jerk + size * bump) ** 2, at) > np.trapezoid(jerk**2, at)


def test_the_derivatives_are_those_of_the_expression() -> None:
    reference = minimum_jerk(0.1, 1.2, limits=LIMITS, begin=0.25)
    at = np.array([0.0, 0.4, 0.7, 1.0, 5.0])
    for order in range(4):
        expression = reference.expression(derivative=order)
        values = [float(expression.subs(TIME, sp.Rational(str(t)))) for t in at]
        assert reference.samples(at, derivatives=order)[order] == pytest.approx(values, abs=1e-9)


def test_a_reference_rests_before_its_start_and_after_its_end() -> None:
    reference = minimum_jerk(0.1, 1.2, limits=LIMITS, begin=1.0)
    rows = reference.samples([0.0, 0.99, 1.0 + reference.duration, 60.0])
    assert rows[0] == pytest.approx([0.1, 0.1, 1.2, 1.2])
    assert not rows[1:].any()
    assert reference.target == pytest.approx(1.2)


def test_the_inputs_of_a_tracking_law_carry_its_names() -> None:
    inputs = minimum_jerk(0.0, 1.0, limits=LIMITS).inputs("y_ref", np.linspace(0, 2, 21), derivatives=3)
    assert list(inputs) == ["y_ref", "y_ref_d1", "y_ref_d2", "y_ref_d3"]


@pytest.mark.parametrize("target", [1.6, -1.1, math.nan, math.inf])
def test_a_set_point_outside_the_range_of_motion_is_refused(target: float) -> None:
    with pytest.raises(SimulationError, match="set point"):
        minimum_jerk(0.0, target, limits=LIMITS)


def test_a_curve_that_leaves_the_range_between_its_points_is_refused() -> None:
    with pytest.raises(SimulationError, match="between points"):
        through_points([0.0, 1.5, 1.5, 0.0], limits=LIMITS)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [({"duration": 0.1}, "shortest"), ({"duration": -1.0}, "duration"), ({"duration": math.nan}, "duration")],
)
def test_a_duration_that_cannot_be_is_refused(arguments: dict[str, float], text: str) -> None:
    with pytest.raises(SimulationError, match=text):
        minimum_jerk(0.0, 1.0, limits=LIMITS, **arguments)


def test_limits_that_leave_the_duration_open_are_refused() -> None:
    with pytest.raises(SimulationError, match="duration"):
        minimum_jerk(0.0, 1.0, limits=MotionLimits())
    with pytest.raises(SimulationError, match="duration"):
        through_points([0.0, 1.0], limits=MotionLimits())


@pytest.mark.parametrize("times", [[0.0, 1.0], [0.0, 1.0, 1.0], [0.5, 1.0, 2.0], [0.0, 0.05, 0.1]])
def test_times_that_do_not_suit_the_points_are_refused(times: list[float]) -> None:
    with pytest.raises(SimulationError, match="times"):
        through_points([0.0, 1.0, 0.5], limits=LIMITS, times=times)


@pytest.mark.parametrize("wrong", [{"speed": 0.0}, {"jerk": -1.0}, {"lower": 1.0, "upper": 1.0}])
def test_limits_that_allow_nothing_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(SimulationError, match="MotionLimits"):
        MotionLimits(**wrong)
