"""The exponential function written out."""

from __future__ import annotations

from ulna.program.arithmetic.arithmetic import AbstractArithmetic
from ulna.program.arithmetic.exact import LOG_2, parts
from ulna.program.arithmetic.rounding import rounding
from ulna.program.instructions import Operation
from ulna.program.precision import Precision
from ulna.program.scalar import Scalar

_REST = {
    Precision.DOUBLE: (
        *(0.5000000000000001, 0.16666666666666669, 0.041666666666623824, 0.008333333333330039, 0.0013888888917367081),
        *(0.00019841269863171557, 2.4801521057868204e-05, 2.7557268276905696e-06, 2.7620201591031547e-07),
        2.5100472505694996e-08,
    ),
    Precision.SINGLE: (*(0.5, 0.16666576666119928, 0.04166655421298415, 0.008363232883682618, 0.0013926250831497611),),
}
"""Of (e^r − 1 − r)/r² for |r| ≤ (log 2)/2, at Chebyshev's points."""
LOG_2_PARTS = {Precision.DOUBLE: parts(LOG_2, 42, 53), Precision.SINGLE: parts(LOG_2, 15, 24)}
"""A whole exponent of 2 times the first part is exact."""
RANGE = {Precision.DOUBLE: (-746.0, 711.0), Precision.SINGLE: (-104.0, 90.0)}
"""Arguments beyond which the answer is 0 or ∞, halved or not."""
_LEAST_HALF = {Precision.DOUBLE: -539, Precision.SINGLE: -76}
"""Half the least exponent of 2 that a result may need."""


def exponential(arithmetic: AbstractArithmetic, value: Scalar, *, halved: bool = False) -> Scalar:
    """e^x, or e^x/2; the polynomial is computed for x − n log 2, and 2^n multiplied with it at the end."""
    least, most = RANGE[arithmetic.precision]
    x = value.apply(Operation.MIN, most).apply(Operation.MAX, least)
    return exponential_of_sum(arithmetic, x, x.like(0.0), halved=halved)


def exponential_of_sum(arithmetic: AbstractArithmetic, x: Scalar, small: Scalar, *, halved: bool = False) -> Scalar:
    """e^(x + small) for x that is not beyond all results."""
    shift = rounding(arithmetic.precision)
    first, second = LOG_2_PARTS[arithmetic.precision]
    n = arithmetic.plus_product(x, 1.4426950408889634, shift) - shift
    high = arithmetic.plus_product(n, -first, x)
    low = n * second - small
    r = high - low
    rest = (r * r) * arithmetic.polynomial(r, _REST[arithmetic.precision])
    return _scaled(arithmetic, 1.0 + (high - (low - rest)), n - 1.0 if halved else n)


def _scaled(arithmetic: AbstractArithmetic, y: Scalar, n: Scalar) -> Scalar:
    """y 2^n, rounded once: twice times about 2^(n/2), whose exponent is a sum of powers of two."""
    shift, least = rounding(arithmetic.precision), float(_LEAST_HALF[arithmetic.precision])
    half = ((n * 0.5 - 0.25) + shift) - shift
    left = half - least
    scale = y.like(2.0**least)
    size = 512 if arithmetic.precision is Precision.DOUBLE else 64
    for weight in (size, *(size >> k for k in range(size.bit_length()))):
        done = left.less(float(weight))
        scale, left = done.where(scale, scale * 2.0**weight), done.where(left, left - float(weight))
    return (y * scale) * (n - (half + half)).where(scale + scale, scale)
