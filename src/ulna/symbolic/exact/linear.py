"""Linear equations whose coefficients are expressions: span, coefficients, kernel, solution, inverse."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ulna.base import Status, Verdict
from ulna.symbolic.exact.budget import attempt
from ulna.symbolic.exact.embed import attempt_exactly
from ulna.symbolic.exact.field import Element, Field, Polynomial
from ulna.symbolic.exact.minors import polynomial_rows, relation_with
from ulna.symbolic.exact.rank import Rank, extends_exactly, generic_rank
from ulna.symbolic.exact.sample import SEED


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


def in_span(
    vector: sp.MatrixBase,
    columns: Sequence[sp.MatrixBase] | sp.MatrixBase,
    *,
    seconds: float = 2.0,
    seed: int = SEED,
    near: Mapping[sp.Basic, sp.Expr] | None = None,
) -> Verdict:
    """Whether the vector is a combination, with functions as coefficients, of the columns at almost every point.

    Args:
        vector: (n, 1).
        columns: (n, k), or k matrices of shape (n, 1).
        seconds: s, time for the proof and the coefficients.
        seed: of the random points.
        near: values near which to evaluate.

    Returns:
        A verdict; if it holds, its evidence has `coefficients` (k expressions, where time sufficed); if it fails,
        `point`, `rank` of the columns and `minor_rows` of a minor with the vector that does not vanish there.
    """
    basis = as_matrix(columns, vector.rows)
    together = basis.row_join(vector)
    rank = generic_rank(basis, seconds=seconds / 4, seed=seed, near=near)
    larger = generic_rank(together, seconds=0, seed=seed, near=near)
    claim = "the vector lies in the span of the columns"
    if rank.point is None or larger.point is None:
        return Verdict.undecided(claim, tried="no random point where every entry is real and finite")
    if larger.value > rank.value:
        evidence = {"point": larger.point, "rank": rank.value, "minor_rows": larger.rows}
        return Verdict.refuted(claim, rank_status=rank.verdict.status, **evidence)
    exact = attempt_exactly(seconds, "coefficients", _coefficients, together, rank)
    if exact.value is None:
        return Verdict.supported(claim, rank=rank.value, no_proof=exact.reason)
    coefficients, proved = exact.value
    make = Verdict.proved if proved else Verdict.supported
    return make(claim, rank=rank.value, coefficients=coefficients)


def coefficients(
    vector: sp.MatrixBase, columns: Sequence[sp.MatrixBase] | sp.MatrixBase, *, seconds: float = 2.0
) -> tuple[sp.Expr, ...] | None:
    """c with sum_k c_k column_k = vector, zero for columns that the others span; None if there is none or no time."""
    verdict = in_span(vector, columns, seconds=seconds)
    return verdict.evidence.get("coefficients") if verdict.holds else None


def as_matrix(columns: Sequence[sp.MatrixBase] | sp.MatrixBase, height: int) -> sp.Matrix:
    """The columns side by side; (height, 0) if there are none."""
    if isinstance(columns, sp.MatrixBase):
        return sp.Matrix(columns)
    return sp.Matrix.hstack(*columns) if columns else sp.zeros(height, 0)


def _coefficients(together: sp.MatrixBase, rank: Rank) -> tuple[tuple[sp.Expr, ...], bool]:
    exact = polynomial_rows(together)
    ring = exact.ring
    extra = together.cols - 1
    proved = extends_exactly(exact, rank.rows, rank.columns, extra)
    numerators, denominator = relation_with(ring, [exact.rows[i] for i in rank.rows], rank.columns, extra)
    found = dict.fromkeys(range(extra), sp.S.Zero)
    for column, numerator in zip(rank.columns, numerators, strict=True):
        found[column] = _readable(ring, ring.make(numerator, denominator))
    return tuple(found.values()), proved


def _readable(ring: Field, element: Element) -> sp.Expr:
    return sp.S.Zero if element[0].is_zero() else ring.factored(element)


def nullspace(matrix: sp.MatrixBase, *, seconds: float = 2.0) -> tuple[sp.Matrix, ...] | None:
    """A basis of the generic kernel: columns v with matrix * v = 0, without denominators or common factors.

    One vector for each dependent column, which enters it with a coefficient that is not zero. None if there was
    not enough time or no exact form.
    """
    rank = generic_rank(matrix, seconds=seconds / 4)
    if rank.point is None:
        return None
    exact = attempt_exactly(seconds, "kernel", _nullspace, matrix, rank)
    return exact.value


def _nullspace(matrix: sp.MatrixBase, rank: Rank) -> tuple[sp.Matrix, ...]:
    exact = polynomial_rows(matrix)
    ring = exact.ring
    vectors: list[sp.Matrix] = []
    for extra in range(matrix.cols):
        if extra in rank.columns:
            continue
        numerators, denominator = relation_with(ring, [exact.rows[i] for i in rank.rows], rank.columns, extra)
        entries = [ring.none] * matrix.cols
        entries[extra] = denominator
        for column, numerator in zip(rank.columns, numerators, strict=True):
            entries[column] = -numerator
        vectors.append(sp.Matrix([_readable(ring, (one, ring.one)) for one in _primitive(ring, entries)]))
    return tuple(vectors)


def _primitive(ring: Field, entries: list[Polynomial]) -> list[Polynomial]:
    places = [k for k, one in enumerate(entries) if not one.is_zero()]
    reduced = ring.coprime(ring.without_common_roots([entries[k] for k in places]))
    if int(reduced[-1].leading_coefficient()) < 0:
        reduced = [-one for one in reduced]
    result = list(entries)
    for place, one in zip(places, reduced, strict=True):
        result[place] = one
    return result


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
