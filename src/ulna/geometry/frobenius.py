"""Integration of involutive distributions: the functions that are constant on their leaves.

Frobenius' theorem gives n − d independent ones around a point where the distribution of dimension d is involutive and
regular. Finding them in closed form is another matter: it is a search, and every function found is differentiated.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, combinations, islice

import numpy as np
from sympy import Add, Expr, ImmutableDenseMatrix, Integer, Matrix, Symbol, exp
from sympy.matrices import MatrixBase

from ulna.base import Verdict, all_of
from ulna.geometry.distribution import Distribution, generic_basis, involutive
from ulna.geometry.lie import Scalar, expression, lie_derivative
from ulna.geometry.representative import simplest_function_of, without_arcsines
from ulna.symbolic.ansatz import LinearEquations, Span, solutions
from ulna.symbolic.budget import BudgetExceeded, time_budget
from ulna.symbolic.elimination import normal, null_space, vanishes
from ulna.symbolic.finite_field import FieldSample
from ulna.symbolic.finite_field import null_space as residue_null_space
from ulna.symbolic.form_search import FormSearch
from ulna.symbolic.letters import letters, wide_letters, words
from ulna.symbolic.level_sets import constant_of, solved_for_a_coordinate
from ulna.symbolic.rank import generic_rank
from ulna.symbolic.zero import is_zero

_LARGEST_SPAN = 350
_CHOICES = 20
"""Choices of independent coordinates for which the annihilator is reduced."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstIntegrals:
    """n − d independent functions with L_f T = 0 for every field f of an involutive distribution of dimension d.

    Args:
        distribution: what was integrated.
        functions: the T's; None where there are not as many or not all were found.
        found: the independent ones that were found, all or some.
        verdict: refuted (with the offending bracket) if the distribution is not involutive, undecided if the
            search did not find all.
    """

    distribution: Distribution
    functions: tuple[Expr, ...] | None
    found: tuple[Expr, ...]
    verdict: Verdict


def first_integrals(
    span: Distribution,
    hints: Sequence[Expr] = (),
    *,
    near: Mapping[Symbol, Scalar] | None = None,
    seconds: float = 8.0,
) -> FirstIntegrals:
    """Independent functions whose common level sets are the leaves of the distribution.

    In order: coordinates, polynomials in the functions that occur, one-forms of the annihilator that are integrable by
    themselves; then what was found is held constant, which leaves a smaller problem of the same kind.

    Args:
        span: spanning fields over n coordinates.
        hints: expressions whose factors may occur in integrating factors.
        near: the point around which the functions must be real; the origin if left out.
        seconds: s, for everything together.
    """
    basis = generic_basis(span)
    wanted = len(span.coordinates) - len(basis.fields)
    point = {x: Integer(0) for x in span.coordinates} | {x: expression(value) for x, value in (near or {}).items()}
    found: list[Expr] = []
    search = _Search(fields=basis.fields, coordinates=span.coordinates, point=point, hints=tuple(hints))
    reason = "every method came to its end"
    try:
        with time_budget(seconds):
            _collect(search.cheap_candidates(), found, wanted, basis, point)
            if len(found) < wanted:
                involution = involutive(basis)
                if involution.fails:
                    return _refused(span, wanted, involution)
                _collect(search.candidates(wanted), found, wanted, basis, point)
    except BudgetExceeded:
        reason = f"out of time after {seconds:g} s"
    functions = tuple(found)
    if len(found) == wanted:
        return FirstIntegrals(distribution=span, functions=functions, found=functions, verdict=verified(found, basis))
    verdict = Verdict.undecided(f"{wanted} independent first integrals are known", found=functions, reason=reason)
    return FirstIntegrals(distribution=span, functions=None, found=functions, verdict=verdict)


def _collect(
    candidates: Iterable[Expr], found: list[Expr], wanted: int, basis: Distribution, point: Mapping[Symbol, Expr]
) -> None:
    """Accepted candidates appended to `found` until there are enough."""
    if len(found) == wanted:
        return
    for candidate in candidates:
        value = _accepted(candidate, found, basis, point)
        if value is not None:
            found.append(value)
        if len(found) == wanted:
            return


def _refused(span: Distribution, wanted: int, involution: Verdict) -> FirstIntegrals:
    claim = f"the distribution has {wanted} independent first integrals"
    verdict = Verdict.refuted(claim, **{**involution.evidence, "because": involution.claim})
    return FirstIntegrals(distribution=span, functions=None, found=(), verdict=verdict)


def verified(functions: Sequence[Expr], span: Distribution) -> Verdict:
    """Whether the functions are independent and constant along every field of the distribution."""
    claim = "the functions are independent first integrals"
    parts = [is_zero(lie_derivative(h, f, span.coordinates)) for h in functions for f in span.fields]
    if functions:
        rank = generic_rank(Matrix([[h.diff(x) for x in span.coordinates] for h in functions]))
        if rank.value < len(functions):
            return Verdict.refuted(claim, rank=rank.value, functions=tuple(functions))
        parts.append(Verdict.proved("the differentials are independent", point=rank.point))
    return all_of(claim, parts)


def _accepted(candidate: Expr, found: Sequence[Expr], basis: Distribution, point: Mapping[Symbol, Expr]) -> Expr | None:
    """The candidate in its simplest form if it is constant along the fields and independent of what was found."""
    if not _independent([*found, candidate], basis.coordinates):
        return None
    if not all(vanishes(_along(candidate, f, basis.coordinates)) for f in basis.fields):
        return None
    value = simplest_function_of(without_arcsines(candidate), basis.coordinates, near=point)
    if value is None or verified([value], basis).fails:
        return None
    return value


def _along(function: Expr, field: MatrixBase, coordinates: Sequence[Symbol]) -> Expr:
    """The Lie derivative as it comes, to be evaluated only."""
    return Add(*(function.diff(x) * rate for x, rate in zip(coordinates, field, strict=True)))


def _independent(functions: Sequence[Expr], coordinates: Sequence[Symbol]) -> bool:
    """Whether the differentials are independent at random points of a finite field."""
    sample = FieldSample(16)
    slopes = np.array([sample.table([h.diff(x) for x in coordinates]) for h in functions])
    good = np.nonzero(sample.valid)[0][:2]
    return any(not residue_null_space(slopes[:, :, k].T) for k in good)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Search:
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
            if not _independent([*known, candidate], self.coordinates):
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
        zeroth = () if exponent is None else tuple(_along(exponent, f, self.coordinates) for f in self.fields)
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
                if all(vanishes(_along(candidate, f, self.coordinates)) for f in self.fields):
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
        smaller = _Search(
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
