"""Kernels in ball arithmetic: enclosures of the exact values, and of slopes along two directions."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp
from flint import arb, ctx, fmpq
from random_kernels import random_kernel

from ulna.base import UlnaError
from ulna.program import BITS, Fused, Operation, balls_by_name, in_arithmetic, slopes_along, to_balls, to_numpy
from ulna.symbolic.compiling import kernel

x, y = (sp.Symbol(name, real=True) for name in "xy")

FUNCTIONS = [
    x * y - y / x,
    sp.sin(x * y) + sp.cos(x + y) * sp.tan(x),
    sp.exp(x * y) * sp.log(x + y),
    sp.sqrt(x + y**2) + x ** sp.Rational(5, 2),
    sp.sinh(x) * sp.cosh(y) + sp.tanh(x * y),
    sp.atan(x * y) + x**y,
    sp.asin(x / 3) - sp.acos(y / 3),
]


@pytest.mark.parametrize("function", FUNCTIONS, ids=str)
def test_slopes_along_two_directions_are_the_derivatives(function: sp.Expr) -> None:
    at = {x: sp.Rational(3, 4), y: sp.Rational(5, 8)}
    v, w = (sp.Integer(2), sp.Rational(-1, 2)), (sp.Rational(1, 4), sp.Integer(3))
    program = kernel("f", (x, y), {"f": function})
    once = slopes_along(program, {"x": "x/1", "y": "y/1"})
    twice = slopes_along(once, {"x": "x/2", "y": "y/2"})
    point = {s.name: arb(fmpq(int(a.p), int(a.q))) for s, a in at.items()}
    for side, direction in ((1, v), (2, w)):
        point |= {f"{s}/{side}": arb(fmpq(int(a.p), int(a.q))) for s, a in zip("xy", direction, strict=True)}

    def along(e: sp.Expr, direction: tuple[sp.Expr, ...]) -> sp.Expr:
        return e.diff(x) * direction[0] + e.diff(y) * direction[1]

    pairs = ((program, function), (once, along(function, v)), (twice, along(along(function, v), w)))
    for each, exact in pairs:
        ball = balls_by_name(each)(point)["f"]
        assert abs(float(ball.mid()) - float(exact.subs(at).evalf(30))) < 1e-13


def test_a_rounded_constant_is_any_number_that_rounds_to_it() -> None:
    """(1/3) x − x/3 is zero, whatever the double nearest to 1/3 is: the ball holds it."""
    program = kernel("f", (x, y), {"f": x * sp.Rational(1, 3) - y})
    third = arb(1) / 3
    point = {"x": arb(1), "y": third, "x/1": arb(1)}
    assert balls_by_name(program)(point)["f"].contains(0)
    slope = balls_by_name(slopes_along(program, {"x": "x/1"}))(point)["f"]
    with ctx.workprec(BITS):
        assert slope.contains(fmpq(1, 3))
        assert slope.rad() < 1e-50  # as sharp as the working precision
    short = kernel("f", (x,), {"f": x * sp.Rational(3, 8)})
    assert to_balls(short)(arb(1))[0] == arb(0.375)


def test_what_is_not_smooth_has_no_slope() -> None:
    program = kernel("f", (x,), {"f": sp.Abs(x)})
    with pytest.raises(UlnaError, match="no derivative"):
        slopes_along(program, {"x": "x/1"})


def test_balls_of_random_kernels_hold_their_values() -> None:
    """A double computed step by step differs from the exact value by rounding only, or the ball says nothing."""
    random = np.random.default_rng(0)
    told = 0
    for seed in range(150):
        program = random_kernel(seed)
        point = np.round(random.uniform(-4, 4, len(program.inputs)) * 64) / 64
        for ball, value in zip(to_balls(program)(*map(arb, point)), to_numpy(program)(*point), strict=True):
            if not ball.is_finite() or not math.isfinite(value) or float(ball.rad()) > 1e-6 * abs(float(ball.mid())):
                continue
            told += 1
            assert float(ball.mid()) == pytest.approx(value, rel=1e-5, abs=1e-300), program.instructions
    assert told > 200


def test_a_comparison_that_balls_leave_open_has_no_value() -> None:
    less = to_balls(kernel("f", (x, y), {"f": sp.Piecewise((1, x < y), (2, True))}))
    assert less(arb(0), arb(1))[0] == 1
    assert less(arb(1), arb(0))[0] == 2
    assert less(arb(1), arb(1))[0] == 2
    assert less(arb(0, 1), arb(0.5))[0].is_nan()
    both = to_balls(kernel("f", (x, y), {"f": sp.Piecewise((1, (x < 0) & (y < 0)), (2, True))}))
    assert both(arb(0, 1), arb(1))[0] == 2
    assert both(arb(0, 1), arb(-1))[0].is_nan()


def test_what_does_not_exist_is_nan() -> None:
    several = to_balls(kernel("f", (x,), {"r": sp.sqrt(x), "l": sp.log(x), "q": 1 / x, "s": sp.sign(sp.sqrt(x))}))
    assert all(value.is_nan() or not value.is_finite() for value in several(arb(-1, 2)))


def test_what_is_written_out_in_an_arithmetic_is_refused() -> None:
    written = in_arithmetic(kernel("f", (x,), {"f": sp.sin(x)}), Fused())
    assert Operation.FLIP in written.operations
    with pytest.raises(UlnaError, match="in_arithmetic"):
        to_balls(written)
