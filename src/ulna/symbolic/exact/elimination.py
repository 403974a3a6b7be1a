"""Normal forms, common factors, row reduction and null spaces of functions, generic in coordinates and parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from sympy import Abs, Add, Expr, ImmutableDenseMatrix, Integer, Pow, cancel, log, sign, together
from sympy.functions.elementary.hyperbolic import InverseHyperbolicFunction
from sympy.functions.elementary.trigonometric import InverseTrigonometricFunction
from sympy.matrices import MatrixBase

from ulna.symbolic.exact.angles import with_plain_angles
from ulna.symbolic.exact.budget import attempt
from ulna.symbolic.exact.embed import attempt_exactly, embed
from ulna.symbolic.exact.field import Field, Polynomial
from ulna.symbolic.exact.finite_field import FieldSample
from ulna.symbolic.exact.minors import maximal_minors, polynomial_rows
from ulna.symbolic.exact.residues import null_space as residue_null_space
from ulna.symbolic.exact.zero import SampledZero

_SECONDS = 3.0
_SECONDS_PER_ENTRY = 0.5
_POINTS = 8
_MANY_MINORS = 200


@dataclass(frozen=True, slots=True, kw_only=True)
class RowReduction:
    """Independent rows with the same span, reduced: row i is 1 at column `pivots[i]`, the other rows 0 there.

    Args:
        rows: shape (rank, columns).
        pivots: the pivot column of each row.
    """

    rows: ImmutableDenseMatrix
    pivots: tuple[int, ...]


def vanishes(expression: Expr) -> bool:
    """Whether the expression is zero at random points: a fast filter, no proof either way.

    The points are those of a finite field, which does not know that √u √v = √(uv) for positive u and v; so with roots
    or inverse functions a nonzero value there is doubted, and the real numbers are asked.
    """
    if expression.is_Rational:
        return expression == 0
    sample = FieldSample(4 * _POINTS)
    values = sample(expression)
    if sample.valid.any() and not np.any(values[sample.valid]):
        return True
    return _has_hidden_relations(expression) and SampledZero(points=4, seconds=0)(expression).holds


def _has_hidden_relations(expression: Expr) -> bool:
    if expression.has(log, Abs, InverseTrigonometricFunction, InverseHyperbolicFunction):
        return True
    return any(not node.exp.is_Integer for node in expression.atoms(Pow))


def normal(expression: Expr) -> Expr:
    """The expression as one fraction in lowest terms and irreducible factors, where that is found quickly."""
    if expression.is_Atom:
        return expression
    exact = attempt_exactly(_SECONDS_PER_ENTRY, "normal form", _normal_form, expression)
    if exact.value is not None and not exact.value.has(sign, Abs):
        return exact.value
    for what, function in (("cancel", cancel), ("together", together)):
        found = attempt(_SECONDS_PER_ENTRY, what, function, expression)
        if found.value is not None:
            return found.value
    return expression


def _normal_form(expression: Expr) -> Expr:
    [plain], meaning = with_plain_angles([expression])
    ring, [element] = embed([plain])
    return ring.factored(ring.make(*element)).xreplace(meaning)


def without_common_factor(expressions: Sequence[Expr]) -> tuple[Expr, ...]:
    """Multiples of the expressions by one common function: no denominators and no common factor left.

    The entries come in irreducible factors. What cannot be brought to polynomials is divided by its simplest entry.
    """
    found = attempt_exactly(_SECONDS, "common factor", _primitive_row, expressions)
    if found.value is not None and not any(e.has(sign, Abs) for e in found.value):
        return found.value
    entries = [e for e in expressions if not vanishes(e)]
    divisor = min(entries, key=lambda e: e.count_ops(), default=Integer(1))
    return tuple(Integer(0) if vanishes(e) else normal(e / divisor) for e in expressions)


def _primitive_row(expressions: Sequence[Expr]) -> tuple[Expr, ...]:
    plain, meaning = with_plain_angles(expressions)
    rows = polynomial_rows(ImmutableDenseMatrix([list(plain)]).as_mutable())
    return tuple(e.xreplace(meaning) for e in _primitive(rows.ring, list(rows.rows[0])))


def _primitive(ring: Field, polynomials: list[Polynomial]) -> tuple[Expr, ...]:
    nonzero = [k for k, p in enumerate(polynomials) if not p.is_zero()]
    kept = ring.coprime(ring.without_common_roots([polynomials[k] for k in nonzero]))
    values = {k: ring.factored((p, ring.one)) for k, p in zip(nonzero, kept, strict=True)}
    return tuple(values.get(k, Integer(0)) for k in range(len(polynomials)))


def null_space(matrix: MatrixBase, *, pivots: Sequence[int] = ()) -> tuple[ImmutableDenseMatrix, ...]:
    """Columns that span {v : matrix v = 0} on an open dense set, without common factors.

    Cramer's rule with a minor of full rank: on the columns `pivots` if they are given and independent, else the
    simplest one. Each result has one nonzero entry outside the pivots. If the exact algebra gives up, elimination
    with pivots of its own.
    """
    rows = _independent_rows(matrix)
    if not rows:
        return tuple(ImmutableDenseMatrix.eye(matrix.cols)[:, j] for j in range(matrix.cols))
    chosen = ImmutableDenseMatrix(matrix).extract(list(rows), list(range(matrix.cols)))
    if len(list(combinations(range(matrix.cols), len(rows)))) <= _MANY_MINORS:
        found = attempt_exactly(_SECONDS, "minors", _null_space_by_minors, chosen, frozenset(pivots))
        if found.value is not None and not any(v.has(sign, Abs) for v in found.value):
            return found.value
    reduced = attempt(_SECONDS, "elimination", _null_space_by_elimination, chosen)
    return reduced.value if reduced.value is not None else _null_space_as_written(chosen)


def _null_space_by_minors(matrix: MatrixBase, wanted: frozenset[int]) -> tuple[ImmutableDenseMatrix, ...]:
    plain, meaning = with_plain_angles(list(matrix))
    data = polynomial_rows(ImmutableDenseMatrix(*matrix.shape, plain).as_mutable())
    ring, n = data.ring, matrix.cols
    minors = maximal_minors(ring, data.rows, range(n))
    nonzero = {key: minor for key, minor in minors.items() if not minor.is_zero()}
    simplest = min(nonzero, key=lambda key: (len(nonzero[key]), nonzero[key].total_degree(), sorted(key)))
    pivots = wanted if wanted in nonzero else simplest
    columns = []
    for free in sorted(set(range(n)) - pivots):
        entries = [ring.none] * n
        # Among the columns of the pivot minor and the free one: alternating minors, each leaving one column out.
        for position, column in enumerate(sorted(pivots | {free})):
            minor = minors.get((pivots | {free}) - {column}, ring.none)
            entries[column] = -minor if position % 2 else minor
        columns.append(ImmutableDenseMatrix(n, 1, [e.xreplace(meaning) for e in _primitive(ring, entries)]))
    return tuple(columns)


def reduced_against(row: Sequence[Expr], rows: MatrixBase) -> tuple[Expr, ...] | None:
    """A multiple of the row plus a combination of independent rows, zero at as many columns as there are rows.

    The span with the rows stays the same on an open dense set. The columns are those of the simplest minor of the
    rows; common factors go. All zero if the row is a combination of the rows; None if the exact algebra gives up.
    """
    stacked = ImmutableDenseMatrix([*(list(rows.row(i)) for i in range(rows.rows)), list(row)])
    found = attempt_exactly(_SECONDS, "reduction", _reduced_last_row, stacked)
    if found.value is None or any(e.has(sign, Abs) for e in found.value):
        return None
    return found.value


def _reduced_last_row(matrix: MatrixBase) -> tuple[Expr, ...]:
    plain, meaning = with_plain_angles(list(matrix))
    data = polynomial_rows(ImmutableDenseMatrix(*matrix.shape, plain).as_mutable())
    ring, n = data.ring, matrix.cols
    former = maximal_minors(ring, data.rows[:-1], range(n))
    nonzero = {key: minor for key, minor in former.items() if not minor.is_zero()}
    pivots = min(nonzero, key=lambda key: (len(nonzero[key]), nonzero[key].total_degree(), sorted(key)))
    minors = maximal_minors(ring, data.rows, range(n))
    entries = [ring.none] * n
    for column in sorted(set(range(n)) - pivots):
        minor = minors.get(pivots | {column}, ring.none)
        larger = sum(1 for pivot in pivots if pivot > column)
        entries[column] = -minor if larger % 2 else minor
    return tuple(e.xreplace(meaning) for e in _primitive(ring, entries))


def _independent_rows(matrix: MatrixBase) -> tuple[int, ...]:
    """Rows that span all rows at a random point of a finite field."""
    sample = FieldSample(4 * _POINTS)
    values = np.array([sample.table(list(matrix.row(i))) for i in range(matrix.rows)])
    good = np.nonzero(sample.valid)[0]
    if good.size == 0 or matrix.rows == 0:
        return tuple(range(matrix.rows))
    dependent = {max(v) for v in residue_null_space(values[:, :, good[0]].T)}
    return tuple(i for i in range(matrix.rows) if i not in dependent)


def _null_space_by_elimination(matrix: MatrixBase) -> tuple[ImmutableDenseMatrix, ...]:
    reduction = row_reduce(matrix)
    n = matrix.cols
    columns = []
    for free in sorted(set(range(n)) - set(reduction.pivots)):
        entries: list[Expr] = [Integer(0)] * n
        entries[free] = Integer(1)
        for i, pivot in enumerate(reduction.pivots):
            entries[pivot] = -reduction.rows[i, free]
        columns.append(ImmutableDenseMatrix(n, 1, entries))
    return tuple(columns)


def _null_space_as_written(matrix: MatrixBase) -> tuple[ImmutableDenseMatrix, ...]:
    """Cramer's rule on independent columns without any simplification: always quick, seldom short."""
    n = matrix.cols
    pivots = _independent_rows(matrix.T)
    columns = []
    for free in sorted(set(range(n)) - set(pivots)):
        entries: list[Expr] = [Integer(0)] * n
        shared = sorted({*pivots, free})
        for position, column in enumerate(shared):
            minor = _determinant([list(matrix.row(i)) for i in range(matrix.rows)], [c for c in shared if c != column])
            entries[column] = -minor if position % 2 else minor
        columns.append(ImmutableDenseMatrix(n, 1, entries))
    return tuple(columns)


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


