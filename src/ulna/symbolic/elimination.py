"""Row reduction and null spaces of matrices of functions, generic in coordinates and parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sympy import Abs, Expr, ImmutableDenseMatrix, Integer, Pow, cancel, log, together
from sympy.functions.elementary.hyperbolic import InverseHyperbolicFunction
from sympy.functions.elementary.trigonometric import InverseTrigonometricFunction
from sympy.matrices import MatrixBase

from ulna.symbolic.budget import attempt
from ulna.symbolic.finite_field import FieldSample
from ulna.symbolic.zero import SampledZero

_SECONDS_PER_ENTRY = 0.3
_POINTS = 8


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
    """The expression as one reduced fraction where that is found quickly, else over a common denominator."""
    if expression.is_Atom:
        return expression
    reduced = attempt(_SECONDS_PER_ENTRY, "cancel", cancel, expression)
    if reduced.value is not None:
        return reduced.value
    joined = attempt(_SECONDS_PER_ENTRY, "together", together, expression)
    return joined.value if joined.value is not None else expression


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


def null_space(matrix: MatrixBase) -> tuple[ImmutableDenseMatrix, ...]:
    """Columns that span {v : matrix v = 0} on an open dense set; one per column without pivot, where it is 1."""
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
