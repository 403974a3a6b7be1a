"""How a formula grows: its range over all values of its symbols, and a polynomial that bounds it, exactly."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import sympy as sp
from flint import arb
from sympy.polys.rings import PolyElement

from ulna.symbolic.exact import exact_ball

Number = Fraction | float
"""A fraction, or plus or minus infinity."""
Range = tuple[Number, Number]
"""Lower and upper bound; an infinite one means none."""
LINE: Range = (-math.inf, math.inf)

_LIMITED: Mapping[Any, Range] = {
    sp.sin: (Fraction(-1), Fraction(1)),
    sp.cos: (Fraction(-1), Fraction(1)),
    sp.tanh: (Fraction(-1), Fraction(1)),
    sp.atan: (Fraction(-11, 7), Fraction(11, 7)),
    sp.cosh: (Fraction(1), math.inf),
    sp.sinh: LINE,
    sp.asinh: LINE,
}
"""Functions that are smooth on the whole line, and where their values lie; 11/7 is above π/2."""


class UnboundedError(Exception):
    """A formula that is not shown to have a value everywhere, or to be bounded by a polynomial."""


@dataclass(slots=True)
class Growth:
    """Bounds of formulas over all values of some symbols.

    Attributes:
        known: the ranges of symbols that have one; the others range over the whole line.
        sizes: for each symbol a polynomial that bounds its absolute value; needed by `bound` alone.
    """

    known: dict[sp.Expr, Range]
    sizes: Mapping[sp.Symbol, PolyElement]

    def range(self, e: sp.Expr) -> Range:
        """Where the values of a formula lie. That it returns shows that the formula is smooth everywhere.

        Raises:
            UnboundedError: a division by what may be 0, a root or logarithm of what may not be positive, a function
                that is not smooth on the whole line.
        """
        if e not in self.known:
            self.known[e] = self._range(e)
        return self.known[e]

    def _range(self, e: sp.Expr) -> Range:
        if e.is_Symbol:
            return LINE
        if e.is_number:
            return enclosure(e)
        if e.is_Add:
            parts = [self.range(a) for a in e.args]
            return sum((low for low, _ in parts), Fraction(0)), sum((high for _, high in parts), Fraction(0))
        if e.is_Mul:
            found: Range = (Fraction(1), Fraction(1))
            for a in e.args:
                found = _product(found, self.range(a))
            return found
        if isinstance(e, sp.exp):
            return _exponential(self.range(e.exp))
        if e.is_Pow and e.exp.is_Rational:
            return self._power(e)
        if e.func in _LIMITED:
            self.range(e.args[0])
            return _LIMITED[e.func]
        if isinstance(e, sp.log):
            low, _ = self.range(e.args[0])
            if low > 0:
                return LINE
        raise UnboundedError(f"{e} is not shown to have a value everywhere")

    def _power(self, e: Any) -> Range:
        low, high = self.range(e.base)
        if not e.exp.is_Integer and not low > 0:
            raise UnboundedError(f"{e.base}, under a root, is not shown to be positive")
        if e.exp < 0:
            if not (low > 0 or high < 0):
                raise UnboundedError(f"the divisor {e.base} is not shown to differ from 0")
            low, high = _reciprocal(high), _reciprocal(low)
        power = abs(e.exp)
        if not power.is_Integer:
            # x^q lies between the smaller and the larger of 1 and x, up to whole powers.
            whole = int(sp.ceiling(power))
            return min(low**whole, Fraction(1)), max(high**whole, Fraction(1))
        p = int(power)
        if p % 2 or low >= 0:
            return low**p, high**p
        if high <= 0:
            return high**p, low**p
        return Fraction(0), max(-low, high) ** p

    def bound(self, e: sp.Expr) -> PolyElement:
        """A polynomial with coefficients from 0 on that bounds the absolute value of a formula.

        Raises:
            UnboundedError: none is found.
        """
        low, high = self.range(e)
        most = max(-low, high)
        ring = next(iter(self.sizes.values())).ring
        if most < math.inf:
            return ring(sp.QQ(most.numerator, most.denominator)) if isinstance(most, Fraction) else ring(0)
        if e.is_Symbol:
            return self.sizes[e]
        if e.is_Add:
            return sum((self.bound(a) for a in e.args), ring(0))
        if e.is_Mul:
            found = ring(1)
            for a in e.args:
                found *= self.bound(a)
            return found
        if e.is_Pow and e.exp.is_Integer and e.exp > 0:
            return self.bound(e.base) ** int(e.exp)
        if e.is_Pow and 0 < e.exp < 1:
            return self.bound(e.base) + 1
        if isinstance(e, sp.asinh):
            return self.bound(e.args[0])
        raise UnboundedError(f"{e} grows faster than any polynomial bound that was found")


def enclosure(e: sp.Expr) -> Range:
    """Fractions below and above a number."""
    if e.is_Rational:
        value = Fraction(int(e.p), int(e.q))
        return value, value
    found = exact_ball(e)
    if not found.is_finite():
        raise UnboundedError(f"{e} is not a supported number")
    return _fraction(found.lower()), _fraction(found.upper())


def _fraction(value: arb) -> Fraction:
    mantissa, exponent = value.mid().man_exp()
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)


def _reciprocal(value: Number) -> Number:
    return Fraction(0) if abs(value) == math.inf else 1 / value


def _product(a: Range, b: Range) -> Range:
    # 0 times a bound that is not there is 0: the bound stands for finite numbers.
    corners = [x * y if x and y else Fraction(0) for x in a for y in b]
    return min(corners), max(corners)


def _exponential(inner: Range) -> Range:
    low, high = (v if isinstance(v, float) else (arb(v.numerator) / v.denominator).exp() for v in inner)
    bottom = _fraction(low.lower()) if isinstance(low, arb) else Fraction(0)
    return bottom, _fraction(high.upper()) if isinstance(high, arb) else math.inf
