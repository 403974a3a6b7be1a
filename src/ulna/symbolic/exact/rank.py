"""Generic and local rank of matrices of expressions, with a certain lower bound and a proof of the upper one if cheap.

Lower bound: elimination in ball arithmetic at random points; a pivot whose ball excludes 0 is a proof.
Upper bound: by size, or because every minor that borders the pivot minor vanishes exactly.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp
from flint import arb, ctx

from ulna.base import Verdict
from ulna.symbolic.exact.ball import tape
from ulna.symbolic.exact.embed import attempt_exactly
from ulna.symbolic.exact.minors import PolynomialRows, determinant, polynomial_rows, relation_with
from ulna.symbolic.exact.quotients import lowest_terms
from ulna.symbolic.exact.sample import SEED, Point, regular_points

_POINTS = 3
_DIGITS = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class Rank:
    """The rank of a matrix of expressions.

    Attributes:
        value: the rank; attained outside a set of measure zero when the verdict holds.
        verdict: on "the rank is `value`".
        point: where the rank was attained (empty for a constant matrix), None if nothing could be evaluated.
        rows: the rows of a minor that does not vanish at `point`.
        columns: its columns, the leftmost independent ones.
    """

    value: int
    verdict: Verdict
    point: Mapping[sp.Basic, sp.Expr] | None
    rows: tuple[int, ...]
    columns: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Pivots:
    rows: tuple[int, ...]
    columns: tuple[int, ...]


def generic_rank(
    matrix: sp.MatrixBase,
    *,
    seconds: float = 1.0,
    seed: int = SEED,
    near: Mapping[sp.Basic, sp.Expr] | None = None,
) -> Rank:
    """The rank at almost every value of all symbols in the matrix.

    Args:
        matrix: (m, n) of expressions.
        seconds: s, time for the proof of the upper bound; 0 leaves it out.
        seed: of the random points.
        near: values near which to evaluate, for matrices defined only there.
    """
    best: tuple[Point, _Pivots] | None = None
    program = tape(list(matrix))
    sizes: dict[sp.Basic, int] = {}
    cost = [sum(_size(entry, sizes) for entry in matrix.row(i)) for i in range(matrix.rows)]
    for point, values in regular_points(program, _POINTS, seed=seed, digits=_DIGITS, near=near):
        pivots = _pivots(values, matrix.shape, cost)
        if best is None or len(pivots.rows) > len(best[1].rows):
            best = point, pivots
        if len(pivots.rows) == min(matrix.shape):
            break
    if best is None:
        claim = "the rank is known"
        return Rank(value=0, verdict=_not_evaluated(claim), point=None, rows=(), columns=())
    point, pivots = best
    value = len(pivots.rows)
    verdict = _upper_bound(matrix, pivots, seconds=seconds, point=point)
    return Rank(value=value, verdict=verdict, point=point, rows=pivots.rows, columns=pivots.columns)


def rank_at(
    matrix: sp.MatrixBase, point: Mapping[sp.Symbol, sp.Expr], *, seconds: float = 1.0, seed: int = SEED
) -> Rank:
    """The rank at a point; symbols to which the point gives no value stay generic.

    The values are put in exactly. An entry that is not finite there is first brought to lowest terms; if it still is
    not finite, the verdict is undecided and names the entry.
    """
    local = sp.zeros(*matrix.shape)
    values = {symbol: sp.sympify(value) for symbol, value in point.items()}
    for i in range(matrix.rows):
        for j in range(matrix.cols):
            entry = value_at(matrix[i, j], values)
            if entry is None:
                verdict = Verdict.undecided("the rank is known", entry=(i, j), found=f"{matrix[i, j]} is not finite")
                return Rank(value=0, verdict=verdict, point=dict(values), rows=(), columns=())
            local[i, j] = entry
    rank = generic_rank(local, seconds=seconds, seed=seed)
    where = None if rank.point is None else {**values, **rank.point}
    return Rank(value=rank.value, verdict=rank.verdict, point=where, rows=rank.rows, columns=rank.columns)


def rank_of_balls(rows: Sequence[Sequence[arb]], *, point: Point) -> Rank:
    """The rank of a matrix of numbers known as balls, every row on its own scale.

    Certain from below. Proved if the rest is exactly zero, supported if it is zero to half of the working digits;
    undecided, and only a lower bound, if the balls are too wide to tell.

    Args:
        rows: (m, n); a NaN ball makes the verdict undecided.
        point: where the numbers were taken, for the record.
    """
    claim = "the rank is known"
    if any(not value.is_finite() for row in rows for value in row):
        return Rank(value=0, verdict=_not_evaluated(claim), point=None, rows=(), columns=())
    height, width = len(rows), len(rows[0]) if rows else 0
    sizes = [max((value.abs_upper() for value in row), default=arb(0)) for row in rows]
    left = [[value / size for value in row] if size > 0 else list(row) for row, size in zip(rows, sizes, strict=True)]
    pivots = _eliminated(left, [0] * height, width)
    value = len(pivots.rows)
    claim = f"the rank is {value}"
    evidence = {"point": point, "rows": pivots.rows, "columns": pivots.columns}
    rest = [left[i][j] for i in range(height) if i not in pivots.rows for j in range(width) if j not in pivots.columns]
    small = arb(2) ** (-(ctx.prec // 2))
    if value == min(height, width) or all(entry.is_zero() for entry in rest):
        verdict = Verdict.proved(claim, **evidence)
    elif all(entry.abs_upper() < small for entry in rest):
        verdict = Verdict.supported(claim, **evidence, points=1)
    else:
        verdict = Verdict.undecided(claim, **evidence, tried=f"{ctx.prec} binary digits: the rest may be zero or not")
    return Rank(value=value, verdict=verdict, point=point, rows=pivots.rows, columns=pivots.columns)


def rank_of_numbers(matrix: np.ndarray, *, tolerance: float = 1e-8) -> int:
    """The rank of floats (m, n), every column scaled to length one; shorter than the tolerance counts as zero."""
    lengths = np.linalg.norm(matrix, axis=0)
    kept = matrix[:, lengths > tolerance] / lengths[lengths > tolerance]
    return int(np.linalg.matrix_rank(kept, tol=tolerance)) if kept.size else 0


def value_at(expression: sp.Expr, point: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr | None:
    """The exact value, in lowest terms where 0/0 turns up; None if it is not finite."""
    value = sp.sympify(expression).xreplace(dict(point))
    if not value.has(sp.nan, sp.zoo, sp.oo, -sp.oo):
        return value
    value = lowest_terms(sp.sympify(expression), seconds=0.5).xreplace(dict(point))
    return None if value.has(sp.nan, sp.zoo, sp.oo, -sp.oo) else value


def minor_determinant(matrix: sp.MatrixBase, rank: Rank, *, seconds: float = 1.0) -> sp.Expr:
    """The determinant of the pivot minor; the rank can drop only where it vanishes.

    In irreducible factors over sines, exponentials, ... if the time suffices, else SymPy's determinant as it comes.
    """
    minor = matrix.extract(sorted(rank.rows), list(rank.columns))
    exact = attempt_exactly(seconds, "minor", _exact_determinant, minor)
    return exact.value if exact.value is not None else minor.det(method="berkowitz")


def _exact_determinant(matrix: sp.MatrixBase) -> sp.Expr:
    exact = polynomial_rows(matrix)
    ring = exact.ring
    value = ring.make(determinant(ring, exact.rows, range(matrix.cols)), ring.one)
    for scale in exact.scales:
        value = ring.multiply(value, scale)
    return ring.factored(value) if not value[0].is_zero() else sp.S.Zero


def _not_evaluated(claim: str) -> Verdict:
    return Verdict.undecided(claim, tried="no random point where every entry is real and finite")


def _size(expression: sp.Basic, known: dict[sp.Basic, int]) -> int:
    """The number of nodes; every distinct node is visited once, so that large matrices cost little."""
    size = known.get(expression)
    if size is None:
        size = known[expression] = 1 + sum(_size(part, known) for part in expression.args)
    return size


def _pivots(values: Sequence[arb], shape: tuple[int, int], cost: Sequence[int]) -> _Pivots:
    height, width = shape
    return _eliminated([list(values[i * width : (i + 1) * width]) for i in range(height)], cost, width)


def _eliminated(rows: list[list[arb]], cost: Sequence[int], width: int) -> _Pivots:
    """Elimination in place, column by column; among usable rows the cheapest one is the pivot, for short minors."""
    left = sorted(range(len(rows)), key=lambda i: (cost[i], i))
    chosen_rows: list[int] = []
    chosen_columns: list[int] = []
    for column in range(width):
        usable = [i for i in left if not rows[i][column].contains(0)]
        if not usable:
            continue
        largest = max(abs(rows[i][column]).mid() for i in usable)
        pivot = next(i for i in usable if abs(rows[i][column]).mid() * 10**6 >= largest)
        left.remove(pivot)
        chosen_rows.append(pivot)
        chosen_columns.append(column)
        for i in left:
            factor = rows[i][column] / rows[pivot][column]
            rows[i] = [rows[i][j] - factor * rows[pivot][j] for j in range(width)]
    return _Pivots(rows=tuple(chosen_rows), columns=tuple(chosen_columns))


def _upper_bound(matrix: sp.MatrixBase, pivots: _Pivots, *, seconds: float, point: Point) -> Verdict:
    value = len(pivots.rows)
    claim = f"the rank is {value}"
    evidence = {"point": point, "rows": pivots.rows, "columns": pivots.columns}
    if value == min(matrix.shape):
        return Verdict.proved(claim, **evidence)
    if seconds <= 0:
        return Verdict.supported(claim, **evidence, points=_POINTS)
    proof = attempt_exactly(seconds, "bordering minors", _bordering_minors_vanish, matrix, pivots)
    if proof.value:
        return Verdict.proved(claim, method="bordering minors", **evidence)
    reason = proof.reason or "the bordering minors do not vanish by the known relations"
    return Verdict.supported(claim, **evidence, points=_POINTS, no_proof=reason)


def _bordering_minors_vanish(matrix: sp.MatrixBase, pivots: _Pivots) -> bool:
    """True only if every minor with one more row and column is zero: then the rank is that of the pivot minor."""
    exact = polynomial_rows(matrix)
    return all(
        extends_exactly(exact, pivots.rows, pivots.columns, column)
        for column in range(matrix.cols)
        if column not in pivots.columns
    )


def extends_exactly(exact: PolynomialRows, rows: Sequence[int], columns: Sequence[int], extra: int) -> bool:
    """True only if column `extra` is a combination of `columns`, given that the minor (rows, columns) is not zero."""
    ring = exact.ring
    numerators, denominator = relation_with(ring, [exact.rows[i] for i in rows], columns, extra)
    for i, row in enumerate(exact.rows):
        if i in rows:
            continue
        total = -ring.times(row[extra], denominator)
        for numerator, column in zip(numerators, columns, strict=True):
            total += ring.times(row[column], numerator)
        if not ring.reduced(total).is_zero():
            return False
    return True
