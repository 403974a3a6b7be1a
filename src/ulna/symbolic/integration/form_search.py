"""The ways to integrate a one-form up to a factor, in order of cost."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from sympy import Expr, Symbol

from ulna.symbolic.exact.attempts import attempt
from ulna.symbolic.exact.quotients import normal
from ulna.symbolic.exact.spans import without_common_factor
from ulna.symbolic.exact.zero import vanishes
from ulna.symbolic.integration import integrating_factor as factors
from ulna.symbolic.integration import pfaffian
from ulna.symbolic.integration.potential import potential_by_quadrature, potential_in_span

_Methods: TypeAlias = Iterator[tuple[str, Callable[[], Iterator[Expr]]]]


@dataclass(frozen=True, slots=True, kw_only=True)
class FormSearch:
    """Candidates for functions constant along the kernel of an integrable one-form, cheap methods first.

    Args:
        components: wᵢ, not all zero, zeros written as 0.
        coordinates: x.
        point: values of the coordinates near which integrals are taken.
        hints: expressions whose factors may occur in an integrating factor.
        spectators: symbols that are held fixed but may occur in the functions.
        seconds: s, for each candidate of each method.
    """

    components: tuple[Expr, ...]
    coordinates: tuple[Symbol, ...]
    point: Mapping[Symbol, Expr]
    hints: tuple[Expr, ...] = ()
    spectators: tuple[Symbol, ...] = ()
    seconds: float = 3.0

    def cheap_candidates(self, tried: list[str]) -> Iterator[tuple[str, Expr]]:
        """(method, candidate) pairs from methods that take milliseconds and need no simplification."""
        yield from self._tried(self._cheap_methods(), tried)

    def candidates(self, tried: list[str]) -> Iterator[tuple[str, Expr]]:
        """(method, candidate) pairs from the other methods; `tried` gets the names of those begun."""
        yield from self._tried(self._methods(), tried)

    def _tried(self, methods: _Methods, tried: list[str]) -> Iterator[tuple[str, Expr]]:
        for name, method in methods:
            tried.append(name)
            iterator = method()
            while True:
                found = attempt(self.seconds, name, next, iterator, None)
                if found.value is None:
                    if found.reason:
                        tried[-1] = found.reason
                    break
                yield name, found.value

    def _cheap_methods(self) -> _Methods:
        yield "a coordinate", self._coordinate
        yield "polynomial of low degree", lambda: self._constant((1, 2), 150)

    def _methods(self) -> _Methods:
        yield "closed", self._closed
        yield "common factor and division by a component", self._divided
        yield "integrating factor from the factors of the form", self._products
        yield "polynomial of higher degree", lambda: self._constant((3, 4, 6, 8), 350)
        yield "reciprocal integrating factor", self._reciprocals
        yield "equation linear in one coordinate", self._affine
        yield "Pfaffian equation", self._pfaffian

    def _coordinate(self) -> Iterator[Expr]:
        nonzero = [x for x, w in zip(self.coordinates, self.components, strict=True) if w != 0]
        if len(nonzero) == 1:
            yield nonzero[0]

    def _constant(self, degrees: Sequence[int], limit: int) -> Iterator[Expr]:
        found = pfaffian.constant_in_span(
            self.components, self.coordinates, spectators=self.spectators, degrees=degrees, limit=limit
        )
        if found is not None:
            yield found

    def _potential(self, components: Sequence[Expr]) -> Iterator[Expr]:
        found = potential_in_span(components, self.coordinates, spectators=self.spectators)
        if found is None:
            found = potential_by_quadrature(components, self.coordinates, near=self.point)
        if found is not None:
            yield found

    def _closed(self) -> Iterator[Expr]:
        if is_closed(self.components, self.coordinates):
            yield from self._potential(self.components)

    def _divided(self) -> Iterator[Expr]:
        stripped = without_common_factor(self.components)
        if is_closed(stripped, self.coordinates):
            yield from self._potential(stripped)
        for divisor in stripped:
            if divisor != 0 and divisor.free_symbols:
                divided = [normal(w / divisor) for w in stripped]
                if is_closed(divided, self.coordinates):
                    yield from self._potential(divided)

    def _products(self) -> Iterator[Expr]:
        stripped = without_common_factor(self.components)
        for form in dict.fromkeys((stripped, self.components)):
            factor = factors.factor_from_products(form, self.coordinates, self.hints, spectators=self.spectators)
            if factor is not None:
                found = pfaffian.potential_of_product(
                    factor, form, self.coordinates, spectators=self.spectators, near=self.point
                )
                if found is not None:
                    yield found

    def _reciprocals(self) -> Iterator[Expr]:
        stripped = without_common_factor(self.components)
        found = factors.reciprocal_factors(stripped, self.coordinates, spectators=self.spectators)
        if len(found) > 1:
            yield found[0] / found[1]
        for reciprocal in found[:2]:
            yield from self._potential([normal(w / reciprocal) for w in stripped])

    def _affine(self) -> Iterator[Expr]:
        yield from pfaffian.affine_in_one_coordinate(self.components, self.coordinates, near=self.point)

    def _pfaffian(self) -> Iterator[Expr]:
        yield from pfaffian.reduced_by_mayer(self.components, self.coordinates, near=self.point)


def is_closed(components: Sequence[Expr], coordinates: Sequence[Symbol]) -> bool:
    """Whether dw = 0 at random points: a fast filter."""
    n = len(coordinates)
    return all(
        vanishes(components[j].diff(coordinates[i]) - components[i].diff(coordinates[j]))
        for i in range(n)
        for j in range(i + 1, n)
    )
