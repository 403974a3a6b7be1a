"""Slopes along two directions against SymPy's derivatives."""

from __future__ import annotations

import pytest
import sympy as sp
from flint import arb

from ulna.base import UlnaError
from ulna.program import second_slopes
from ulna.symbolic.compiling import kernel

x, y = (sp.Symbol(name, real=True) for name in "xy")

FUNCTIONS = [
    x * y - y / x,
    sp.sin(x * y) + sp.cos(x + y) * sp.tan(x),
    sp.exp(x * y) * sp.log(x + y),
    sp.sqrt(x + y**2) + x ** sp.Rational(5, 2),
    sp.sinh(x) * sp.cosh(y) + sp.tanh(x * y),
    sp.atan(x * y) + x**y,
]


@pytest.mark.parametrize("function", FUNCTIONS, ids=str)
def test_slopes_are_the_derivatives(function):
    at = {x: sp.Rational(3, 4), y: sp.Rational(5, 8)}
    v, w = (sp.Integer(2), sp.Rational(-1, 2)), (sp.Rational(1, 4), sp.Integer(3))
    program = kernel("f", (x, y), {"f": function})
    jet = second_slopes(
        program,
        {s.name: arb(int(a.p)) / int(a.q) for s, a in at.items()},
        {s.name: arb(float(a)) for s, a in zip((x, y), v, strict=True)},
        {s.name: arb(float(a)) for s, a in zip((x, y), w, strict=True)},
    )["f"]

    def along(e: sp.Expr, direction: tuple[sp.Expr, ...]) -> sp.Expr:
        return e.diff(x) * direction[0] + e.diff(y) * direction[1]

    expected = (function, along(function, v), along(function, w), along(along(function, v), w))
    for ball, exact in zip(jet, expected, strict=True):
        assert abs(float(ball.mid()) - float(exact.subs(at).evalf(30))) < 1e-13


def test_a_rounded_constant_is_any_number_that_rounds_to_it():
    """(1/3) x − x/3 is zero, whatever the double nearest to 1/3 is: the ball holds it."""
    program = kernel("f", (x, y), {"f": x * sp.Rational(1, 3) - y})
    third = arb(1) / 3
    jet = second_slopes(program, {"x": arb(1), "y": third}, {"x": arb(1)})["f"]
    assert jet[0].contains(0)
    assert jet[1].contains(third)


def test_what_is_not_smooth_is_refused():
    program = kernel("f", (x,), {"f": sp.Abs(x)})
    with pytest.raises(UlnaError, match="no second derivative"):
        second_slopes(program, {"x": arb(1)}, {"x": arb(1)})
