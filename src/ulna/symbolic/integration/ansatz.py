"""Functions of a finite-dimensional space that solve linear partial differential equations of first order.

Wanted: F = Σ cₖ mₖ + Σ cₗ log pₗ with X_j F + θ_j F = r_j for all j, where the X_j are vector fields, the mₖ monomials
over an alphabet of functions, the pₗ given factors. That is linear in the constants, so it is solved at random points
of a finite field. First integrals (θ = r = 0), potentials (X_j = ∂_j, r = the form), integrating factors (their
logarithm with r, or themselves with θ) are all of this kind.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sympy import Add, Expr, Integer, Symbol, log

from ulna.symbolic.exact.finite_field import FieldSample, Residues
from ulna.symbolic.exact.letters import word
from ulna.symbolic.exact.relations import constant_relations


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearEquations:
    """X_j F + θ_j F = r_j, j = 1…k, for one unknown function F.

    Args:
        coordinates: x, n symbols.
        fields: k rows of n components, the X_j.
        zeroth: the θ_j, k expressions; empty for none.
        right: the r_j, k expressions; empty for a homogeneous system.
    """

    coordinates: tuple[Symbol, ...]
    fields: tuple[tuple[Expr, ...], ...]
    zeroth: tuple[Expr, ...] = ()
    right: tuple[Expr, ...] = ()

    @property
    def parameters(self) -> tuple[Symbol, ...]:
        """Symbols that are no coordinates, by name."""
        everything = [*(c for row in self.fields for c in row), *self.zeroth, *self.right]
        symbols = set().union(*(e.free_symbols for e in everything)) - set(self.coordinates)
        return tuple(sorted(symbols, key=str))


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """The linear combinations of monomials (exponent vectors over an alphabet) and of logarithms of factors."""

    alphabet: tuple[Expr, ...]
    monomials: tuple[tuple[int, ...], ...]
    logarithms: tuple[Expr, ...] = ()

    def element(self, index: int) -> Expr:
        """Basis function number `index`: logarithms first, then monomials."""
        if index < len(self.logarithms):
            return log(self.logarithms[index])
        return word(self.alphabet, self.monomials[index - len(self.logarithms)])

    @property
    def size(self) -> int:
        """The number of basis functions."""
        return len(self.logarithms) + len(self.monomials)


def solutions(equations: LinearEquations, span: Span) -> list[Expr]:
    """Candidates for F in the span, simplest first; for an inhomogeneous system at most one, a particular solution.

    They come from a search modulo a prime: prove them before use.
    """
    if span.size == 0:
        return []
    gradients = _Gradients(equations, span)
    extra = 1 if equations.right else 0
    relations = constant_relations(gradients.rows, span.size + extra, len(equations.fields), equations.parameters)
    if not equations.right:
        return [Add(*(c * span.element(k) for k, c in sorted(r.items()))) for r in relations]
    found = [r for r in relations if span.size in r]
    if not found:
        return []
    scale = -found[0].pop(span.size)
    return [Add(*(c / scale * span.element(k) for k, c in sorted(found[0].items())), Integer(0))]


class _Gradients:
    """The operators applied to the basis of the span, on samples."""

    def __init__(self, equations: LinearEquations, span: Span) -> None:
        self._equations = equations
        self._span = span
        x = equations.coordinates
        self._letters = [tuple(letter.diff(c) for c in x) for letter in span.alphabet]
        self._factors = [tuple(factor.diff(c) for c in x) for factor in span.logarithms]

    def rows(self, sample: FieldSample) -> Residues:
        """Shape (basis functions [+ 1 for the right side], equations, points)."""
        fields = np.array([sample.table(row) for row in self._equations.fields])
        letters = sample.table(self._span.alphabet)
        along = _along(fields, sample, self._letters)
        inverse = np.array([sample.inverse(v) for v in letters]).reshape(letters.shape)
        relative = along * inverse[:, None, :] % sample.prime  # X_j(letter) / letter
        blocks = []
        if self._span.logarithms:
            values = sample.table(self._span.logarithms)
            inverse = np.array([sample.inverse(v) for v in values])
            blocks.append(_along(fields, sample, self._factors) * inverse[:, None, :] % sample.prime)
        if self._span.monomials:
            blocks.append(self._monomials(sample, letters, relative))
        if self._equations.right:
            blocks.append(sample.table(self._equations.right)[None, :, :])
        return np.concatenate(blocks)

    def _monomials(self, sample: FieldSample, letters: Residues, relative: Residues) -> Residues:
        powers: dict[tuple[int, int], Residues] = {}
        zeroth = sample.table(self._equations.zeroth) if self._equations.zeroth else 0
        block = []
        for exponents in self._span.monomials:
            value = np.ones(letters.shape[1], dtype=np.int64)
            slope = np.zeros(relative.shape[1:], dtype=np.int64)
            for i, e in enumerate(exponents):
                if e:
                    if (i, e) not in powers:
                        powers[i, e] = sample.signed_power(letters[i], e)
                    value = value * powers[i, e] % sample.prime
                    slope = (slope + e % sample.prime * relative[i]) % sample.prime
            block.append(value[None, :] * ((slope + zeroth) % sample.prime) % sample.prime)
        return np.array(block)


def _along(fields: Residues, sample: FieldSample, gradients: Sequence[Sequence[Expr]]) -> Residues:
    """X_j applied to functions with these gradients, shape (functions, fields, points)."""
    result = np.zeros((len(gradients), fields.shape[0], fields.shape[2]), dtype=np.int64)
    for i, gradient in enumerate(gradients):
        for k, slope in enumerate(gradient):
            if slope != 0:
                result[i] = (result[i] + sample(slope)[None, :] * fields[:, k, :]) % sample.prime
    return result
