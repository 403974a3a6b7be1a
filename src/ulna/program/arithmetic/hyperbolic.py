"""Hyperbolic functions and their inverses written out."""

from __future__ import annotations

from dataclasses import dataclass

from ulna.program.arithmetic.arithmetic import AbstractArithmetic
from ulna.program.arithmetic.exact import LOG_2
from ulna.program.arithmetic.exponential import exponential
from ulna.program.arithmetic.inverse_trigonometric import odd
from ulna.program.arithmetic.logarithm import logarithm, logarithm_of_one_plus
from ulna.program.instructions import Operation
from ulna.program.precision import Precision
from ulna.program.scalar import Scalar


@dataclass(frozen=True, slots=True, kw_only=True)
class _Lambert:
    """tanh y = y N(y²)/D(y²), a convergent of Lambert's continued fraction, at y = x / 2^halvings for |x| < limit."""

    above: tuple[float, ...]
    below: tuple[float, ...]
    halvings: int
    limit: float


_LAMBERT = {
    Precision.DOUBLE: _Lambert(
        above=(1.0, 0.13725490196078433, 0.00392156862745098, 2.8729440494146376e-05, 2.901963686277412e-08),
        below=(1.0, 0.47058823529411764, 0.027450980392156862, 0.00040221216691804925, 1.3058836588248353e-06),
        halvings=4,
        limit=20.0,
    ),
    Precision.SINGLE: _Lambert(
        above=(1.0, 0.1111111111111111, 0.0010582010582010583),
        below=(1.0, 0.4444444444444444, 0.015873015873015872),
        halvings=2,
        limit=10.0,
    ),
}
_SINH = {
    Precision.DOUBLE: (
        *(0.16666666666666666, 0.008333333333333299, 0.00019841269841324198, 2.7557319191381816e-06),
        *(2.5052117695907823e-08, 1.6057679623801638e-10, 7.746178593018827e-13),
    ),
    Precision.SINGLE: (0.16666666646842135, 0.00833333967591706, 0.00019838101968683888, 2.8062802582276946e-06),
}
"""Of (sinh x − x)/x³ in x² on [0, 1], at Chebyshev's points."""


def hyperbolic_tangent(arithmetic: AbstractArithmetic, value: Scalar) -> Scalar:
    """tanh x by Lambert's continued fraction at x/16 (single: x/4), then doubled; beyond the limit the answer is ±1.

    tanh 2y = 2 n d/(d² + n²) for tanh y = n/d, so that one division is left.
    """
    of = _LAMBERT[arithmetic.precision]
    y = value * 0.5**of.halvings
    w = y * y
    n, d = y * arithmetic.polynomial(w, of.above), arithmetic.polynomial(w, of.below)
    for _ in range(of.halvings):
        n, d = 2.0 * n * d, arithmetic.plus_product(n, n, d * d)
    ratio = n / d
    if not arithmetic.fuses:
        ratio = ratio.apply(Operation.MIN, 1.0).apply(Operation.MAX, -1.0)
    return value.more(of.limit).where(1.0, value.less(-of.limit).where(-1.0, ratio))


def hyperbolic_sine(arithmetic: AbstractArithmetic, value: Scalar) -> Scalar:
    """sinh x, a polynomial up to 1, e^x/2 − e^−x/2 beyond."""
    half = exponential(arithmetic, abs(value), halved=True)
    large = half - 0.25 / half
    w = value * value
    small = arithmetic.plus_product(value * w, arithmetic.polynomial(w, _SINH[arithmetic.precision]), value)
    return abs(value).less(1.0).where(small, value.less(0.0).where(-large, large))


def hyperbolic_cosine(arithmetic: AbstractArithmetic, value: Scalar) -> Scalar:
    """cosh x = e^x/2 + e^−x/2."""
    half = exponential(arithmetic, abs(value), halved=True)
    return half + 0.25 / half


def inverse_hyperbolic_sine(arithmetic: AbstractArithmetic, value: Scalar) -> Scalar:
    """asinh x = ± log(1 + |x| + x²/(1 + √(x² + 1))); ± log 2|x| where the square would overflow."""
    a = abs(value)
    square = a * a
    near = logarithm_of_one_plus(arithmetic, a + square / (1.0 + (square + 1.0).apply(Operation.SQRT)))
    result = a.less(_large(arithmetic)).where(near, logarithm(arithmetic, a) + float(LOG_2))
    return odd(value, result)


def inverse_hyperbolic_cosine(arithmetic: AbstractArithmetic, value: Scalar) -> Scalar:
    """acosh x = log(1 + t + √(t (t + 2))) for t = x − 1; log 2x where the square would overflow."""
    t = value - 1.0
    near = logarithm_of_one_plus(arithmetic, t + (t * (t + 2.0)).apply(Operation.SQRT))
    return value.less(_large(arithmetic)).where(near, logarithm(arithmetic, value) + float(LOG_2))


def inverse_hyperbolic_tangent(arithmetic: AbstractArithmetic, value: Scalar) -> Scalar:
    """atanh x = ± log(1 + 2 |x|/(1 − |x|))/2."""
    a = abs(value)
    result = 0.5 * logarithm_of_one_plus(arithmetic, (a + a) / (1.0 - a))
    return odd(value, result)


def _large(arithmetic: AbstractArithmetic) -> float:
    """From here on √(x² ± 1) is x."""
    return 2.0 ** (arithmetic.precision.bits // 2 + 2)
