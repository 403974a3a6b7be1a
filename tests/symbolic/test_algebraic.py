"""Inverses through quadratics and Lambert's function; branches that depend on the parameters' values."""

from __future__ import annotations

import pytest
import sympy as sp

from ulna.symbolic.solving import invert_map
from ulna.symbolic.solving.algebraic import algebraic

x, y, w = (sp.Symbol(name, real=True) for name in "xyw")
a, b, J1, I2, m0 = (sp.Symbol(name, real=True) for name in ("a", "b", "J1", "I2", "m0"))
x1, x2, x3, z1, z2, z3 = (sp.Symbol(name, real=True) for name in ("x1", "x2", "x3", "z1", "z2", "z3"))


@pytest.mark.parametrize(
    ("left", "at"),
    [
        (x**2 + 3 * x, 1),
        (x**2 + 3 * x, -2),
        (x**4 - 5 * x**2, 2),
        (x**4 - 5 * x**2, -1),
        (x / (1 + x / 3), 1),
        (sp.exp(x / (1 + x**2)), 3),
        (x * sp.exp(x**2), sp.Rational(1, 2)),
        (x * sp.exp(x**2), 0),
        (2 * x * sp.exp(-x), sp.Rational(1, 2)),
    ],
    ids=str,
)
def test_the_branch_goes_through_the_base_point(left, at):
    found = algebraic(left - w, x, {x: sp.sympify(at), w: left.subs(x, at)})
    assert found is not None
    for step in (0, sp.Rational(1, 100), -sp.Rational(1, 100)):
        value = sp.sympify(at) + step
        assert abs(sp.N(found.expression.subs(w, left.subs(x, value)) - value, 20)) < 1e-15


def test_an_equation_with_equal_roots_at_the_base_point_is_refused():
    assert algebraic(x**2 - w, x, {x: sp.Integer(0), w: sp.Integer(0)}) is None


def test_beyond_the_turning_point_of_lamberts_function_is_refused():
    assert algebraic(x * sp.exp(-x) - w, x, {x: sp.Integer(2), w: 2 * sp.exp(-2)}) is None


def test_a_cubic_is_refused():
    assert algebraic(x**3 + x - w, x, {x: sp.Integer(1), w: sp.Integer(2)}) is None


def test_the_branch_may_hang_on_the_values_of_parameters():
    """A x² + b y² and x − y²: the root's sign is that of the parameters, which are said to stand at their values."""
    near = {x: sp.Integer(4), y: sp.Integer(2), a: sp.Rational(1, 100), b: sp.Rational(1, 1000)}
    found = invert_map((a * x**2 + b * y**2, a * x - b * y**2), (x, y), (z1, z2), near=near)
    assert found.expressions is not None
    assert found.verdict.holds
    image = {z1: (a * x**2 + b * y**2).subs(near), z2: (a * x - b * y**2).subs(near), a: near[a], b: near[b]}
    assert [sp.simplify(e.subs(image)) for e in found.expressions] == [4, 2]


def test_a_triangular_map_through_a_sine_is_inverted():
    forward = (J1 * x2 + I2 * x3, m0 * sp.sin(x1), m0 * x2 * sp.cos(x1))
    near = dict.fromkeys((x1, x2, x3), sp.Integer(0))
    found = invert_map(forward, (x1, x2, x3), (z1, z2, z3), near=near)
    assert found.expressions is not None
    assert found.expressions[0] == sp.asin(z2 / m0)
