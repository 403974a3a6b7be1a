"""The second program on global claims: what it accepts is true.

1. T, T⁻¹, every wire and every rate are smooth at every state, as the formulas stand; T⁻¹ is the inverse everywhere.
2. Without errors w' = A w + b, the errors are e' = E e, and for both a quadratic form falls at the rate that is told.
3. The slopes of w' by the errors grow at most as w itself, so errors that decay do not drive w to infinity.

Every node of a formula is given an interval of its values over all of space, and the degree to which it grows with the
outer coordinates; its slopes by the errors are given degrees in forward mode. Coefficients, which may depend on the
size of the errors, do not matter: the errors decay by themselves.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import sympy as sp
from flint import arb

from ulna.certify.checker.arithmetic import NotRightError, dual, exactly, pivots, vanishes

End = Fraction | float
"""An end of an interval: a fraction or infinity."""


@dataclass(slots=True)
class Grown:
    """A formula over all of space.

    Attributes:
        low, high: of its values. degree: |value| ≤ C(e) (1 + |w|)^degree. slopes: the same for each error, −1 for zero.
    """

    low: End
    high: End
    degree: Fraction | float
    slopes: list[Fraction | float]

    def limited(self) -> Grown:
        """With degree 0 where the interval is finite."""
        return Grown(self.low, self.high, 0, self.slopes) if max(-self.low, self.high) < math.inf else self


@dataclass(frozen=True, slots=True, kw_only=True)
class Everywhere:
    """A loop without limits, as formulas.

    Attributes:
        symbols: ζ. outer: how many come before the errors. closed: ζ'.
        still: the rates of the outer ones without errors.
        maps: T in x and T⁻¹ in ζ. wires: in x and earlier wires. rates: in x and wires.
    """

    symbols: Sequence[sp.Symbol]
    outer: int
    closed: Sequence[sp.Expr]
    still: Sequence[sp.Expr]
    maps: Sequence[sp.Expr]
    wires: Sequence[tuple[sp.Symbol, sp.Expr]]
    rates: Sequence[sp.Expr]

    def reason(self, P: list[list[arb]], rates: Sequence[Fraction]) -> str:
        """Empty where all runs converge, with these rates of √V; else what is not shown."""
        k, n = self.outer, len(self.symbols)
        self._smooth()
        blocks = [(self.still, slice(0, k)), *([(self.closed[k:], slice(k, n))] if k < n else [])]
        if len(rates) != len(blocks) or any(P[i][j] != 0 for i in range(k) for j in range(k, n)):
            return "there is not one rate for each block of P"
        for (formulas, part), rate in zip(blocks, rates, strict=True):
            if not _falls(formulas, self.symbols[part], [row[part] for row in P[part]], rate):
                return f"V is not shown to decrease at the rate {rate}"
        rest = dict.fromkeys(self.symbols[k:], sp.Integer(0))
        if not all(vanishes(e.xreplace(rest)) for e in self.closed[k:]):
            return "the errors do not rest at 0"
        known: dict[Any, Grown] = {s: Grown(-math.inf, math.inf, 1, [-1.0] * (n - k)) for s in self.symbols[:k]}
        for j, s in enumerate(self.symbols[k:]):
            known[s] = Grown(-math.inf, math.inf, 0, [0.0 if i == j else -1.0 for i in range(n - k)])
        for e in self.closed[:k]:
            if any(slope > 1 for slope in grown(e, known, n - k).slopes):
                return "a rate may grow faster than its states with the errors: they may escape in finite time"
        return ""

    def _smooth(self) -> None:
        """Nothing, if every formula is smooth everywhere."""
        names = {s for e in (*self.maps, *self.rates, *(w for _, w in self.wires)) for s in e.free_symbols}
        known: dict[Any, Grown] = {s: Grown(-math.inf, math.inf, 1, []) for s in names}
        for e in self.maps:
            grown(e, known, 0)
        for symbol, formula in self.wires:
            # Where a wire lies is known from its formula; what depends on it comes after it.
            known[symbol] = grown(formula, known, 0)
        for e in self.rates:
            grown(e, known, 0)


def _falls(formulas: Sequence[sp.Expr], symbols: Sequence[sp.Symbol], P: list[list[arb]], rate: Fraction) -> bool:
    """Whether the formulas are affine, and dᵀPd falls at least at twice the rate, which is positive, along them."""
    n = len(symbols)
    slopes = [[sp.diff(e, s) for s in symbols] for e in formulas]
    if (
        rate <= 0
        or any(e.free_symbols for row in slopes for e in row)
        or any(e.free_symbols - {*symbols} for e in formulas)
    ):
        return False
    A = [[dual(e, {}, {}).value for e in row] for row in slopes]
    half = [[sum((P[i][m] * A[m][j] for m in range(n)), arb(0)) for j in range(n)] for i in range(n)]
    double = 2 * exactly(rate)
    S = [[-(half[i][j] + half[j][i] + double * P[i][j]) for j in range(n)] for i in range(n)]
    return len(pivots(S)) == n and all(pivot > 0 for pivot in pivots(S))


def grown(e: Any, known: dict[Any, Grown], errors: int) -> Grown:
    """How a formula grows; that it returns shows that it is smooth everywhere.

    Raises:
        NotRightError: it is not shown to be.
    """
    if e not in known:
        known[e] = _node(e, known, errors).limited()
    return known[e]


def _node(e: Any, known: dict[Any, Grown], errors: int) -> Grown:
    none: list[Fraction | float] = [-1] * errors
    if e.is_Rational:
        value = Fraction(int(e.p), int(e.q))
        return Grown(value, value, 0, none)
    if e is sp.pi or e is sp.E:
        return Grown(Fraction(2), Fraction(4), 0, none)
    if e.is_Add:
        parts = [grown(a, known, errors) for a in e.args]
        low, high = sum((p.low for p in parts), Fraction(0)), sum((p.high for p in parts), Fraction(0))
        slopes = [max(column) for column in zip(*(p.slopes for p in parts), strict=True)]
        return Grown(low, high, max(p.degree for p in parts), slopes)
    if e.is_Mul:
        return _product([grown(a, known, errors) for a in e.args])
    if e.is_Pow and e.exp.is_Rational:
        return _power(grown(e.base, known, errors), Fraction(int(e.exp.p), int(e.exp.q)), e)
    if isinstance(e, sp.exp):
        inner = grown(e.exp, known, errors)
        if isinstance(inner.high, float):
            return Grown(Fraction(0), math.inf, math.inf, [-1 if s < 0 else math.inf for s in inner.slopes])
        top = Fraction(math.ceil(float(exactly(Fraction(inner.high)).exp().upper()) * 1.001))
        return Grown(Fraction(0), top, 0, inner.slopes)
    name = e.func.__name__
    if name in ("sin", "cos", "tanh", "atan") and len(e.args) == 1:
        inner, most = grown(e.args[0], known, errors), Fraction(1 if name != "atan" else 2)
        return Grown(-most, most, 0, inner.slopes)
    if name in ("asinh", "log"):
        inner = grown(e.args[0], known, errors)
        if name == "asinh" or inner.low > 0:
            return Grown(-math.inf, math.inf, inner.degree, inner.slopes)
    raise NotRightError(f"{e} is not shown to be smooth everywhere")


def _product(parts: Sequence[Grown]) -> Grown:
    found = parts[0]
    for p in parts[1:]:
        corners = [a * b if a and b else Fraction(0) for a in (found.low, found.high) for b in (p.low, p.high)]
        slopes = [
            max(-1 if a < 0 else a + p.degree, -1 if b < 0 else b + found.degree)
            for a, b in zip(found.slopes, p.slopes, strict=True)
        ]
        found = Grown(min(corners), max(corners), found.degree + p.degree, slopes).limited()
    return found


def _power(base: Grown, power: Fraction, e: Any) -> Grown:
    low, high, whole = base.low, base.high, power.denominator == 1
    if not whole and not low > 0:
        raise NotRightError(f"{e} is a root of what is not shown to be positive")
    if power < 0:
        below = _power(base, -power, e)
        if not (below.low > 0 or below.high < 0):
            raise NotRightError(f"{e} divides by what is not shown to differ from 0")
        # 1/x is bounded, so its slope grows as that of x.
        return Grown(_over(below.high), _over(below.low), 0, below.slopes)
    if not whole:
        rounds, steeper = math.ceil(power), max(power - 1, Fraction(0))
        slopes = [-1 if s < 0 else s + steeper * base.degree for s in base.slopes]
        return Grown(min(low**rounds, Fraction(1)), max(high**rounds, Fraction(1)), power * base.degree, slopes)
    p = power.numerator
    slopes = [-1 if s < 0 else s + (p - 1) * base.degree for s in base.slopes]
    ends = [low**p, high**p]
    bottom = Fraction(0) if p % 2 == 0 and low <= 0 <= high else min(ends)
    return Grown(bottom, max(ends), p * base.degree, slopes)


def _over(value: End) -> End:
    return Fraction(0) if abs(value) == math.inf else 1 / value
