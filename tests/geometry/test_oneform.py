"""Exterior calculus of one-forms."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy import Expr, Matrix, cos, exp, sin, symbols

from ulna.base import UlnaError
from ulna.geometry import closed, exterior_derivative, frobenius, lie_derivative_of_covector, one_form
from ulna.geometry.oneform import contraction, differential, frobenius_codistribution, scaled, wedge
from ulna.symbolic.exact import is_zero

X = x1, x2, x3 = symbols("x1:4", real=True)
PIECES = (x1, x2, x3, x1 * x2, x2 * x3**2, sin(x1), cos(x2 * x3), exp(x3 - x1))
functions = st.lists(st.tuples(st.integers(-2, 2), st.sampled_from(PIECES)), min_size=1, max_size=3).map(
    lambda terms: sum(c * p for c, p in terms) + 0 * x1
)
forms = st.lists(functions, min_size=3, max_size=3)


def vanishes(array: Matrix) -> bool:
    return all(is_zero(entry).holds for entry in array)


@settings(max_examples=15, deadline=None)
@given(h=functions)
def test_the_derivative_of_a_differential_vanishes(h: Expr) -> None:
    assert vanishes(exterior_derivative(differential(h, X)))
    assert closed(differential(h, X)).holds


@settings(max_examples=10, deadline=None)
@given(v=forms, w=forms)
def test_wedge_is_antisymmetric(v: list[Expr], w: list[Expr]) -> None:
    a, b = one_form(v, X), one_form(w, X)
    assert vanishes(wedge(a, b) + wedge(b, a))
    assert vanishes(wedge(a, a))


@settings(max_examples=10, deadline=None)
@given(v=forms, m=functions)
def test_exterior_derivative_satisfies_leibniz(v: list[Expr], m: Expr) -> None:
    a = one_form(v, X)
    # d(m a) = dm ∧ a + m da
    right = wedge(differential(m, X), a) + m * exterior_derivative(a)
    assert vanishes(exterior_derivative(scaled(m, a)) - right)


@settings(max_examples=10, deadline=None)
@given(v=forms, w=forms)
def test_lie_derivative_is_cartans_formula(v: list[Expr], w: list[Expr]) -> None:
    a = one_form(v, X)
    field = Matrix(w)
    cartan = differential(contraction(a, field), X).row + (exterior_derivative(a).T * field).T
    assert vanishes(lie_derivative_of_covector(a.row, field, X) - cartan)


def test_a_multiple_of_a_differential_is_integrable_but_not_closed() -> None:
    form = one_form([4 * x1 * x2, 4 * x2**2, 0], X)  # Röbenack 2017, Formen_Integrierbarkeit
    assert closed(form).fails
    assert closed(form).evidence["component"] == ("x1", "x2")
    assert frobenius(form).holds


def test_the_contact_form_is_not_integrable() -> None:
    verdict = frobenius(one_form([x2, 0, 1], X))
    assert verdict.fails
    assert "point" in verdict.evidence


def test_two_forms_in_space_with_one_leaf_direction_are_integrable() -> None:
    contact = one_form([x2, 0, 1], X)
    assert frobenius_codistribution([contact, one_form([0, 1, 0], X)]).holds


def test_a_codistribution_that_is_not_integrable_is_refused() -> None:
    y = y1, y2, y3, y4 = symbols("y1:5", real=True)
    verdict = frobenius_codistribution([one_form([y2, 0, 1, 0], y), one_form([0, 0, 0, 1], y)])
    assert verdict.fails
    assert verdict.evidence["form"] == 0
    assert y1 in y
    assert y3 in y
    assert y4 in y


def test_components_must_fit_the_coordinates() -> None:
    with pytest.raises(UlnaError, match="shape"):
        one_form([1, 2], X)
    with pytest.raises(UlnaError, match="different coordinates"):
        wedge(one_form([1, 2], X[:2]), one_form([1, 2, 3], X))
