"""All zeros of equations in a box, with proof: interval bisection with Krawczyk's test in ball arithmetic.

R. Krawczyk, "Newton-Algorithmen zur Bestimmung von Nullstellen mit Fehlerschranken", Computing 4 (1969); E. Hansen and
G. W. Walster, Global Optimization Using Interval Analysis, 2nd ed. (2004), chapter 11.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp
from flint import arb, arb_mat, ctx

from ulna.base import Verdict
from ulna.symbolic.exact import RootWhereReal, Tape, tape, worked

_BITS, _FINE_BITS = 64, 192
_WIDER = 0.05
"""Share of its width by which a box grows before it is tested, so that no zero sits on a seam."""
_LEAST = 1e-11
"""The same relative to the place of the box, where its width has become nothing."""
_CUT = 0.4871
"""Where a side is cut: not in the middle, where zeros at round numbers would sit."""
_SMALLEST = 1e-9
"""Width of a box, relative to its place, at which it is given up."""
_MAX_BOXES = 20_000
_STEPS = 40
_RADII = (1e-30, 1e-24, 1e-18, 1e-13)
"""Of the enclosures that are tried around a zero, relative to it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BoxZeros:
    """Zeros of n equations in a box.

    Attributes:
        points: (n) balls each, every one with exactly one zero in it, in ascending order.
        boxes: how many were looked at.
        unresolved: boxes, (lower, upper) for each unknown, in which nothing could be decided.
        unknowns: in order.
    """

    points: tuple[tuple[arb, ...], ...]
    boxes: int
    unresolved: tuple[tuple[tuple[float, float], ...], ...]
    unknowns: tuple[sp.Symbol, ...]

    @property
    def values(self) -> list[dict[sp.Symbol, sp.Expr]]:
        """The zeros as numbers of 30 digits."""
        return [dict(zip(self.unknowns, map(_number, point), strict=True)) for point in self.points]

    def complete(self, claim: str) -> Verdict:
        """Whether these are all the zeros, said as `claim`."""
        if not self.unresolved:
            return Verdict.proved(claim, method="interval arithmetic", boxes=self.boxes)
        left = [
            ", ".join(
                f"{lower:.6g} <= {x.name} <= {upper:.6g}" for x, (lower, upper) in zip(self.unknowns, box, strict=True)
            )
            for box in self.unresolved[:3]
        ]
        return Verdict.undecided(claim, unresolved=left, unresolved_boxes=len(self.unresolved), boxes=self.boxes)


def zeros_in_box(
    equations: Sequence[sp.Expr],
    box: Mapping[sp.Symbol, tuple[float, float]],
    *,
    seconds: float = 5.0,
    most: int = _MAX_BOXES,
) -> BoxZeros:
    """Every zero of n equations in n unknowns with each unknown in its range, ends included.

    A box is thrown away where an equation has no zero in it, by its value or to first order; it is settled where
    Krawczyk's test shows that it holds exactly one zero. Double zeros and places where the equations have no value or
    jump are never settled: what is left of them is `unresolved`.

    Args:
        equations: without other symbols.
        box: (lower, upper) by unknown.
        seconds: s of work; most: boxes, after which what is left is unresolved.
    """
    unknowns = tuple(box)
    search = _Search.of(equations, unknowns)
    lower, upper = (np.array([float(box[x][side]) for x in unknowns]) for side in (0, 1))
    waiting, found, doubtful, seen = [(lower, upper)], [], [], 0
    end = worked() + seconds
    with ctx.workprec(_BITS):
        if not search.rigorous:
            doubtful, waiting = waiting, []
        while waiting and seen < most and worked() < end:
            here = waiting.pop()
            seen += 1
            judged = search.judged(*here)
            if judged is None:
                continue
            if isinstance(judged, arb_mat):
                found.append(judged)
                continue
            low, high = judged
            if ((high - low) <= _SMALLEST * np.maximum(1.0, np.abs(low) + np.abs(high))).all():
                doubtful.append((low, high))
                continue
            waiting += search.halves(low, high)
    points = _distinct(found, lower, upper)
    # A box that is left around a zero that is proved to be alone there is settled too.
    return BoxZeros(
        points=tuple(points),
        boxes=seen,
        unresolved=tuple(_sides(box) for box in (*waiting, *doubtful)),
        unknowns=unknowns,
    )


