"""The second program on claims over parameters: what it accepts is true.

1. The boxes of the tree cover the box of parameters: they are its halves.
2. On each of them an equilibrium lies within the radii of the center for every value of the parameters: Krawczyk's test
   for δ in ζ = ζ₀ + S (p − p₀) + δ, which any S makes valid. The loop has a value there, and no limit is met.
3. The characteristic polynomial, by Faddeev and LeVerrier in the field of fractions, has its roots left of the
   imaginary axis: its coefficients are enclosed by the mean-value form along the equilibrium as it moves, and of the
   polynomials between them Kharitonov's four pass Routh's test.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import sympy as sp
from flint import arb
from sympy.polys.fields import sfield

from ulna.certify.certificate import Piece
from ulna.certify.checker.arithmetic import (
    Box,
    Dual,
    NotRightError,
    approximate_inverse,
    around,
    dual,
    exactly,
    fraction,
    halves,
)
from ulna.certify.checker.loop import LimitedLoop

_NEAR = Fraction(1, 10**9)
"""Relative to 1 + |ζ₀|: how near the center the equilibrium at the middle of a box must lie."""


@dataclass(slots=True)
class OverParameters:
    """A loop whose last symbols are parameters.

    Attributes:
        loop: its symbols are ζ, then the parameters. size: how many are ζ.
        finite: whether wires and rates have a value.
        bounds: of the parameters. splits, pieces: as in the certificate.
        coefficients: of the characteristic polynomial, found from the loop.
    """

    loop: LimitedLoop
    size: int
    finite: Callable[[list[arb]], bool]
    bounds: Sequence[tuple[Fraction, Fraction]]
    splits: Sequence[str]
    pieces: Sequence[Piece]
    coefficients: list[sp.Expr] = field(default_factory=list)

    def reason(self) -> str:
        """Empty where the claim is shown; else what is not."""
        if not self.bounds or any(low > high for low, high in self.bounds):
            return "the bounds of the parameters are not ranges"
        z = self.loop.symbols[: self.size]
        self.coefficients = characteristic([[sp.diff(e, s) for s in z] for e in self.loop.closed])
        stack: list[Box] = [[((low + high) / 2, (high - low) / 2) for low, high in self.bounds]]
        pieces = iter(self.pieces)
        for word in self.splits:
            if not stack:
                return "the tree of boxes goes on after its end"
            box = stack.pop()
            if word.startswith("/") and 0 <= int(word[1:]) < len(box):
                stack += halves(box, int(word[1:]))
            elif word != ".":
                return "the tree has an unknown word"
            elif wrong := self._unstable(box, next(pieces, None)):
                values = ", ".join(f"{float(middle):.4g} ± {float(half):.2g}" for middle, half in box)
                return f"{wrong}: parameters {values}"
        return "the tree of boxes ends too early" if stack or next(pieces, None) is not None else ""

    def _unstable(self, box: Box, piece: Piece | None) -> str:
        """What is not shown on a box."""
        if piece is None or not len(piece.center) == len(piece.radii) == self.size:
            return "a part has no center with radii"
        center, radii = [fraction(v) for v in piece.center], [fraction(v) for v in piece.radii]
        point: Box = [(middle, Fraction(0)) for middle, _ in box]
        near = [_NEAR * (1 + abs(c)) for c in center]
        if not self._rests(center, near, point) or not self._rests(center, radii, box):
            return "no equilibrium is proved to be within the radii of the center"
        at = [around(c, r) for c, r in zip(center, radii, strict=True)] + [around(*side) for side in box]
        rates, commands = self.loop.duals(at)
        limits = zip(commands, self.loop.lower, self.loop.upper, strict=True)
        if not self.finite(at) or not all(k > low and k < high for k, low, high in limits):
            return "a limit is met at the equilibrium, or the loop has no value there"
        slope = [rate.slope for rate in rates]
        n = self.size
        moved = solved([row[:n] for row in slope], [row[n:] for row in slope])
        start = [around(c, r) for c, r in zip(center, near, strict=True)] + [exactly(middle) for middle, _ in box]
        values, turns = self._polynomial(start), self._polynomial(at)
        found = []
        for value, turn in zip(values, turns, strict=True):
            total = value.value
            for j, (_, half) in enumerate(box):
                along = turn.slope[n + j] - sum((turn.slope[i] * moved[i][j] for i in range(n)), arb(0))
                total += along * around(Fraction(0), half)
            found.append(total)
        return "" if all_left(found) else "the characteristic polynomial is not shown to have its roots on the left"

    def _polynomial(self, point: Sequence[arb]) -> list[Dual]:
        """c₁ … cₙ with their slopes by ζ and parameters."""
        m = len(self.loop.symbols)
        known = {
            s: Dual(v, [arb(int(j == k)) for j in range(m)])
            for k, (s, v) in enumerate(zip(self.loop.symbols, point, strict=True))
        }
        shared: dict[sp.Expr, Dual] = {}
        found = [dual(c, known, shared) for c in self.coefficients]
        return [Dual(each.value, each.slope or [arb(0)] * m) for each in found]

    def _rests(self, center: list[Fraction], radii: list[Fraction], box: Box) -> bool:
        n, m = self.size, len(box)
        middle = [exactly(c) for c in center]
        rates, _ = self.loop.duals([*middle, *(exactly(side[0]) for side in box)])
        inverse = approximate_inverse([rate.slope[:n] for rate in rates])
        slope = _product(inverse, [rate.slope[n:] for rate in rates])
        S = [[Fraction(float(-v.mid())) for v in row] for row in slope]
        reach = [sum((abs(S[i][j]) * box[j][1] for j in range(m)), Fraction(0)) for i in range(n)]
        left = [r - a for r, a in zip(radii, reach, strict=True)]
        if not all(r > 0 for r in left):
            return False
        sides = [around(*side) for side in box]
        moved, _ = self.loop.duals([*(around(c, a) for c, a in zip(center, reach, strict=True)), *sides])
        offset = [rate.value for rate in rates]
        for i, rate in enumerate(moved):
            for j, (_, half) in enumerate(box):
                turn = rate.slope[n + j] + sum((rate.slope[k] * exactly(S[k][j]) for k in range(n)), arb(0))
                offset[i] += turn * around(Fraction(0), half)
        whole, _ = self.loop.duals([*(around(c, r) for c, r in zip(center, radii, strict=True)), *sides])
        product = _product(inverse, [rate.slope[:n] for rate in whole])
        shift = _product(inverse, [[each] for each in offset])
        for i in range(n):
            total = -shift[i][0]
            for j in range(n):
                total += (arb(int(i == j)) - product[i][j]) * around(Fraction(0), left[j])
            if not total.abs_upper() < exactly(left[i]):
                return False
        return True


def characteristic(matrix: list[list[sp.Expr]]) -> list[sp.Expr]:
    """c₁ … cₙ of det(λ − A)."""
    n = len(matrix)
    whole = sp.Matrix(matrix)
    names = {f: sp.Dummy() for f in sorted(whole.atoms(sp.Function), key=sp.default_sort_key)}
    own, entries = sfield([*whole.xreplace(names), *(sp.Integer(k) for k in range(1, n + 1))])
    A, back = [entries[i * n : (i + 1) * n] for i in range(n)], {symbol: f for f, symbol in names.items()}
    power, found = [[own.one if i == j else own.zero for j in range(n)] for i in range(n)], []
    for k in range(1, n + 1):
        power = [[sum((A[i][m] * power[m][j] for m in range(n)), own.zero) for j in range(n)] for i in range(n)]
        last = -sum((power[i][i] for i in range(n)), own.zero) / own(k)
        found.append(last.as_expr().xreplace(back))
        power = [[power[i][j] + (last if i == j else own.zero) for j in range(n)] for i in range(n)]
    return found


def all_left(coefficients: Sequence[arb]) -> bool:
    """Whether λⁿ + c₁λⁿ⁻¹ + … has its roots left of the imaginary axis for all coefficients in these balls."""
    if not all(c.is_finite() for c in coefficients):
        return False
    rising = [arb(1), *coefficients][::-1]
    ends = [(c.lower(), c.upper()) for c in rising]
    return all(_routh([pair[int((k + turn) % 4 in (1, 2))] for k, pair in enumerate(ends)][::-1]) for turn in range(4))


def _routh(polynomial: list[arb]) -> bool:
    """Whether every root lies left: the quotients of Routh's continued fraction are positive."""
    above, below = polynomial[0::2], polynomial[1::2]
    while below:
        if not (above[0] > 0 and below[0] > 0):
            return False
        factor = above[0] / below[0]
        padded = [*below, arb(0)]
        above, below = below, [a - factor * b for a, b in zip(above[1:], padded[1:], strict=False)]
    return True


def solved(matrix: list[list[arb]], right: list[list[arb]]) -> list[list[arb]]:
    """The solution of A X = B by elimination, after a product with an inverse of the middle."""
    n, inverse = len(matrix), approximate_inverse(matrix)
    rows = [[*a, *b] for a, b in zip(_product(inverse, matrix), _product(inverse, right), strict=True)]
    for k in range(n):
        if not (rows[k][k] > 0 or rows[k][k] < 0):
            raise NotRightError("the Jacobian at the equilibrium is not shown to be invertible")
        for i in range(n):
            if i != k:
                factor = rows[i][k] / rows[k][k]
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k], strict=True)]
    return [[v / row[k] for v in row[n:]] for k, row in enumerate(rows)]


def _product(left: Any, right: Any) -> list[list[arb]]:
    inner = range(len(right))
    return [[sum((row[k] * right[k][j] for k in inner), arb(0)) for j in range(len(right[0]))] for row in left]
