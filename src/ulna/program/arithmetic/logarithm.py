"""The natural logarithm and powers written out."""

from __future__ import annotations

import math
from fractions import Fraction

from ulna.program.arithmetic.arithmetic import AbstractArithmetic
from ulna.program.arithmetic.exact import Pair, exact_product, exact_sum, ordered_sum, pair_product, parts
from ulna.program.arithmetic.exponential import LOG_2_PARTS, RANGE, exponential_of_sum
from ulna.program.instructions import Operation
from ulna.program.precision import Precision
from ulna.program.scalar import Scalar

_REST = {
    Precision.DOUBLE: (
        *(0.666666666666667, 0.3999999999989889, 0.28571428626253836, 0.22222211089379496, 0.1818289243253687),
        *(0.15331611722055008, 0.14617807153417325),
    ),
    Precision.SINGLE: (0.6666668509542907, 0.39988757716604845, 0.29580985929974424),
}
"""Of (log m − 2 s)/s³ in s² for s = (m − 1)/(m + 1) and √½ ≤ m ≤ √2, at Chebyshev's points."""
_FINE_REST = {
    Precision.DOUBLE: (
        *(0.4000000000000003, 0.2857142857133801, 0.22222222271326808, 0.18181808210921882, 0.15385577463308145),
        *(0.13285868837545742, 0.1291471218393509),
    ),
    Precision.SINGLE: (0.40000015096956515, 0.2856221924167662, 0.230490028044481),
}
"""Of (log m − 2 s − 2/3 s³)/s⁵ in s²."""
_LEAST_EXPONENT = {Precision.DOUBLE: -1022, Precision.SINGLE: -126}


def logarithm(arithmetic: AbstractArithmetic, value: Scalar) -> Scalar:
    """log x = log m + n log 2; −∞ at 0, NaN below."""
    m, n = _split(arithmetic, value)
    first, second = LOG_2_PARTS[arithmetic.precision]
    f = m - 1.0
    s = f / (m + 1.0)
    w = s * s
    half = 0.5 * f * f
    rest = s * arithmetic.plus_product(w, arithmetic.polynomial(w, _REST[arithmetic.precision]), half)
    result = arithmetic.plus_product(n, first, f - (half - arithmetic.plus_product(n, second, rest)))
    return _with_edges(value, result)


def logarithm_of_one_plus(arithmetic: AbstractArithmetic, value: Scalar) -> Scalar:
    """log(1 + u) for u ≥ 0; what rounding 1 + u loses is added to the logarithm of the sum."""
    total = value + 1.0
    lost = value - (total - 1.0)
    return value.less(math.inf).where(logarithm(arithmetic, total) + lost / total, value)


def power(arithmetic: AbstractArithmetic, base: Scalar, exponent: Scalar) -> Scalar:
    """x^y = ± e^(y log |x|), the logarithm and the product as sums of two numbers; edges as in C99."""
    bits, most = arithmetic.precision.bits, -RANGE[arithmetic.precision][0]
    log = _fine_logarithm(arithmetic, abs(base))
    # Beyond this the answer is 0, 1 or infinite whatever the exponent.
    limit = 2.0 ** (bits + 17)
    y = exponent.apply(Operation.MIN, limit).apply(Operation.MAX, -limit)
    high, low = exact_product(arithmetic, y, log[0])
    low = abs(high).less(most).where(low + y * log[1], 0.0)
    high = high.apply(Operation.MIN, RANGE[arithmetic.precision][1]).apply(Operation.MAX, -most)
    size = exponential_of_sum(arithmetic, high, low)
    # Sign: that of the base where the exponent is odd; a negative base wants a whole exponent.
    n, whole = abs(exponent), 2.0 ** (bits - 1)
    is_whole = n.less(whole).where(n.apply(Operation.EQUAL, (n + whole) - whole), 1.0)
    is_odd = n.less(2.0 * whole).where(_differ(n * 0.5, (n * 0.5 + whole) - whole), 0.0)
    is_zero = base.apply(Operation.EQUAL, 0.0)
    edge = is_zero.apply(Operation.OR, abs(base).apply(Operation.EQUAL, math.inf))
    signed = is_whole.where(is_odd.where(-size, size), edge.where(size, math.nan))
    value = is_zero.where(1.0 / base, base).less(0.0).where(signed, size)
    one = exponent.apply(Operation.EQUAL, 0.0).apply(Operation.OR, base.apply(Operation.EQUAL, 1.0))
    return one.where(1.0, value)


def _fine_logarithm(arithmetic: AbstractArithmetic, value: Scalar) -> Pair:
    """log x with a dozen digits more; for x ≥ 0."""
    m, n = _split(arithmetic, value)
    below = exact_sum(1.0, m)
    f = m - 1.0
    s = f / below[0]
    back = exact_product(arithmetic, s, below[0])
    s_low = (((f - back[0]) - back[1]) - s * below[1]) / below[0]
    square, square_low = exact_product(arithmetic, s, s)
    w = square, square_low + 2.0 * s * s_low
    third, third_low = parts(Fraction(2, 3), arithmetic.precision.bits, arithmetic.precision.bits)
    tail = square * arithmetic.polynomial(square, _FINE_REST[arithmetic.precision])
    inner = ordered_sum(s.like(third), tail)
    rest = pair_product(arithmetic, w, (inner[0], inner[1] + third_low))
    rest = pair_product(arithmetic, (s, s_low), rest)
    near = ordered_sum(2.0 * s, rest[0])
    near_low = near[1] + (rest[1] + 2.0 * s_low)
    first, second = LOG_2_PARTS[arithmetic.precision]
    total = exact_sum(n * first, near[0])
    high, low = ordered_sum(total[0], total[1] + arithmetic.plus_product(n, second, near_low))
    return _with_edges(value, high), low


def _split(arithmetic: AbstractArithmetic, value: Scalar) -> Pair:
    """(m, n) with x = m 2^n and √½ < m ≤ √2: the exponent is a sum of powers of two."""
    least = _LEAST_EXPONENT[arithmetic.precision]
    up = float(arithmetic.precision.bits + 1)
    tiny = value.less(2.0**least)
    m, n = tiny.where(value * 2.0**up, value), tiny.where(-up, value.like(0.0))
    small, far = m.less(1.0), float(1 - least)
    m, n = small.where(m * 2.0**far, m), small.where(n - far, n)
    size = (1 - least) // 2 + 1
    for weight in (size >> k for k in range(size.bit_length())):
        fits = m.less(2.0**weight)
        m, n = fits.where(m, m * 2.0**-weight), fits.where(n, n + float(weight))
    above = m.more(math.sqrt(2.0))
    return above.where(m * 0.5, m), above.where(n + 1.0, n)


def _differ(a: Scalar, b: Scalar) -> Scalar:
    return a.apply(Operation.EQUAL, b).apply(Operation.NOT)


def _with_edges(value: Scalar, result: Scalar) -> Scalar:
    """The logarithm of any number, given that of a finite positive one."""
    positive = value.less(math.inf).where(result, value)
    return value.more(0.0).where(positive, value.apply(Operation.EQUAL, 0.0).where(-math.inf, math.nan))
