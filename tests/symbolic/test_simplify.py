"""Tidy forms are shorter, have the same value, and arrive in time."""

from __future__ import annotations

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from ulna.symbolic.exact import attempt, is_zero, shortened, tidy, zero_set
from ulna.symbolic.exact.quotients import normal_form

x, y, k, m = sp.symbols("x y k m", real=True)
sin, cos = sp.sin, sp.cos


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ((x**2 - y**2) / (x - y), x + y),
        (sin(x) ** 2 + cos(x) ** 2, sp.S.One),
        ((1 - cos(x) ** 2) / sin(x), sin(x)),
        (cos(x) * cos(y) - sin(x) * sin(y), cos(x + y)),
        (sp.exp(x) * (sp.exp(-x) + 1), sp.exp(x) + 1),
        (x - (1 - cos(x)) / sin(x) + sp.tan(x / 2), x),
        (1 / (1 / x + 1 / y), x * y / (x + y)),
        (sp.log(x * y) - sp.log(x) - sp.log(y), sp.S.Zero),
    ],
    ids=str,
)
def test_known_short_forms_are_found(expression: sp.Expr, expected: sp.Expr) -> None:
    assert tidy(expression, seconds=3) == expected


def test_what_is_short_already_stays() -> None:
    for expression in (x, sp.Integer(3), x - sp.Rational(49, 5) * sin(x), sp.asin(x / k)):
        assert tidy(expression) == expression


def test_no_time_returns_the_input() -> None:
    expression = (x**2 - y**2) / (x - y)
    assert tidy(expression, seconds=0) is expression


def test_a_large_expression_comes_back_in_time() -> None:
    symbols = sp.symbols("s0:12", real=True)
    large = sp.Add(*[sin(p * q + x) ** 3 / (1 + cos(p) * q) for p in symbols for q in symbols])
    assert attempt(5, "a tidy form", tidy, large, seconds=0.3).succeeded


def test_a_root_of_a_square_keeps_its_modulus() -> None:
    root = sp.sqrt(x**2 + 2 * x * y + y**2)
    assert is_zero(tidy(root) - root).holds
    assert tidy(root) != x + y


def test_the_normal_form_of_equal_expressions_is_equal() -> None:
    assert normal_form(sin(x + y)) == normal_form(sin(x) * cos(y) + cos(x) * sin(y))


atoms = st.sampled_from([x, y, k, sp.Integer(2), sin(x), cos(x), sp.exp(y), 1 / (1 + x**2)])
sums = st.lists(st.tuples(atoms, atoms, atoms), min_size=1, max_size=4).map(
    lambda terms: sp.Add(*[p * q / (2 + r**2) for p, q, r in terms])
)


@settings(max_examples=25, deadline=None)
@given(sums)
def test_tidying_never_changes_the_value_nor_lengthens(expression: sp.Expr) -> None:
    for short in (tidy(expression, seconds=0.2), shortened(expression)):
        assert is_zero(short - expression).holds
        assert sp.count_ops(short) <= sp.count_ops(expression)


def test_only_the_angle_between_two_links_remains_where_nothing_else_matters() -> None:
    a, b, d = sp.symbols("a b d", real=True)
    expanded = sp.expand(sp.expand_trig(sp.cos(a - b) ** 3)) / (d * sp.expand(sp.expand_trig(sp.cos(a - b) ** 2)))
    assert tidy(expanded, seconds=5) == sp.cos(a - b) / d


def test_two_angles_that_both_matter_are_kept() -> None:
    a, b = sp.symbols("a b", real=True)
    one = sp.cos(a) * sp.sin(b) + 2 * sp.sin(a) * sp.cos(b) + sp.cos(a) ** 2
    assert tidy(one, seconds=5).free_symbols == {a, b}
    assert (tidy(one, seconds=5) - one).equals(0)


def test_a_zero_set_is_told_by_what_moves_alone():
    a = sp.Symbol("a", real=True)
    assert zero_set(3 * a * sp.sqrt(-a * (x - a), evaluate=False), [x]) in (x - a, a - x)
    assert zero_set(a**2 * sp.exp(x), [x]) == 1
