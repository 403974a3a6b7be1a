"""Inverse trigonometric functions written out."""

from __future__ import annotations

import math

from ulna.program.arithmetic.arithmetic import AbstractArithmetic
from ulna.program.arithmetic.exact import PI, parts
from ulna.program.instructions import Operation
from ulna.program.precision import Precision
from ulna.program.scalar import Scalar

_REST = {
    Precision.DOUBLE: (
        *(-0.3333333333333333, 0.1999999999999548, -0.14285714284657894, 0.11111111014561013, -0.09090904549884611),
        *(0.07692182535116648, -0.06664502215671447, 0.058580687568615106, -0.05085030492810941, 0.03921955253255129),
        -0.019162068915902573,
    ),
    Precision.SINGLE: (
        *(-0.3333333175381697, 0.1999953879477192, -0.14263897112598675, 0.1074309966767457, -0.06449835224591496),
    ),
}
"""Of (atan t − t)/t³ in t² for |t| ≤ tan(π/8), at Chebyshev's points."""
_EIGHTH, _THREE_EIGHTHS = math.sqrt(2.0) - 1.0, math.sqrt(2.0) + 1.0


def arc_tangent(arithmetic: AbstractArithmetic, value: Scalar) -> Scalar:
    """atan x."""
    return odd(value, _arc_tangent_of_size(arithmetic, abs(value)))


def arc_sine(arithmetic: AbstractArithmetic, value: Scalar) -> Scalar:
    """asin x = atan(x/√((1 − x)(1 + x)))."""
    a = abs(value)
    return odd(value, _arc_tangent_of_size(arithmetic, a / ((1.0 - a) * (1.0 + a)).apply(Operation.SQRT)))


def arc_cosine(arithmetic: AbstractArithmetic, value: Scalar) -> Scalar:
    """acos x = 2 atan √((1 − x)/(1 + x))."""
    return 2.0 * _arc_tangent_of_size(arithmetic, ((1.0 - value) / (1.0 + value)).apply(Operation.SQRT))


def arc_tangent_of_two(arithmetic: AbstractArithmetic, y: Scalar, x: Scalar) -> Scalar:
    """The angle of the point (x, y), edges as in C99."""
    above, below = abs(y), abs(x)
    alike = above.apply(Operation.EQUAL, below)
    ratio = alike.where(above.apply(Operation.EQUAL, 0.0).where(0.0, 1.0), above / below)
    angle = _arc_tangent_of_size(arithmetic, ratio)
    high, low = parts(PI, arithmetic.precision.bits, arithmetic.precision.bits)
    angle = _negative(x).where(high - (angle - low), angle)
    return _negative(y).where(-angle, angle)


def odd(value: Scalar, result: Scalar) -> Scalar:
    """The result with the sign of the value; 0 and −0 for themselves."""
    return value.less(0.0).where(-result, value.apply(Operation.EQUAL, 0.0).where(value, result))


def _arc_tangent_of_size(arithmetic: AbstractArithmetic, a: Scalar) -> Scalar:
    """atan a for a ≥ 0: near 0, near π/4 or near π/2 by the tangent of the difference."""
    steep, middling = a.more(_THREE_EIGHTHS), a.more(_EIGHTH)
    above = steep.where(-1.0, middling.where(a - 1.0, a))
    below = steep.where(a, middling.where(a + 1.0, 1.0))
    t = above / below
    w = t * t
    near = arithmetic.plus_product(t * w, arithmetic.polynomial(w, _REST[arithmetic.precision]), t)
    high, low = parts(PI, arithmetic.precision.bits, arithmetic.precision.bits)
    base = steep.where(0.5 * high, middling.where(0.25 * high, 0.0))
    rest = steep.where(0.5 * low, middling.where(0.25 * low, 0.0))
    return base + (near + rest)


def _negative(value: Scalar) -> Scalar:
    """Whether the sign is minus, that of a zero too."""
    return value.apply(Operation.EQUAL, 0.0).where(1.0 / value, value).less(0.0)
