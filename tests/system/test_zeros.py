"""The one Newton iteration: many points at once, singular slopes, more unknowns than equations, true digits."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from ulna.system.zeros import decimal_root, newton

x, y = sp.symbols("x y", real=True)


def test_every_point_goes_its_own_way() -> None:
    """x² = c for several c at once, one of them without a root, one started where the slope is zero."""
    c = np.array([4.0, 9.0, -1.0, 0.0])
    start = np.array([[1.0], [-50.0], [0.0], [1.0]])
    found = newton(lambda p: p**2 - c[:, None], lambda p: 2 * p[..., None], start)
    assert found.points[:2, 0] == pytest.approx([2.0, -3.0], rel=1e-15)
    assert np.isnan(found.points[2, 0])
    assert abs(found.points[3, 0]) < 1e-6
    assert found.errors[3] < 1e-6


def test_points_outside_the_domain_are_not_reached_and_spoil_no_other() -> None:
    found = newton(np.log, lambda p: (1 / p)[..., None], np.array([[-1.0], [0.2]]))
    assert np.isnan(found.points[0, 0])
    assert found.points[1, 0] == pytest.approx(1.0)


@given(st.lists(st.floats(-3, 3), min_size=3, max_size=3), st.lists(st.floats(-2, 2), min_size=2, max_size=2))
def test_steps_with_more_unknowns_than_equations_are_the_shortest(start: list[float], right: list[float]) -> None:
    """Linear equations: one step leads to the solution nearest to the start, which the pseudoinverse gives."""
    A = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, -1.0]])
    found = newton(lambda p: p @ A.T - np.array(right), lambda p: np.broadcast_to(A, (len(p), 2, 3)), np.array([start]))
    nearest = np.array(start) - np.linalg.pinv(A) @ (A @ start - right)
    assert found.points[0] == pytest.approx(nearest, abs=1e-12)


def test_consistent_equations_with_a_singular_slope_are_solved() -> None:
    """A conserved quantity leaves a line of zeros: the nearest one is found."""
    A = np.array([[1.0, 1.0], [2.0, 2.0]])
    slope = np.broadcast_to(A, (1, 2, 2))
    found = newton(lambda p: p @ A.T - [2.0, 4.0], lambda _: slope, np.array([[3.0, 0.0]]))
    assert found.points[0] == pytest.approx([2.5, -0.5])
    contrary = newton(lambda p: p @ A.T - [2.0, 5.0], lambda _: slope, np.array([[3.0, 0.0]]))
    assert np.isnan(contrary.points).all()


@pytest.mark.parametrize("digits", [12, 40])
def test_as_many_digits_as_asked_for_are_true(digits: int) -> None:
    found = decimal_root([sp.cos(x) - x, y - x**2], [x, y], {x: sp.Integer(1), y: sp.Integer(0)}, digits=digits)
    assert found is not None
    point, kept = found
    assert kept == digits
    true = sp.nsolve(sp.cos(x) - x, x, 1, prec=60)
    assert abs(point[x] - true) < sp.Rational(1, 10**digits)
    assert abs(point[y] - true**2) < sp.Rational(1, 10**digits)


def test_a_small_component_beside_a_large_one_keeps_its_digits() -> None:
    found = decimal_root([x - 3000000, y - sp.exp(-x / 10**6) / 10**9], [x, y], {x: sp.Integer(0), y: sp.Integer(0)})
    assert found is not None
    assert float(found[0][y]) == pytest.approx(np.exp(-3.0) * 1e-9, rel=1e-11)


def test_a_double_root_is_not_said_to_have_digits_that_floats_cannot_give() -> None:
    """(eˣ − 2)² loses half the digits in floats; more are found, or fewer are claimed."""
    found = decimal_root([(sp.exp(x) - 2) ** 2], [x], {x: sp.Integer(0)})
    assert found is not None
    point, kept = found
    assert abs(point[x] - sp.log(2).evalf(30)) < sp.Rational(10, 10**kept)


def test_there_is_no_root_where_there_is_none() -> None:
    assert decimal_root([1 + sp.exp(x)], [x], {x: sp.Integer(0)}) is None
    assert decimal_root([x**2 + y**2 + 1], [x, y], {x: sp.Integer(1), y: sp.Integer(1)}) is None
