"""The hyperbolic tangent written out."""

from __future__ import annotations

from ulna.program.arithmetic.arithmetic import AbstractArithmetic
from ulna.program.arithmetic.polynomial import fused, polynomial
from ulna.program.scalar import Scalar

LAMBERT_ABOVE = (1.0, 0.13725490196078433, 0.00392156862745098, 2.8729440494146376e-05, 2.901963686277412e-08)
LAMBERT_BELOW = (1.0, 0.47058823529411764, 0.027450980392156862, 0.00040221216691804925, 1.3058836588248353e-06)
"""Of tanh y = y N(y²)/D(y²), the ninth convergent of Lambert's continued fraction."""


def hyperbolic_tangent(_arithmetic: AbstractArithmetic, value: Scalar) -> Scalar:
    """tanh x within 2e-15: Lambert's continued fraction, cut after nine terms, at x/16, then doubled four times.

    tanh 2y = 2 n d/(d² + n²) for tanh y = n/d, so that one division is left; beyond 20 the answer is ±1.
    """
    above = value.more(20.0).where(20.0, value)
    y = above.less(-20.0).where(-20.0, above) * 0.0625
    w = y * y
    n, d = y * polynomial(w, LAMBERT_ABOVE), polynomial(w, LAMBERT_BELOW)
    for _ in range(4):
        n, d = 2.0 * n * d, fused(n, n, d * d)
    return n / d
