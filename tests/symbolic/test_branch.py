"""Formulas near a point, without moduli and inverses of functions."""

from __future__ import annotations

import pytest
import sympy as sp

from ulna.symbolic.solving import on_branch
from ulna.symbolic.solving.branch import real_odd_roots

x, y = sp.symbols("x y", real=True)
a, b = sp.symbols("a b")

CASES = [
    (sp.Abs(x), {x: -1}, -x),
    (sp.sign(x) * y, {x: -2, y: 3}, -y),
    (sp.sqrt((sp.sqrt(a) + b) ** 2), {a: 1, b: 1}, sp.sqrt(a) + b),
    (sp.sqrt((sp.sqrt(a) + b) ** 2), {a: 1, b: -3}, -sp.sqrt(a) - b),
    (sp.sqrt(x**2 * y), {x: -2, y: 3}, -x * sp.sqrt(y)),
    (sp.asin(sp.sin(x)), {x: 0}, x),
    (sp.asin(sp.sin(x)), {x: 3}, sp.pi - x),
    (sp.asin(sp.sin(x)), {x: -3}, -sp.pi - x),
    (sp.acos(sp.cos(x)), {x: -1}, -x),
    (sp.acos(sp.cos(x)), {x: 4}, 2 * sp.pi - x),
    (sp.atan(sp.tan(x)), {x: 4}, x - sp.pi),
    (sp.asin(sp.cos(x)), {x: 1}, sp.pi / 2 - x),
    (sp.acos(sp.sin(x)), {x: -1}, sp.pi / 2 - x),
]


@pytest.mark.parametrize(("expression", "base", "expected"), CASES)
def test_inverses_of_functions_come_off_on_the_side_of_the_point(expression, base, expected):
    found = on_branch(expression, {s: sp.Integer(v) for s, v in base.items()})
    assert sp.expand(found - expected) == 0
    assert sp.N(found.subs(base)) == pytest.approx(sp.N(expression.subs(base)))


@pytest.mark.parametrize("expression", [sp.Abs(x), sp.sign(x), sp.acos(sp.cos(x)), sp.asin(sp.sin(x + sp.pi / 2))])
def test_nothing_is_taken_off_at_the_end_of_a_branch(expression):
    assert on_branch(expression, {x: sp.Integer(0)}) == expression


def test_a_square_root_of_a_square_stays_where_its_sign_is_unknown():
    expression = sp.sqrt((sp.sqrt(a) + b) ** 2)
    assert on_branch(expression, {a: sp.Integer(1), b: sp.Integer(-1)}) == expression


def test_odd_roots_are_real_on_both_sides():
    found = real_odd_roots((x - 1) ** sp.Rational(1, 3) + (x - 1) ** sp.Rational(2, 3) + sp.sqrt(y))
    assert found.subs({x: -7, y: 4}) == -2 + 4 + 2
    assert found.subs({x: 9, y: 4}) == 2 + 4 + 2
