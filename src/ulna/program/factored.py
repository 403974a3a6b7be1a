"""A matrix of program values prepared once: every further right-hand side costs a pass or two.

No program chooses pivots while it runs, so a pivot that vanishes somewhere is a hole in its domain. A definite matrix
needs no choice; a small one is solved by minors and divides by its determinant only; a larger one takes the pivots
that are largest at a sample (Golub and Van Loan, Matrix Computations, 4th ed., sections 3.4 and 4.1).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Sequence

import numpy as np

from ulna.base import UlnaError
from ulna.program.terms import ONE, Term, Terms, negative

Entry = Term | None
"""A multiple of a value, None for a structural zero."""

SMALL = 4
"""Size up to which a matrix that is not definite is solved by minors."""
_SYMMETRIC = 1e-12
_SINGULAR = 1e-9


class AbstractFactored(ABC):
    """A square matrix ready for right-hand sides."""

    @abstractmethod
    def solved(self, sides: Sequence[Entry]) -> list[Entry]:
        """The (m,) solution x of A x = b for (m,) sides b."""


def factored(terms: Terms, rows: Sequence[Sequence[Entry]], samples: np.ndarray) -> AbstractFactored:
    """The matrix, prepared in the way that its size and its samples allow.

    Args:
        terms: writes what has to be computed.
        rows: (m, m) entries.
        samples: (points, m, m) values of the matrix, the first at a generic point.

    Raises:
        UlnaError: if the matrix is singular at the first sample.
    """
    m = len(rows)
    scale = float(np.abs(samples[0]).max(initial=0.0)) or 1.0
    if np.linalg.matrix_rank(samples[0], tol=_SINGULAR * scale) < m:
        raise UlnaError("a linear system in a program", "its matrix is singular at a random point.")
    common = _most_frequent([abs(e[1]) for row in rows for e in row if e is not None and e[0] is not None])
    entries = [[_over_common(terms, entry, common) for entry in row] for row in rows]
    if _definite(samples):
        return _Definite(terms, entries)
    return _Minors(terms, entries) if m <= SMALL else _Eliminated(terms, entries, samples[0])


class _Definite(AbstractFactored):
    """L D Lᵀ, from the lower triangle."""

    def __init__(self, terms: Terms, rows: Sequence[Sequence[Entry]]) -> None:
        self._terms = terms
        m = len(rows)
        matrix = [list(row) for row in rows]
        self._below: list[list[tuple[int, Term]]] = []
        for k in range(m):
            factors: list[tuple[int, Term]] = []
            for i in range(k + 1, m):
                factor = _over(terms, matrix[i][k], matrix[k][k])
                if factor is not None:
                    factors.append((i, factor))
            for i, factor in factors:
                for j in range(k + 1, i + 1):
                    matrix[i][j] = terms.less(matrix[i][j], terms.times(factor, matrix[j][k]))
            self._below.append(factors)
        self._diagonal = [matrix[k][k] for k in range(m)]

    def solved(self, sides: Sequence[Entry]) -> list[Entry]:
        terms, solution = self._terms, list(sides)
        for k, factors in enumerate(self._below):
            for i, factor in factors:
                solution[i] = terms.less(solution[i], terms.times(factor, solution[k]))
        for k in reversed(range(len(solution))):
            solution[k] = _over(terms, solution[k], self._diagonal[k])
            for i, factor in self._below[k]:
                solution[k] = terms.less(solution[k], terms.times(factor, solution[i]))
        return solution


class _Minors(AbstractFactored):
    """Cofactors over the determinant."""

    def __init__(self, terms: Terms, rows: Sequence[Sequence[Entry]]) -> None:
        self._terms = terms
        self._rows = rows
        self._known: dict[tuple[tuple[int, ...], tuple[int, ...]], Entry] = {}
        places = tuple(range(len(rows)))
        self._cofactors = [[self._cofactor(places, i, j) for i in places] for j in places]
        self._determinant = self._minor(places, places)

    def solved(self, sides: Sequence[Entry]) -> list[Entry]:
        terms = self._terms
        solution: list[Entry] = []
        for row in self._cofactors:
            total: Entry = None
            for cofactor, side in zip(row, sides, strict=True):
                total = _plus(terms, total, terms.times(cofactor, side))
            solution.append(_over(terms, total, self._determinant))
        return solution

    def _cofactor(self, places: tuple[int, ...], row: int, column: int) -> Entry:
        rows, columns = tuple(k for k in places if k != row), tuple(k for k in places if k != column)
        minor = self._minor(rows, columns)
        return negative(minor) if minor is not None and (row + column) % 2 else minor

    def _minor(self, rows: tuple[int, ...], columns: tuple[int, ...]) -> Entry:
        """The determinant of some rows and columns, along the first row."""
        if not rows:
            return ONE
        if (rows, columns) in self._known:
            return self._known[rows, columns]
        total: Entry = None
        for position, column in enumerate(columns):
            entry = self._rows[rows[0]][column]
            if entry is None:
                continue
            rest = self._minor(rows[1:], (*columns[:position], *columns[position + 1 :]))
            product = self._terms.times(entry, rest)
            total = self._terms.less(total, product) if position % 2 else _plus(self._terms, total, product)
        self._known[rows, columns] = total
        return total


class _Eliminated(AbstractFactored):
    """L U, the sparsest row first and in it the entry that is largest at the sample."""

    def __init__(self, terms: Terms, rows: Sequence[Sequence[Entry]], sample: np.ndarray) -> None:
        self._terms = terms
        self._rows = [list(row) for row in rows]
        self._sample = np.array(sample, dtype=float)
        self._order: list[tuple[int, int]] = []
        self._below: list[dict[int, Term]] = []
        free_rows, free_columns = set(range(len(rows))), set(range(len(rows)))
        while free_rows:
            row, column = self._pivot(free_rows, free_columns)
            free_rows.remove(row)
            free_columns.remove(column)
            self._below.append(self._cleared(row, column, free_rows, free_columns))
            self._order.append((row, column))

    def solved(self, sides: Sequence[Entry]) -> list[Entry]:
        terms, sides = self._terms, list(sides)
        for (row, _), below in zip(self._order, self._below, strict=True):
            for other, factor in below.items():
                sides[other] = terms.less(sides[other], terms.times(factor, sides[row]))
        solution: dict[int, Entry] = {}
        for row, column in reversed(self._order):
            side = sides[row]
            for later, value in solution.items():
                side = terms.less(side, terms.times(self._rows[row][later], value))
            solution[column] = _over(terms, side, self._rows[row][column])
        return [solution[k] for k in range(len(sides))]

    def _pivot(self, rows: set[int], columns: set[int]) -> tuple[int, int]:
        scale = np.abs(self._sample[np.ix_(sorted(rows), sorted(columns))]).max()
        usable = [
            (sum(self._rows[i][k] is not None for k in columns), -abs(float(self._sample[i, j])), i, j)
            for i in rows
            for j in columns
            if self._rows[i][j] is not None and abs(self._sample[i, j]) > _SINGULAR * scale
        ]
        _, _, row, column = min(usable)
        return row, column

    def _cleared(self, row: int, column: int, rows: set[int], columns: set[int]) -> dict[int, Term]:
        """The factors of the other rows, which lose the pivot's column."""
        factors: dict[int, Term] = {}
        for other in sorted(rows):
            factor = _over(self._terms, self._rows[other][column], self._rows[row][column])
            if factor is None:
                continue
            factors[other] = factor
            ratio = self._sample[other, column] / self._sample[row, column]
            for k in sorted(columns):
                product = self._terms.times(factor, self._rows[row][k])
                self._rows[other][k] = self._terms.less(self._rows[other][k], product)
                self._sample[other, k] -= ratio * self._sample[row, k]
        return factors


def _over(terms: Terms, above: Entry, below: Entry) -> Entry:
    return None if below is None else terms.over(above, below)


def _plus(terms: Terms, left: Entry, right: Entry) -> Entry:
    return terms.less(left, None if right is None else negative(right))


def _over_common(terms: Terms, entry: Entry, common: float) -> Entry:
    """The entry with the common factor or its negative: sums of such entries need no factors written."""
    if entry is None or (entry[0] is not None and abs(entry[1]) == common):
        return entry
    index, factor = entry
    if index is None:
        return terms.out.constant(factor / common), common
    return terms.written((index, abs(factor) / common)), common if factor > 0 else -common


def _most_frequent(factors: Sequence[float]) -> float:
    return Counter(factors).most_common(1)[0][0] if factors else 1.0


def _definite(samples: np.ndarray) -> bool:
    """Whether all samples are symmetric and definite, with one sign."""
    scale = np.abs(samples).max(initial=0.0) or 1.0
    if np.abs(samples - samples.transpose(0, 2, 1)).max(initial=0.0) > _SYMMETRIC * scale:
        return False
    values = np.linalg.eigvalsh(samples)
    smallest = _SINGULAR * scale
    return bool((values > smallest).all() or (values < -smallest).all())
