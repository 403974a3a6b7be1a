"""Minors of matrices of expressions without division: exact polynomials over generators (see `embed`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from ulna.symbolic.exact.embed import embed
from ulna.symbolic.exact.field import Element, Field, Polynomial


@dataclass(frozen=True, slots=True, kw_only=True)
class PolynomialRows:
    """A matrix as polynomial rows: entry (i, j) is `rows[i][j] * scales[i]`; ranks and relations need only `rows`."""

    ring: Field
    rows: tuple[tuple[Polynomial, ...], ...]
    scales: tuple[Element, ...]


def polynomial_rows(matrix: sp.MatrixBase) -> PolynomialRows:
    """The matrix over one common field, with the denominator and the common factor of each row taken out.

    Raises:
        ExactAlgebraError: see `ulna.symbolic.exact.embed.embed`.
    """
    ring, elements = embed(list(matrix))
    rows: list[tuple[Polynomial, ...]] = []
    scales: list[Element] = []
    for i in range(matrix.rows):
        entries = elements[i * matrix.cols : (i + 1) * matrix.cols]
        denominator = ring.one
        for entry in entries:
            denominator = ring.times(denominator, entry[1] // ring.divisor(denominator, entry[1]))
        cleared = [ring.reduced(ring.times(n, denominator // d)) for n, d in entries]
        common = ring.none
        for polynomial in cleared:
            common = ring.divisor(common, polynomial)
        if common.is_zero():
            common = ring.one
        rows.append(tuple(polynomial // common for polynomial in cleared))
        scales.append((common, denominator))
    return PolynomialRows(ring=ring, rows=tuple(rows), scales=tuple(scales))


def maximal_minors(
    ring: Field, rows: Sequence[Sequence[Polynomial]], columns: Sequence[int]
) -> dict[frozenset[int], Polynomial]:
    """The determinants of the given rows over every choice of len(rows) of the given columns.

    Laplace expansion row by row with every smaller minor computed once: about n 2^(n-1) products for an n x n
    determinant, no division, so that it is exact also where generators obey relations.
    """
    minors: dict[tuple[int, ...], Polynomial] = {(): ring.one}
    for row in rows:
        larger: dict[tuple[int, ...], Polynomial] = {}
        for chosen, minor in minors.items():
            if minor.is_zero():
                continue
            for column in columns:
                if column in chosen or row[column].is_zero():
                    continue
                # Sign of moving the new column from the last place to its place in the sorted choice.
                position = sum(1 for other in chosen if columns.index(other) < columns.index(column))
                key = (*chosen[:position], column, *chosen[position:])
                term = ring.times(row[column], minor)
                total = larger.get(key, ring.none)
                larger[key] = total - term if (len(chosen) - position) % 2 else total + term
        minors = {key: ring.reduced(value) for key, value in larger.items()}
    return {frozenset(key): value for key, value in minors.items()}


def determinant(ring: Field, rows: Sequence[Sequence[Polynomial]], columns: Sequence[int]) -> Polynomial:
    """The determinant of the square matrix of these rows and columns."""
    return maximal_minors(ring, rows, columns).get(frozenset(columns), ring.none)


def relation_with(
    ring: Field, rows: Sequence[Sequence[Polynomial]], columns: Sequence[int], extra: int
) -> tuple[list[Polynomial], Polynomial]:
    """(n, d) with sum_k n_k column_k = d column_extra on these (as many) rows: Cramer's rule."""
    minors = maximal_minors(ring, rows, [*columns, extra])
    count = len(columns)
    numerators: list[Polynomial] = []
    for number, column in enumerate(columns):
        minor = minors.get(frozenset({*columns, extra} - {column}), ring.none)
        # The extra column stands last; bringing it to the place of the replaced one takes this many swaps.
        numerators.append(-minor if (count - 1 - number) % 2 else minor)
    return numerators, minors.get(frozenset(columns), ring.none)
