"""Sine, cosine and tangent written out.

An angle is brought to [-π/2, π/2] by whole multiples of π (W. J. Cody, W. Waite, "Software Manual for the Elementary
Functions", 1980, chapter 8). π is a sum of parts. Where products are fused two full parts do: the difference of the
angle and n times the first one is exact. In plain arithmetic all parts but the last are so short that n times them is.
The polynomials interpolate (sin r − r)/r³ in r² at Chebyshev's points.
"""

from __future__ import annotations

import math

from ulna.program.arithmetic.arithmetic import AbstractArithmetic
from ulna.program.arithmetic.exact import PI, parts
from ulna.program.arithmetic.rounding import rounding
from ulna.program.instructions import Operation
from ulna.program.precision import Precision
from ulna.program.scalar import Scalar

_SINE = {
    Precision.DOUBLE: (
        *(-0.16666666666666666, 0.008333333333333208, -0.00019841269841213368, 2.7557319211744394e-06),
        *(-2.5052106921615934e-08, 1.605894190347732e-10, -7.64304346538988e-13, 2.7216780035058983e-15),
    ),
    # A few units off the interpolation, so that cos 0 is 1.
    Precision.SINGLE: (
        *(-0.1666666716337204, 0.008333335630595684, -0.000198410838493146, 2.753562739599147e-06),
        -2.4061034054057018e-08,
    ),
}
_PARTS = {
    (True, Precision.DOUBLE): parts(PI, 53, 53),
    (True, Precision.SINGLE): parts(PI, 24, 24, 24),
    (False, Precision.DOUBLE): parts(PI, 32, 32, 53),
    (False, Precision.SINGLE): parts(PI, 12, 12, 12, 24),
}
_INVERSE_PI = 0.3183098861837907


def sine(arithmetic: AbstractArithmetic, angle: Scalar) -> Scalar:
    """sin x = ± sin(x − n π) for even and odd n."""
    shift = rounding(arithmetic.precision)
    turns = arithmetic.plus_product(angle, _INVERSE_PI, shift)
    n = turns - shift
    r = angle
    for part in _PARTS[arithmetic.fuses, arithmetic.precision]:
        r = arithmetic.plus_product(n, -part, r)
    return _signed(arithmetic, _sine_near_zero(arithmetic, r), turns, angle)


def cosine(arithmetic: AbstractArithmetic, angle: Scalar) -> Scalar:
    """cos x = ± sin((j + 1/2) π − x) for even and odd j."""
    shift = rounding(arithmetic.precision)
    turns = arithmetic.plus_product(angle, _INVERSE_PI, -0.5) + shift
    n = (turns - shift) + 0.5
    r = -angle
    for part in _PARTS[arithmetic.fuses, arithmetic.precision]:
        r = arithmetic.plus_product(n, part, r)
    return _signed(arithmetic, _sine_near_zero(arithmetic, r), turns, angle)


def tangent(arithmetic: AbstractArithmetic, angle: Scalar) -> Scalar:
    """sin x / cos x."""
    return sine(arithmetic, angle) / cosine(arithmetic, angle)


def _signed(arithmetic: AbstractArithmetic, value: Scalar, turns: Scalar, angle: Scalar) -> Scalar:
    """The value, its sign changed where the whole number in `turns` is odd."""
    if arithmetic.fuses:
        return value.apply(Operation.FLIP, turns)
    shift = rounding(arithmetic.precision)
    half = 0.5 * (turns - shift)
    signed = half.apply(Operation.EQUAL, (half + shift) - shift).where(value, -value)
    # Farther out the sum with `shift` no longer rounds to whole numbers.
    return abs(angle).less(2.0 ** (arithmetic.precision.bits - 2)).where(signed, math.nan)


def _sine_near_zero(arithmetic: AbstractArithmetic, r: Scalar) -> Scalar:
    """sin r for |r| ≤ π/2; every second coefficient stands in a polynomial of its own, computed beside the other."""
    first, *rest = _SINE[arithmetic.precision]
    w = r * r
    q = w * w
    odd = arithmetic.polynomial(q, rest[0::2])
    even = arithmetic.polynomial(q, rest[1::2])
    # The largest coefficient comes last, so that its rounding is the only one that counts.
    value = arithmetic.plus_product(w, arithmetic.plus_product(w, even, odd), first)
    return arithmetic.plus_product(r * w, value, r)
