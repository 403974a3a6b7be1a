"""The loop as the second program sees it: formulas, and their values with derivatives, in balls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import sympy as sp
from flint import arb

from ulna.certify.checker_arithmetic import Dual, around, dual, dual_of_product, sum_of_slopes

SEGMENTS = 4
"""Parts of the line over which the mean is taken: any number is valid, more are finer."""


@dataclass(slots=True)
class LimitedLoop:
    """ζ' = g + β (s − k), s = k within limits, as formulas."""

    symbols: list[sp.Symbol]
    closed: list[sp.Expr]
    gains: list[list[sp.Expr]]
    commands: list[sp.Expr]
    lower: list[arb]
    upper: list[arb]

    def duals(self, point: Sequence[arb]) -> tuple[list[Dual], list[arb]]:
        """The rates with their derivatives by every coordinate, and the commands."""
        n = len(self.symbols)
        known = {
            s: Dual(v, [arb(1) if j == k else arb(0) for j in range(n)])
            for k, (s, v) in enumerate(zip(self.symbols, point, strict=True))
        }
        shared: dict[sp.Expr, Dual] = {}
        rates = [dual(e, known, shared) for e in self.closed]
        commands = [dual(e, known, shared) for e in self.commands]
        for j, k in enumerate(commands):
            low, high = self.lower[j], self.upper[j]
            if k.value > low and k.value < high:
                continue
            share = arb(-1) if k.value > high or k.value < low else arb(-0.5, 0.5)
            beyond = Dual(k.value.max(low).min(high) - k.value, [share * each for each in k.slope])
            pushed = [dual_of_product([dual(row[j], known, shared), beyond]) for row in self.gains]
            rates = [
                Dual(r.value + p.value, sum_of_slopes([r.slope, p.slope])) for r, p in zip(rates, pushed, strict=True)
            ]
        full = [Dual(r.value, r.slope or [arb(0)] * n) for r in rates]
        return full, [k.value for k in commands]

    def secant(self, point: Sequence[arb], offset: Sequence[arb]) -> list[list[arb]]:
        """Every M with ζ' = M d, for ζ* in the point and d in the offset."""
        n = len(self.symbols)
        total = [[arb(0)] * n for _ in range(n)]
        for part in range(SEGMENTS):
            share = around(Fraction(2 * part + 1, 2 * SEGMENTS), Fraction(1, 2 * SEGMENTS))
            rates, _ = self.duals([x + share * d for x, d in zip(point, offset, strict=True)])
            for i, rate in enumerate(rates):
                for j, slope in enumerate(rate.slope):
                    total[i][j] += slope / SEGMENTS
        return total
