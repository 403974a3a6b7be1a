"""A matrix of program values, factored once: every further right-hand side costs two triangular passes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from ulna.base import UlnaError
from ulna.symbolic.program.terms import Term, Terms

Entry = Term | None
"""A multiple of a value, None for a structural zero."""

_SYMMETRIC = 1e-12


class Factored:
    """L D Lᵀ of a matrix that is symmetric and definite at every sample, else L U with the largest sampled pivots.

    A definite matrix needs no choice of pivots, so its factors exist wherever it is definite; pivots chosen at one
    sample may vanish elsewhere (Golub and Van Loan, Matrix Computations, 4th ed., sections 3.4 and 4.1).
    """

    def __init__(self, terms: Terms, rows: Sequence[Sequence[Entry]], samples: np.ndarray) -> None:
        """Emit the factors.

        Args:
            terms: writes what has to be computed.
            rows: (m, m) entries.
            samples: (points, m, m) values of the matrix at generic points.

        Raises:
            UlnaError: if the matrix is singular at the first sample.
        """
        self.terms = terms
        m = len(rows)
        self._rows = [list(row) for row in rows]
        common = _most_frequent([abs(e[1]) for row in rows for e in row if e is not None and e[0] is not None])
        self._rows = [[self._over_common(entry, common) for entry in row] for row in self._rows]
        self._sample = np.array(samples[0], dtype=float)
        self._scale = float(np.abs(self._sample).max(initial=0.0)) or 1.0
        self._definite = _definite(samples)
        if self._definite:  # entries of the lower triangle stand for both
            self._rows = [[self._rows[max(i, k)][min(i, k)] for k in range(m)] for i in range(m)]
        self._below: list[dict[int, Term]] = []
        self.order: list[tuple[int, int]] = []
        free = [set(range(m)), set(range(m))]
        while free[0]:
            row, column = self._pivot(*free)
            free[0].remove(row)
            free[1].remove(column)
            self._below.append(self._eliminated(row, column, free))
            self.order.append((row, column))

    def solved(self, sides: Sequence[Entry]) -> list[Entry]:
        """X in A x = b, by position."""
        sides = list(sides)
        for (row, _), below in zip(self.order, self._below, strict=True):
            for other, factor in below.items():
                sides[other] = self._less(sides[other], factor, sides[row])
        solution: dict[int, Entry] = {}
        for step in range(len(self.order) - 1, -1, -1):
            row, column = self.order[step]
            side = sides[row]
            if self._definite:
                side = self._divided(side, self._rows[row][column])
            for later, factor in self._above(step):
                side = self._less(side, factor, solution[later])
            if not self._definite:
                side = self._divided(side, self._rows[row][column])
            solution[column] = side
        return [solution[k] for k in range(len(self.order))]

    def _above(self, step: int) -> list[tuple[int, Entry]]:
        """What stands right of a pivot, by unknown: a row of Lᵀ or of U."""
        if self._definite:
            return list(self._below[step].items())
        row, _ = self.order[step]
        return [(column, self._rows[row][column]) for _, column in self.order[:step:-1]]

    def _pivot(self, rows: set[int], columns: set[int]) -> tuple[int, int]:
        """A sparsest row; of a matrix that is not definite the largest sampled entry in it."""
        best: tuple[int, float, int, int] | None = None
        for row in sorted(rows):
            count = sum(self._rows[row][column] is not None for column in columns)
            for column in (row,) if self._definite else sorted(columns):
                size = abs(float(self._sample[row, column]))
                usable = self._rows[row][column] is not None and size > 1e-9 * self._scale
                if usable and (best is None or (count, -size) < best[:2]):
                    best = (count, -size, row, column)
        if best is None:
            raise UlnaError("a linear system in a program", "its matrix is singular at a random point.")
        return best[2], best[3]

    def _eliminated(self, row: int, column: int, free: Sequence[set[int]]) -> dict[int, Term]:
        """The factors of the other rows; these without the pivot's column."""
        matrix, sample = self._rows, self._sample
        factors: dict[int, Term] = {}
        for other in sorted(free[0]):
            factor = self._divided(matrix[other][column], matrix[row][column])
            if factor is not None:
                factors[other] = factor
        for other, factor in factors.items():
            ratio = sample[other, column] / sample[row, column]
            for k in sorted(free[1]):
                sample[other, k] -= ratio * sample[row, k]
                if not self._definite:
                    matrix[other][k] = self._less(matrix[other][k], factor, matrix[row][k])
                elif k <= other:  # the lower triangle; the pivot's row is its column
                    matrix[other][k] = self._less(matrix[other][k], factor, matrix[k][column])
                    matrix[k][other] = matrix[other][k]
        return factors

    def _over_common(self, entry: Entry, common: float) -> Entry:
        """The entry with the common factor or its negative: sums of such entries need no factors written."""
        if entry is None or (entry[0] is not None and abs(entry[1]) == common):
            return entry
        index, factor = entry
        if index is None:
            return self.terms.out.constant(factor / common), common
        return self.terms.written((index, abs(factor) / common)), common if factor > 0 else -common

    def _divided(self, above: Entry, below: Entry) -> Entry:
        return None if below is None else self.terms.over(above, below)

    def _less(self, value: Entry, factor: Entry, other: Entry) -> Entry:
        """Value − factor · other."""
        return self.terms.less(value, self.terms.times(factor, other))


def _most_frequent(factors: Sequence[float]) -> float:
    return Counter(factors).most_common(1)[0][0] if factors else 1.0


def _definite(samples: np.ndarray) -> bool:
    """Whether all samples are symmetric and definite, with one sign."""
    scale = np.abs(samples).max(initial=0.0) or 1.0
    if np.abs(samples - samples.transpose(0, 2, 1)).max(initial=0.0) > _SYMMETRIC * scale:
        return False
    values = np.linalg.eigvalsh(samples)
    smallest = 1e-9 * scale
    return bool((values > smallest).all() or (values < -smallest).all())
