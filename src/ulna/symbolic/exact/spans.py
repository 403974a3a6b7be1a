"""Spans of rows and columns of functions: membership, null space, reduction; generic in coordinates and parameters."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from math import comb

from sympy import Abs, Add, Expr, ImmutableDenseMatrix, Integer, sign
from sympy.matrices import MatrixBase

from ulna.base import Verdict, all_of
from ulna.symbolic.exact.angles import with_plain_angles
from ulna.symbolic.exact.embed import attempt_exactly
from ulna.symbolic.exact.field import Field, Polynomial
from ulna.symbolic.exact.minors import PolynomialRows, maximal_minors, polynomial_rows
from ulna.symbolic.exact.quotients import normal
from ulna.symbolic.exact.rank import generic_rank
from ulna.symbolic.exact.zero import vanishes

_SECONDS = 3.0
_MANY_MINORS = 200

Minors = Mapping[frozenset[int], Polynomial]
"""Determinants by their columns."""


def in_span(vector: MatrixBase, columns: MatrixBase, *, seconds: float = 1.0) -> Verdict:
    """Whether the vector (n, 1) is a combination of the columns (n, k) with functions as coefficients.

    That is on an open dense set. The evidence holds both ranks and the point where the larger one was found.
    """
    claim = "the vector lies in the span of the columns"
    before = generic_rank(columns, seconds=seconds)
    after = generic_rank(ImmutableDenseMatrix(columns).row_join(ImmutableDenseMatrix(vector)), seconds=seconds)
    evidence = {"rank_before": before.value, "rank_after": after.value, "point": after.point}
    if after.value > before.value:
        if before.value == columns.cols or before.verdict.holds:
            return Verdict.refuted(claim, **evidence)
        return Verdict.undecided(claim, **evidence)
    return all_of(claim, [after.verdict], **evidence)


def without_common_factor(expressions: Sequence[Expr]) -> tuple[Expr, ...]:
    """Multiples of the expressions by one common function: no denominators and no common factor left.

    The entries come in irreducible factors. What cannot be brought to polynomials is divided by its simplest entry.
    """
    found = attempt_exactly(_SECONDS, "common factor", _primitive_row, expressions)
    if found.value is not None and _plain(found.value):
        return found.value
    entries = [e for e in expressions if not vanishes(e)]
    divisor = min(entries, key=lambda e: e.count_ops(), default=Integer(1))
    return tuple(Integer(0) if vanishes(e) else normal(e / divisor) for e in expressions)


def null_space(matrix: MatrixBase, *, pivots: Collection[int] = ()) -> tuple[ImmutableDenseMatrix, ...]:
    """Columns that span {v : matrix v = 0} on an open dense set, without common factors.

    Cramer's rule with a minor of full rank: on the columns `pivots` if they are given and independent, else the
    simplest one. Each result has one nonzero entry outside the pivots, with a positive leading coefficient. If the
    exact algebra gives up, the same rule without any simplification.
    """
    rank = generic_rank(matrix, seconds=0)
    if rank.point is not None and not rank.value:
        return tuple(ImmutableDenseMatrix.eye(matrix.cols)[:, j] for j in range(matrix.cols))
    rows = sorted(rank.rows) or list(range(matrix.rows))
    chosen = ImmutableDenseMatrix(matrix).extract(rows, list(range(matrix.cols)))
    found = attempt_exactly(_SECONDS, "minors", _by_minors, chosen, frozenset(pivots), frozenset(rank.columns))
    if found.value is not None and all(_plain(list(v)) for v in found.value):
        return found.value
    return _as_written(chosen, frozenset(rank.columns))


def _by_minors(
    matrix: MatrixBase, wanted: frozenset[int], leftmost: frozenset[int]
) -> tuple[ImmutableDenseMatrix, ...]:
    data, meaning = _polynomials(matrix)
    ring, n = data.ring, matrix.cols
    if comb(n, matrix.rows) <= _MANY_MINORS:
        minors = maximal_minors(ring, data.rows, range(n))
        nonzero = {key for key, minor in minors.items() if not minor.is_zero()}
        pivots = wanted if wanted in nonzero else _simplest(minors)
    else:
        pivots = leftmost
        minors = {}
        for free in set(range(n)) - pivots:
            minors |= maximal_minors(ring, data.rows, sorted(pivots | {free}))
    columns = []
    for free in sorted(set(range(n)) - pivots):
        entries = [ring.none] * n
        for column, negative, others in _alternating(pivots | {free}):
            minor = minors.get(others, ring.none)
            entries[column] = -minor if negative else minor
        if int(entries[free].leading_coefficient()) < 0:
            entries = [-entry for entry in entries]
        columns.append(ImmutableDenseMatrix(n, 1, [e.xreplace(meaning) for e in _primitive(ring, entries)]))
    return tuple(columns)


def _as_written(matrix: MatrixBase, pivots: frozenset[int]) -> tuple[ImmutableDenseMatrix, ...]:
    """Cramer's rule on independent columns without any simplification: always quick, seldom short."""
    n = matrix.cols
    rows = [list(matrix.row(i)) for i in range(matrix.rows)]
    columns = []
    for free in sorted(set(range(n)) - pivots):
        entries: list[Expr] = [Integer(0)] * n
        for column, negative, others in _alternating(pivots | {free}):
            minor = _determinant(rows, sorted(others))
            entries[column] = -minor if negative else minor
        columns.append(ImmutableDenseMatrix(n, 1, entries))
    return tuple(columns)


