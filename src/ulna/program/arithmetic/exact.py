"""Numbers cut into parts, and sums and products with what rounding loses: precision beyond that of one number."""

from __future__ import annotations

from fractions import Fraction

from ulna.program.arithmetic.arithmetic import AbstractArithmetic
from ulna.program.precision import Precision
from ulna.program.scalar import Scalar

PI = Fraction("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803482534211707")
LOG_2 = Fraction(
    "0.693147180559945309417232121458176568075500134360255254120680009493393621969694715605863326996418687"
)

Pair = tuple[Scalar, Scalar]
"""A number as the sum of two: the first is the sum rounded, or nearly."""


def parts(value: Fraction, *bits: int) -> tuple[float, ...]:
    """Numbers of so many binary digits each whose sum is the value, but for the digits after the last."""
    found = []
    for count in bits:
        part = _rounded(value, count)
        found.append(float(part))
        value -= part
    return tuple(found)


def exact_sum(a: Scalar | float, b: Scalar) -> Pair:
    """a + b; Knuth's."""
    first = b.like(a)
    total = first + b
    part = total - first
    return total, (first - (total - part)) + (b - part)


def ordered_sum(a: Scalar, b: Scalar) -> Pair:
    """a + b for |a| ≥ |b|; Dekker's."""
    total = a + b
    return total, b - (total - a)


def exact_product(arithmetic: AbstractArithmetic, a: Scalar, b: Scalar) -> Pair:
    """a·b; by the fused multiply-add, else Dekker's."""
    total = a * b
    if arithmetic.fuses:
        return total, arithmetic.plus_product(a, b, -total)
    (a1, a2), (b1, b2) = (_cut(arithmetic.precision, each) for each in (a, b))
    return total, a2 * b2 - (((total - a1 * b1) - a2 * b1) - a1 * b2)


def pair_product(arithmetic: AbstractArithmetic, a: Pair, b: Pair) -> Pair:
    """a·b of two pairs, the product of the small parts left out."""
    high, low = exact_product(arithmetic, a[0], b[0])
    return ordered_sum(high, low + (a[0] * b[1] + a[1] * b[0]))


def _cut(precision: Precision, a: Scalar) -> Pair:
    """Veltkamp's: two halves of half the digits."""
    scaled = a * (2.0 ** ((precision.bits + 1) // 2) + 1.0)
    high = scaled - (scaled - a)
    return high, a - high


def _rounded(value: Fraction, bits: int) -> Fraction:
    """The nearest number of so many binary digits."""
    exponent = value.numerator.bit_length() - value.denominator.bit_length()
    unit = Fraction(2) ** (exponent - bits)
    unit *= 2 if abs(value) >= unit * 2**bits else 1
    return round(value / unit) * unit
