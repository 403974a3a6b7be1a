"""Linear relations with constant coefficients between functions, found modulo a prime.

Σ cₖ Fₖ(x) = 0 with constants cₖ is a linear system once the functions are known at enough points. The constants may
depend on parameters: then they are sought as polynomials of low degree in these.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations_with_replacement

import numpy as np
from sympy import Expr, Integer, Mul, Rational, Symbol

from ulna.symbolic.finite_field import PRIME, FieldSample, Residues, null_space, rational_from_residue

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
    vectors = null_space(_matrix(rows, points, seed, parameters))
    if not vectors:
        return []
    other = null_space(_matrix(rows, points, seed + 1, parameters)) if parameters else vectors
    by_column = {max(v): v for v in other}
    found: list[dict[int, Expr]] = []
    for vector in vectors:
        twin = by_column.get(max(vector), {})
        values = {k: rational_from_residue(r) for k, r in vector.items()}
        if twin == vector and all(v is not None for v in values.values()):
            found.append({k: v for k, v in values.items() if v is not None})
        elif parameters:
            relation = _with_parameters(rows, sorted(vector), equations, parameters, seed)
            if relation:
                found.append(relation)
    return found


def _matrix(rows: Rows, points: int, seed: int, constants: Sequence[Symbol]) -> Residues:
    """Shape (equations, columns). Draws more points until enough are valid (square roots halve their number)."""
    wanted = points
    columns = 0
    for _ in range(6):
        sample = FieldSample(wanted, seed=seed, constants=constants)
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
            return np.concatenate([values * f[None, None, :] % PRIME for f in factors])

        points = -(-(size + _SPARE_EQUATIONS) // equations)
        vectors = null_space(_matrix(extended, points, seed + 2, ()))
        for vector in sorted(vectors, key=len):
            values = {k: rational_from_residue(r) for k, r in vector.items()}
            if all(v is not None for v in values.values()):
                return _gather(values, monomials, support)
    return None


def _gather(
    values: dict[int, Rational | None], monomials: Sequence[tuple[Symbol, ...]], support: Sequence[int]
) -> dict[int, Expr]:
    relation: dict[int, Expr] = {}
    for index, value in values.items():
        monomial, column = divmod(index, len(support))
        term = Mul(value, *monomials[monomial])
        relation[support[column]] = relation.get(support[column], Integer(0)) + term
    return {k: v for k, v in relation.items() if v != 0}