def _alternating(columns: frozenset[int]) -> list[tuple[int, bool, frozenset[int]]]:
    """Each column with the sign of the minor that leaves it out, and the columns of this minor."""
    return [(column, position % 2 == 1, columns - {column}) for position, column in enumerate(sorted(columns))]


def _determinant(rows: Sequence[Sequence[Expr]], columns: Sequence[int]) -> Expr:
    """Laplace expansion without a single simplification, along the first row."""
    if not rows:
        return Integer(1)
    terms = []
    for position, column in enumerate(columns):
        if rows[0][column] != 0:
            smaller = _determinant(rows[1:], [c for c in columns if c != column])
            terms.append((-1) ** position * rows[0][column] * smaller)
    return Add(*terms)


def reduced_against(row: Sequence[Expr], rows: MatrixBase) -> tuple[Expr, ...] | None:
    """A multiple of the row plus a combination of independent rows, zero at as many columns as there are rows.

    The span with the rows stays the same on an open dense set. The columns are those of the simplest minor of the
    rows; common factors go. All zero if the row is a combination of the rows; None if the exact algebra gives up.
    """
    stacked = ImmutableDenseMatrix([*(list(rows.row(i)) for i in range(rows.rows)), list(row)])
    found = attempt_exactly(_SECONDS, "reduction", _reduced_last_row, stacked)
    return found.value if found.value is not None and _plain(found.value) else None


def _reduced_last_row(matrix: MatrixBase) -> tuple[Expr, ...]:
    data, meaning = _polynomials(matrix)
    ring, n = data.ring, matrix.cols
    pivots = _simplest(maximal_minors(ring, data.rows[:-1], range(n)))
    minors = maximal_minors(ring, data.rows, range(n))
    entries = [ring.none] * n
    for column in sorted(set(range(n)) - pivots):
        minor = minors.get(pivots | {column}, ring.none)
        larger = sum(1 for pivot in pivots if pivot > column)
        entries[column] = -minor if larger % 2 else minor
    return tuple(e.xreplace(meaning) for e in _primitive(ring, entries))


def _simplest(minors: Minors) -> frozenset[int]:
    """The columns of the shortest minor that is not zero."""
    nonzero = [key for key, minor in minors.items() if not minor.is_zero()]
    return min(nonzero, key=lambda key: (len(minors[key]), minors[key].total_degree(), sorted(key)))


def _polynomials(matrix: MatrixBase) -> tuple[PolynomialRows, dict[Expr, Expr]]:
    """The matrix over one field with angles kept as they are written, and what the symbols for angles stand for."""
    plain, meaning = with_plain_angles(list(matrix))
    return polynomial_rows(ImmutableDenseMatrix(*matrix.shape, plain).as_mutable()), meaning


def _primitive_row(expressions: Sequence[Expr]) -> tuple[Expr, ...]:
    data, meaning = _polynomials(ImmutableDenseMatrix([list(expressions)]))
    return tuple(e.xreplace(meaning) for e in _primitive(data.ring, list(data.rows[0])))


def _primitive(ring: Field, polynomials: Sequence[Polynomial]) -> tuple[Expr, ...]:
    """The polynomials without common factors, in irreducible factors."""
    nonzero = [k for k, p in enumerate(polynomials) if not p.is_zero()]
    kept = ring.coprime(ring.without_common_roots([polynomials[k] for k in nonzero]))
    values = {k: ring.factored((p, ring.one)) for k, p in zip(nonzero, kept, strict=True)}
    return tuple(values.get(k, Integer(0)) for k in range(len(polynomials)))


def _plain(entries: Sequence[Expr]) -> bool:
    """Whether no sign function came in that was not there before: it reads worse than the root it came from."""
    return not any(e.has(sign, Abs) for e in entries)
