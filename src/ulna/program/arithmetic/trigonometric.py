"""Sine and cosine written out."""

from __future__ import annotations

from ulna.program.arithmetic.arithmetic import AbstractArithmetic
from ulna.program.arithmetic.polynomial import fused
from ulna.program.arithmetic.rounding import ROUNDING
from ulna.program.instructions import Operation
from ulna.program.scalar import Scalar

INVERSE_PI, PI_HIGH, PI_LOW = 0.3183098861837907, 3.141592653589793, 1.2246467991473532e-16


def fused_sine(_: AbstractArithmetic, angle: Scalar) -> Scalar:
    """sin x = ± sin(x − n π) for even and odd n."""
    turns = fused(angle, INVERSE_PI, ROUNDING)
    n = turns - ROUNDING
    r = fused(n, -PI_LOW, fused(n, -PI_HIGH, angle))
    return _fused_sine_near_zero(r).apply(Operation.FLIP, turns)


def fused_cosine(_: AbstractArithmetic, angle: Scalar) -> Scalar:
    """cos x = ± sin((j + 1/2) π − x) for even and odd j."""
    turns = fused(angle, INVERSE_PI, -0.5) + ROUNDING
    n = (turns - ROUNDING) + 0.5
    r = fused(n, PI_LOW, fused(n, PI_HIGH, -angle))
    return _fused_sine_near_zero(r).apply(Operation.FLIP, turns)


def _fused_sine_near_zero(r: Scalar) -> Scalar:
    """sin r for |r| ≤ π/2, for |x| < 1e3 rad within 2 units in the last place down to 1e-13, within 1e-29 below.

    Farther out the distance to the next zero is known to |x| 1e-33. π is the sum of two doubles; the fused
    difference of the angle and n times the first one is exact. The polynomial interpolates (sin r − r)/r³ in r² at
    Chebyshev's points; its two halves are computed side by side.
    Reference: W. J. Cody, W. Waite, "Software Manual for the Elementary Functions", 1980, chapter 8.
    """
    w = r * r
    q = w * w
    odd = fused(q, fused(q, q.like(2.7216780035058983e-15), 1.605894190347732e-10), 2.7557319211744394e-06)
    odd = fused(q, odd, 0.008333333333333208)
    even = fused(q, fused(q, -7.64304346538988e-13, -2.5052106921615934e-08), -0.00019841269841213368)
    # The largest coefficient comes last, so that its rounding is the only one that counts.
    value = fused(w, fused(w, even, odd), -0.16666666666666666)
    return fused(r * w, value, r)
