"""The search for functions that are constant on the leaves of an involutive distribution."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, combinations, islice

import numpy as np
from sympy import Add, Expr, ImmutableDenseMatrix, Integer, Matrix, Symbol, exp
from sympy.matrices import MatrixBase

from ulna.symbolic.exact.finite_field import FieldSample
from ulna.symbolic.exact.letters import letters, wide_letters, words
from ulna.symbolic.exact.quotients import normal
from ulna.symbolic.exact.residues import null_space_modulo
from ulna.symbolic.exact.spans import null_space
from ulna.symbolic.exact.zero import vanishes
from ulna.symbolic.integration.ansatz import LinearEquations, Span, solutions
from ulna.symbolic.integration.form_search import FormSearch
from ulna.symbolic.integration.level_sets import constant_of, solved_for_a_coordinate

_LARGEST_SPAN = 350
_CHOICES = 20
"""Choices of independent coordinates for which the annihilator is reduced."""


def along(function: Expr, field: MatrixBase, coordinates: Sequence[Symbol]) -> Expr:
    """The Lie derivative as it comes, to be evaluated only."""
    return Add(*(function.diff(x) * rate for x, rate in zip(coordinates, field, strict=True)))


def independent(functions: Sequence[Expr], coordinates: Sequence[Symbol]) -> bool:
    """Whether the differentials are independent at random points of a finite field."""
    sample = FieldSample(16)
    slopes = np.array([sample.table([h.diff(x) for x in coordinates]) for h in functions])
    good = np.nonzero(sample.valid)[0][:2]
    return any(not null_space_modulo(slopes[:, :, k].T) for k in good)


@dataclass(frozen=True, slots=True, kw_only=True)
class LeafSearch:
    """Candidates for first integrals of an involutive distribution given by independent fields.

    `spectators` are constants of integration of an outer search: they may occur in the functions.
    """

    fields: tuple[ImmutableDenseMatrix, ...]
    coordinates: tuple[Symbol, ...]
    point: Mapping[Symbol, Expr]
    spectators: tuple[Symbol, ...] = ()
    hints: tuple[Expr, ...] = ()

    def cheap_candidates(self) -> Iterator[Expr]:
        """Coordinates and polynomials of low degree: milliseconds, and the fields are only evaluated."""
        for i, x in enumerate(self.coordinates):
            if all(vanishes(f[i]) for f in self.fields):
                yield x
        yield from self._in_span(range(1, 3), 200)

    def candidates(self, wanted: int) -> Iterator[Expr]:
        """First integrals, simple ones first, each independent of those before."""
        known: list[Expr] = []
        for candidate in self._direct(wanted):
            if not independent([*known, candidate], self.coordinates):
                continue
            known.append(candidate)
            yield candidate
            if len(known) >= wanted:
                return
        if not known:
            return
        yield from self._restricted(known, wanted)

    def _direct(self, wanted: int) -> Iterator[Expr]:
        yield from self.cheap_candidates()
        yield from self._single_forms(wanted)
        for x in self.coordinates if wanted > 1 else ():
            for exponent in (x, -x):
                yield from self._in_span(range(1, 4), 120, exponent)
        yield from self._in_span(range(1, 3), _LARGEST_SPAN, wide=True)
        yield from self._in_span(range(3, 9), _LARGEST_SPAN)

    def _in_span(
        self, degrees: Iterable[int], limit: int, exponent: Expr | None = None, *, wide: bool = False
    ) -> Iterator[Expr]:
        """Integrals F or exp(exponent) F with F polynomial in the letters."""
        x = (*self.coordinates, *self.spectators)
        zeros = [Integer(0)] * len(self.spectators)
        alphabet = (wide_letters if wide else letters)([e for f in self.fields for e in f], x)
        rows = tuple((*f, *zeros) for f in self.fields)
        zeroth = () if exponent is None else tuple(along(exponent, f, self.coordinates) for f in self.fields)
        equations = LinearEquations(coordinates=x, fields=rows, zeroth=zeroth)
        for degree in degrees:
            monomials = tuple(words(alphabet, degree, limit + 1))
            if len(monomials) > limit:
                return
            found = solutions(equations, Span(alphabet=alphabet, monomials=monomials))
            yield from (found if exponent is None else [exp(exponent) * f for f in found])

    def _single_forms(self, wanted: int) -> Iterator[Expr]:
        """Integrals of one-forms of the annihilator that satisfy Frobenius' condition by themselves."""
        seen: set[tuple[Expr, ...]] = set()
        for form in self._forms():
            if form in seen:
                continue
            seen.add(form)
            if wanted > 1 and not _integrable(form, self.coordinates):
                continue
            search = FormSearch(
                components=form,
                coordinates=self.coordinates,
                point=self.point,
                hints=self.hints,
                spectators=self.spectators,
            )
            for _, candidate in chain(search.cheap_candidates([]), search.candidates([])):
                if all(vanishes(along(candidate, f, self.coordinates)) for f in self.fields):
                    yield candidate
                    break

    def _forms(self) -> Iterator[tuple[Expr, ...]]:
        """Reduced bases of the annihilator for the choices of dependent coordinates."""
        n, d = len(self.coordinates), len(self.fields)
        matrix = Matrix.hstack(*(f.as_mutable() for f in self.fields)).T
        if d == n - 1:
            yield from (tuple(column) for column in null_space(matrix))
            return
        for chosen in islice(combinations(range(n), d), _CHOICES):
            for column in null_space(matrix, pivots=chosen):
                yield tuple(column)

    def _restricted(self, known: Sequence[Expr], wanted: int) -> Iterator[Expr]:
        """The search on the level sets of what is known, each known function solved for one coordinate."""
        solved: dict[Symbol, Expr] = {}
        constants: dict[Symbol, Expr] = {}
        for function in known:
            reduced = function.subs(solved)
            constant = constant_of(reduced, self.point)
            free = [x for x in self.coordinates if x in reduced.free_symbols and x not in solved]
            solution = solved_for_a_coordinate(reduced, constant, free)
            if solution is None:
                return
            variable, value = solution
            solved = {x: v.subs(variable, value) for x, v in solved.items()} | {variable: value}
            constants[constant] = function
        rest = tuple(x for x in self.coordinates if x not in solved)
        fields = []
        for f in self.fields:
            entries = [normal(e.subs(solved)) for e, x in zip(f, self.coordinates, strict=True) if x in rest]
            fields.append(ImmutableDenseMatrix(len(rest), 1, entries))
        point = {x: self.point[x] for x in rest}
        smaller = LeafSearch(
            fields=tuple(fields), coordinates=rest, point=point, spectators=(*self.spectators, *constants)
        )
        for candidate in smaller.candidates(wanted - len(known)):
            yield candidate.subs(constants)


def _integrable(form: Sequence[Expr], coordinates: Sequence[Symbol]) -> bool:
    """Frobenius' condition at random points of a finite field."""
    n = len(form)
    p = next((i for i in range(n) if form[i] != 0), None)
    if p is None:
        return False
    d = [[form[j].diff(coordinates[i]) - form[i].diff(coordinates[j]) for j in range(n)] for i in range(n)]
    return all(
        vanishes(form[p] * d[i][j] + form[i] * d[j][p] + form[j] * d[p][i])
        for i, j in combinations([k for k in range(n) if k != p], 2)
    )
