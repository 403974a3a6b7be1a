"""Linear relations with constant coefficients between functions, found modulo a prime.

Σ cₖ Fₖ(x) = 0 with constants cₖ is a linear system once the functions are known at enough points. The constants may
depend on parameters: then they are sought as polynomials of low degree in these.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations_with_replacement
from math import prod

import numpy as np
from sympy import Expr, Integer, Mul, Symbol

from ulna.symbolic.exact.finite_field import PRIMES, FieldSample, Residues
from ulna.symbolic.exact.residues import combined_residue, null_space_modulo, rational_from_residue

Rows = Callable[[FieldSample], Residues]
"""The values of the columns at the points of a sample, shape (columns, equations, points)."""

_SPARE_EQUATIONS = 12
_PARAMETER_DEGREE = 4
_GREATEST_SIZE = 700


def constant_relations(
    rows: Rows, columns: int, equations: int, parameters: Sequence[Symbol] = (), *, seed: int = 1
) -> list[dict[int, Expr]]:
    """All constant relations between the columns, as {column: coefficient} with only nonzero coefficients.

    Each relation expresses one column by columns of smaller index, so put simple functions first. The relations are
    candidates: a probabilistic search found them, and the caller proves or refutes.

    Args:
        rows: the functions, evaluated on a sample.
        columns: number of unknown constants.
        equations: number of scalar equations per point.
        parameters: symbols on which the constants may depend.
        seed: of the sample.
    """
    points = -(-(columns + _SPARE_EQUATIONS) // equations)
    vectors = null_space_modulo(_matrix(rows, points, seed, parameters, PRIMES[0]), PRIMES[0])
    if not vectors:
        return []
    other = (
        null_space_modulo(_matrix(rows, points, seed + 1, parameters, PRIMES[0]), PRIMES[0]) if parameters else vectors
    )
    by_column = {max(v): v for v in other}
    constant = [v for v in vectors if by_column.get(max(v)) == v]
    values = _fractions(
        constant, lambda prime: null_space_modulo(_matrix(rows, points, seed, parameters, prime), prime)
    )
    found: dict[int, dict[int, Expr]] = {max(relation): relation for relation in values}
    if parameters:
        for vector in vectors:
            if max(vector) not in found:
                relation = _with_parameters(rows, sorted(vector), equations, parameters, seed)
                if relation:
                    found[max(vector)] = relation
    return [found[column] for column in sorted(found)]


def _fractions(
    vectors: Sequence[Mapping[int, int]], modulo: Callable[[int], list[dict[int, int]]]
) -> list[dict[int, Expr]]:
    """The vectors with rational entries; those with large ones are computed modulo more primes."""
    found: dict[int, dict[int, Expr]] = {}
    images = [{max(v): v for v in vectors}]
    for count in range(1, len(PRIMES) + 1):
        primes = PRIMES[:count]
        if count > 1:
            images.append({max(v): v for v in modulo(primes[-1])})
        for column, vector in images[0].items():
            same = [image.get(column, {}) for image in images]
            if column in found or any(v.keys() != vector.keys() for v in same):
                continue
            entries: dict[int, Expr] = {}
            for k in vector:
                value = rational_from_residue(combined_residue([v[k] for v in same], primes), prod(primes))
                if value is None:  # of a relation that is none nearly every entry is, so the first tells
                    break
                entries[k] = value
            else:
                found[column] = entries
        if len(found) == len(vectors):
            break
    return list(found.values())


def _matrix(rows: Rows, points: int, seed: int, constants: Sequence[Symbol], prime: int) -> Residues:
    """Shape (equations, columns). Draws more points until enough are valid (square roots halve their number)."""
    wanted = points
    columns = 0
    for _ in range(6):
        sample = FieldSample(wanted, seed=seed, constants=constants, prime=prime)
        values = rows(sample)
        columns = values.shape[0]
        if int(sample.valid.sum()) >= points:
            kept = values[:, :, sample.valid][:, :, :points]
            return kept.reshape(kept.shape[0], -1).T
        wanted *= 2
    return np.eye(columns, dtype=np.int64)  # nothing can be evaluated: no relation


def _with_parameters(
    rows: Rows, support: Sequence[int], equations: int, parameters: Sequence[Symbol], seed: int
) -> dict[int, Expr] | None:
    """The relation on the support with coefficients polynomial in the parameters, of the lowest degree possible."""
    for degree in range(1, _PARAMETER_DEGREE + 1):
        monomials = [
            chosen for d in range(degree + 1) for chosen in combinations_with_replacement(tuple(parameters), d)
        ]
        size = len(monomials) * len(support)
        if size > _GREATEST_SIZE:
            return None

        def extended(sample: FieldSample, monomials: list[tuple[Symbol, ...]] = monomials) -> Residues:
            values = rows(sample)[list(support)]
            factors = [sample(Mul(*chosen)) for chosen in monomials]
            return np.concatenate([values * f[None, None, :] % sample.prime for f in factors])

        def modulo(prime: int, extended: Rows = extended, size: int = size) -> list[dict[int, int]]:
            points = -(-(size + _SPARE_EQUATIONS) // equations)
            return null_space_modulo(_matrix(extended, points, seed + 2, (), prime), prime)

        relations = _fractions(modulo(PRIMES[0]), modulo)
        if relations:
            return _gather(min(relations, key=len), monomials, support)
    return None


def _gather(
    values: Mapping[int, Expr], monomials: Sequence[tuple[Symbol, ...]], support: Sequence[int]
) -> dict[int, Expr]:
    relation: dict[int, Expr] = {}
    for index, value in values.items():
        monomial, column = divmod(index, len(support))
        term = Mul(value, *monomials[monomial])
        relation[support[column]] = relation.get(support[column], Integer(0)) + term
    return {k: v for k, v in relation.items() if v != 0}
