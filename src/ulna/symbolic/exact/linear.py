"""Square systems of linear equations whose coefficients are expressions: solution and inverse."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from ulna.base import Status, Verdict
from ulna.symbolic.exact.attempts import attempt
from ulna.symbolic.exact.embed import attempt_exactly
from ulna.symbolic.exact.field import Element, Field
from ulna.symbolic.exact.minors import polynomial_rows, relation_with
from ulna.symbolic.exact.rank import generic_rank


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearSolution:
    """The solution of a square system of linear equations.

    Attributes:
        solution: (n, k), None if the matrix is generically singular or no time was left.
        determinant: of the matrix up to factors that the rows share; the solution fails where it vanishes.
        verdict: on "the matrix is generically invertible".
    """

    solution: sp.MatrixBase | None
    determinant: sp.Expr
    verdict: Verdict


def _readable(ring: Field, element: Element) -> sp.Expr:
    return sp.S.Zero if element[0].is_zero() else ring.factored(element)


def solve_linear(matrix: sp.MatrixBase, right: sp.MatrixBase, *, seconds: float = 2.0) -> LinearSolution:
    """x with matrix * x = right, for a generically invertible (n, n) matrix and an (n, k) right-hand side.

    Exact over the field of the entries, in lowest terms and factors, while time lasts; then by SymPy's adjugate,
    correct but not simplified.
    """
    claim = "the matrix is generically invertible"
    rank = generic_rank(matrix, seconds=seconds / 4)
    if rank.point is None:
        return LinearSolution(solution=None, determinant=sp.nan, verdict=rank.verdict)
    if rank.value < matrix.rows:
        make = Verdict.refuted if rank.verdict.status is Status.PROVED else Verdict.undecided
        verdict = make(claim, rank=rank.value, because=rank.verdict)
        return LinearSolution(solution=None, determinant=sp.S.Zero, verdict=verdict)
    verdict = Verdict.proved(claim, point=rank.point)
    exact = attempt_exactly(seconds, "Cramer's rule", _cramer, matrix, right)
    if exact.value is not None:
        return LinearSolution(solution=exact.value[0], determinant=exact.value[1], verdict=verdict)
    plain = attempt(seconds, "adjugate", _by_adjugate, matrix, right)
    if plain.value is None:
        return LinearSolution(solution=None, determinant=sp.nan, verdict=verdict)
    return LinearSolution(solution=plain.value[0], determinant=plain.value[1], verdict=verdict)


def _cramer(matrix: sp.MatrixBase, right: sp.MatrixBase) -> tuple[sp.Matrix, sp.Expr]:
    exact = polynomial_rows(matrix.row_join(right))
    ring = exact.ring
    size = matrix.rows
    solution = sp.zeros(size, right.cols)
    below = ring.one
    for k in range(right.cols):
        numerators, below = relation_with(ring, exact.rows, list(range(size)), size + k)
        for i, numerator in enumerate(numerators):
            solution[i, k] = _readable(ring, ring.make(numerator, below))
    return solution, _readable(ring, (below, ring.one))


def _by_adjugate(matrix: sp.MatrixBase, right: sp.MatrixBase) -> tuple[sp.Matrix, sp.Expr]:
    determinant = matrix.det(method="berkowitz")
    return matrix.adjugate() * right / determinant, determinant


def inverse(matrix: sp.MatrixBase, *, seconds: float = 3.0) -> LinearSolution:
    """The inverse of an (n, n) matrix."""
    return solve_linear(matrix, sp.eye(matrix.rows), seconds=seconds)


def inverse_last_column(matrix: sp.MatrixBase, *, seconds: float = 2.0) -> LinearSolution:
    """The last column of the inverse, (n, 1)."""
    return solve_linear(matrix, _last_unit_vector(matrix.rows), seconds=seconds)


def inverse_last_row(matrix: sp.MatrixBase, *, seconds: float = 2.0) -> LinearSolution:
    """The last row of the inverse, (1, n)."""
    found = solve_linear(matrix.T, _last_unit_vector(matrix.rows), seconds=seconds)
    row = None if found.solution is None else found.solution.T
    return LinearSolution(solution=row, determinant=found.determinant, verdict=found.verdict)


def _last_unit_vector(size: int) -> sp.Matrix:
    vector = sp.zeros(size, 1)
    vector[size - 1] = 1
    return vector
