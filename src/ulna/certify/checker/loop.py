"""The loop as the second program sees it: formulas, and their values with derivatives, in balls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import sympy as sp
from flint import arb

from ulna.certify.certificate import OVER, Certificate
from ulna.certify.checker.arithmetic import (
    Box,
    Dual,
    approximate_inverse,
    around,
    definite,
    dot,
    dual,
    dual_of_product,
    exactly,
    sum_of_slopes,
    times,
)

SEGMENTS = 4
"""Parts of the line over which the mean is taken: any number is valid, more are finer."""


@dataclass(slots=True)
class LimitedLoop:
    """ζ' = g + β (s − k), s = k within limits, as formulas.

    `linear` is found when first asked for: about the slopes at rest, and Q = −(PA + AᵀP).
    """

    symbols: list[sp.Symbol]
    closed: list[sp.Expr]
    gains: list[list[sp.Expr]]
    commands: list[sp.Expr]
    lower: list[arb]
    upper: list[arb]
    linear: list[list[list[arb]]] = field(default_factory=list)

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

    def power(self, P: Sequence[Sequence[arb]], point: Sequence[arb], box: Box) -> arb:
        """An upper bound of wᵀPw' on the box w = m + δ, no errors; for any A with w' = A w + ν.

        wᵀPAw ≤ −mᵀQm/2 − mᵀQδ as Q = −(PA + AᵀP) ≥ 0, and wᵀPν = mᵀPν(m) + gᵀδ, g its gradient over the box.
        """
        k = len(box)
        m, delta = [exactly(side[0]) for side in box], [around(Fraction(0), side[1]) for side in box]
        start, _ = self.duals([p + v for p, v in zip(point, m, strict=False)])
        rates, _ = self.duals([p + v + d for p, v, d in zip(point, m, delta, strict=False)])
        A, Q = self._linear(P, point)
        turn = [[rate.slope[j] - A[i][j] for j in range(k)] for i, rate in enumerate(rates)]
        still = [rate.value - v for rate, v in zip(start, times(A, m), strict=True)]
        moved = [a + b for a, b in zip(still, times(turn, delta), strict=True)]
        push, Qm = times(P, [a + b for a, b in zip(m, delta, strict=True)]), times(Q, m)
        gradient = [
            a + b - c for a, b, c in zip(times(P, moved), times(zip(*turn, strict=True), push), Qm, strict=True)
        ]
        return dot(m, times(P, still)) - dot(m, Qm) / 2 + dot(gradient, delta)

    def _linear(self, P: Sequence[Sequence[arb]], rest: Sequence[arb]) -> tuple[list[list[arb]], list[list[arb]]]:
        """About the slopes at rest, and Q; both 0 where Q is not positive definite."""
        if not self.linear:
            rates, _ = self.duals(rest)
            A = [[arb(float(v.mid())) for v in rate.slope] for rate in rates]
            half = [times(zip(*A, strict=True), row) for row in P[: len(rest)]]
            Q = [[-(half[i][j] + half[j][i]) for j in range(len(rest))] for i in range(len(rest))]
            zero = [[arb(0)] * len(rest) for _ in range(len(rest))]
            self.linear = [A, Q] if definite(Q) else [zero, zero]
        return self.linear[0], self.linear[1]

    def one_equilibrium(self, center: Sequence[Fraction], point: Sequence[arb]) -> bool:
        """Whether exactly one is in the box around the center, and no limit is met in it."""
        n = len(self.symbols)
        _, commands = self.duals(point)
        for value, low, high in zip(commands, self.lower, self.upper, strict=True):
            if not (value > low and value < high):
                return False
        middle = [exactly(c) for c in center]
        rates, _ = self.duals(middle)
        slope = self.secant(middle, [p - c for p, c in zip(point, middle, strict=True)])
        near = approximate_inverse(slope)
        for i in range(n):
            total = arb(0)
            for j in range(n):
                total -= near[i][j] * rates[j].value
                product = arb(0)
                for k in range(n):
                    product += near[i][k] * slope[k][j]
                total += ((arb(1) if i == j else arb(0)) - product) * (point[j] - middle[j])
            if not total.abs_upper() < (point[i] - middle[i]).abs_upper():
                return False
        return True


def names_wrong(given: Certificate) -> str:
    """What does not fit among states, coordinates, wires, limits and parameters."""
    n = len(given.coordinates)
    if not 0 < given.outer <= n == len(given.states):
        return "states and coordinates differ in number"
    names = [*given.states, *(row[0] for row in (*given.wires, *given.parameters) if row)]
    if len(set(names)) != len(names) or len(set(given.coordinates)) != n:
        return "names of states, wires and parameters are not all different"
    if any(len(wire) != 2 for wire in given.wires) or not {*given.limited} <= {wire[0] for wire in given.wires}:
        return "a limited signal is not a wire"
    if not len(given.limited) == len(given.lower) == len(given.upper):
        return "a limited signal has no limits"
    if any(len(row) != 3 for row in given.parameters) or (given.theorem == OVER) != bool(given.parameters):
        return "a parameter has no bounds, or there is none where there should be"
    if {row[0] for row in given.parameters} & {*given.coordinates}:
        return "a parameter has the name of a coordinate"
    return ""