def nowhere_zero(expression: sp.Expr, box: Mapping[sp.Symbol, tuple[float, float]], *, most: int = 500) -> bool:
    """Whether it is proved that an expression in the unknowns of a box vanishes nowhere in it."""
    if not expression.free_symbols:
        return bool(expression.is_finite and expression.is_nonzero)
    signed = expression.replace(sp.exp, lambda *_: sp.Dummy(positive=True))  # wherever it has a value
    if signed.is_positive or signed.is_negative:
        return True
    if not expression.free_symbols <= box.keys():
        return False
    unknowns = tuple(x for x in box if expression.has(x))
    program = tape([expression])
    if not program.rigorous:
        return False
    waiting = [tuple(np.array([float(box[x][side]) for x in unknowns]) for side in (0, 1))]
    seen = 0
    with ctx.workprec(_BITS):
        while waiting and seen < most:
            low, high = waiting.pop()
            seen += 1
            value = program.at(dict(zip(unknowns, _balls(low, high), strict=True)))[0]
            if value.is_finite() and not value.contains(0):
                continue
            waiting += _cut(low, high, int(np.argmax((high - low) / (1 + np.abs(low) + np.abs(high)))))
    return not waiting


@dataclass(frozen=True, slots=True, kw_only=True)
class _Search:
    """Values and slopes of the equations, in balls."""

    unknowns: tuple[sp.Symbol, ...]
    program: Tape
    real: Tape
    """The equations where their roots are real: what has no zero there has none."""
    slopes: Tape
    rigorous: bool

    @classmethod
    def of(cls, equations: Sequence[sp.Expr], unknowns: tuple[sp.Symbol, ...]) -> _Search:
        entries = [_slope(e, x) for e in equations for x in unknowns]
        program, slopes = tape(list(equations)), tape(entries)
        real = tape([_where_real(e) for e in equations])
        rigorous = program.rigorous and slopes.rigorous and real.rigorous
        return cls(unknowns=unknowns, program=program, real=real, slopes=slopes, rigorous=rigorous)

    def values(self, point: Sequence[arb]) -> list[arb]:
        return self.program.at(dict(zip(self.unknowns, point, strict=True)))

    def matrix(self, point: Sequence[arb]) -> arb_mat:
        n = len(self.unknowns)
        return arb_mat(n, n, self.slopes.at(dict(zip(self.unknowns, point, strict=True))))

    def judged(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray] | arb_mat | None:
        """None: no zero here. A matrix of one column: the ball with the only zero. Else what is left of the box."""
        while True:
            wide = _WIDER * (high - low) + _LEAST * (1 + np.abs(low) + np.abs(high))
            box = _balls(low - wide, high + wide)
            here = self.real.at(dict(zip(self.unknowns, box, strict=True)))
            if any(value.is_finite() and not value.contains(0) for value in here):
                return None
            moved = self.moved(box)
            if moved is None:
                return low, high
            if all(box[i].contains_interior(moved[i, 0]) for i in range(len(box))):
                return self.refined(moved, box)
            new_low = np.array([max(a, float(moved[i, 0].lower())) for i, a in enumerate(low)])
            new_high = np.array([min(b, float(moved[i, 0].upper())) for i, b in enumerate(high)])
            # Rounding to doubles is outward enough: the box is widened before every test.
            if (new_low > new_high).any():
                grown = [_apart(moved[i, 0], a, b) for i, (a, b) in enumerate(zip(low, high, strict=True))]
                return None if any(grown) else (low, high)
            if (new_high - new_low).max(initial=0.0) >= 0.6 * (high - low).max(initial=0.0):
                return new_low, new_high
            low, high = new_low, new_high

    def moved(self, box: Sequence[arb]) -> arb_mat | None:
        """Krawczyk's image of a box; None where the slopes have no regular middle."""
        n = len(box)
        slope = self.matrix(box)
        numbers = np.array([[float(slope[i, j].mid()) for j in range(n)] for i in range(n)]).reshape(n, n)
        if not np.isfinite(numbers).all() or not all(slope[i, j].is_finite() for i in range(n) for j in range(n)):
            return None
        try:
            inverse = np.linalg.inv(numbers)
        except np.linalg.LinAlgError:
            return None
        if not np.isfinite(inverse).all():
            return None
        middle = [b.mid() for b in box]
        values = self.values(middle)
        if not all(v.is_finite() for v in values):
            return None
        near = arb_mat(n, n, [arb(float(v)) for v in inverse.ravel()])
        unit = arb_mat(n, n, [arb(int(i == j)) for i in range(n) for j in range(n)])
        around = arb_mat(n, 1, [b - c for b, c in zip(box, middle, strict=True)])
        return arb_mat(n, 1, middle) - near * arb_mat(n, 1, values) + (unit - near * slope) * around

    def refined(self, ball: arb_mat, box: Sequence[arb]) -> arb_mat:
        """A small ball around the only zero in a box, by Newton's method from the middle of one around it."""
        n = ball.nrows()
        with ctx.workprec(_FINE_BITS):
            place = [ball[i, 0].mid() for i in range(n)]
            for _ in range(_STEPS):
                slope = self.matrix(place)
                try:
                    step = slope.solve(arb_mat(n, 1, self.values(place)))
                except ZeroDivisionError:
                    return ball
                place = [(p - step[i, 0]).mid() for i, p in enumerate(place)]
                if not all(p.is_finite() for p in place):
                    return ball
            for radius in _RADII:
                small = [p + arb(0, radius) * (1 + abs(p)) for p in place]
                moved = self.moved(small)
                if moved is None or not all(b.contains(s) for b, s in zip(box, small, strict=True)):
                    continue
                if all(b.contains_interior(moved[i, 0]) for i, b in enumerate(small)):
                    return moved
        return ball

    def halves(self, low: np.ndarray, high: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """The box cut across the side over which the equations change most."""
        n, widths = len(low), high - low
        slope = self.matrix(_balls(low, high))
        sizes = np.array([[float(slope[i, j].abs_upper()) for j in range(n)] for i in range(n)]).reshape(n, n)
        change = (sizes * widths).max(axis=0) if np.isfinite(sizes).all() else np.full(n, np.nan)
        if not np.isfinite(change).all():
            change = widths / (1 + np.abs(low) + np.abs(high))
        change = np.where(widths > _SMALLEST * np.maximum(1.0, np.abs(low) + np.abs(high)), change, -1.0)
        return _cut(low, high, int(np.argmax(change)))


def _slope(equation: sp.Expr, unknown: sp.Symbol) -> sp.Expr:
    """The slope, NaN on a jump and where computer algebra has no formula for it (a floor)."""
    slope = equation.diff(unknown)
    if slope.has(sp.Derivative, sp.Subs):
        return sp.nan
    slope = slope.replace(sp.Heaviside, lambda a, *_: sp.Piecewise((0, a < 0), (1, a > 0)))
    return slope.replace(sp.DiracDelta, lambda a, *_: sp.Piecewise((sp.nan, sp.Eq(a, 0)), (0, True)))


def _where_real(equation: sp.Expr) -> sp.Expr:
    """The equation with every square root where it is real: the level of a tank begins at a root of 0."""
    return equation.replace(
        lambda e: e.is_Pow and e.exp.is_Rational and e.exp.q == 2, lambda e: RootWhereReal(e.base) ** e.exp.p
    )


def _balls(low: np.ndarray, high: np.ndarray) -> list[arb]:
    return [arb(float(a)).union(arb(float(b))) for a, b in zip(low, high, strict=True)]


def _apart(ball: arb, low: float, high: float) -> bool:
    return bool(ball < arb(low) or ball > arb(high))


def _cut(low: np.ndarray, high: np.ndarray, k: int) -> list[tuple[np.ndarray, np.ndarray]]:
    left, right = high.copy(), low.copy()
    left[k] = right[k] = low[k] + _CUT * (high[k] - low[k])
    return [(right, high), (low, left)]


def _distinct(found: Sequence[arb_mat], lower: np.ndarray, upper: np.ndarray) -> list[tuple[arb, ...]]:
    """Each zero once, those within the range."""
    kept: list[tuple[arb, ...]] = []
    for ball in found:
        point = tuple(ball[i, 0] for i in range(ball.nrows()))
        outside = any(_apart(x, float(a), float(b)) for x, a, b in zip(point, lower, upper, strict=True))
        if not outside and not any(all(x.overlaps(y) for x, y in zip(point, one, strict=True)) for one in kept):
            kept.append(point)
    return sorted(kept, key=lambda point: [float(x.mid()) for x in point])


def _number(ball: arb) -> sp.Expr:
    if ball.contains(0) and ball.rad() < 1e-15:
        return sp.Integer(0)
    with ctx.workprec(_FINE_BITS):
        return sp.Float(ball.mid().str(35, radius=False), 30)


def _sides(box: tuple[np.ndarray, np.ndarray]) -> tuple[tuple[float, float], ...]:
    return tuple((float(a), float(b)) for a, b in zip(*box, strict=True))