def row_reduce(matrix: MatrixBase) -> RowReduction:
    """Gauss–Jordan elimination; pivots are nonzero functions, constants and short ones first."""
    rows = [[normal(e) for e in matrix.row(i)] for i in range(matrix.rows)]
    rows = [[Integer(0) if vanishes(e) else e for e in row] for row in rows]
    done: list[tuple[int, list[Expr]]] = []
    while True:
        candidates = [
            (not e.is_number, e.count_ops(), sum(f != 0 for f in row), j, i)
            for i, row in enumerate(rows)
            for j, e in enumerate(row)
            if e != 0
        ]
        if not candidates:
            break
        *_, column, index = min(candidates)
        pivot = rows.pop(index)
        pivot = [normal(e / pivot[column]) for e in pivot]
        rows = [_eliminated(row, pivot, column) for row in rows]
        done = [(c, _eliminated(row, pivot, column)) for c, row in done]
        done.append((column, pivot))
    done.sort(key=lambda item: item[0])
    flat = [e for _, row in done for e in row]
    return RowReduction(
        rows=ImmutableDenseMatrix(len(done), matrix.cols, flat), pivots=tuple(column for column, _ in done)
    )


def _eliminated(row: Sequence[Expr], pivot: Sequence[Expr], column: int) -> list[Expr]:
    factor = row[column]
    if factor == 0:
        return list(row)
    result = []
    for own, other in zip(row, pivot, strict=True):
        if other == 0:
            result.append(own)
            continue
        value = own - factor * other
        result.append(Integer(0) if vanishes(value) else normal(value))
    result[column] = Integer(0)
    return result
