"""Gains K of du = −K dx on a linear plant: poles placed, a quadratic cost, or the least effort for a pace."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp
from sympy.polys.matrices import DomainMatrix

from ulna.base import DesignError, UlnaWarning
from ulna.design.linear.linear_plant import as_numbers, as_rational
from ulna.design.linear.modes import Split, require_stabilisable, split


def placed(
    A: sp.ImmutableDenseMatrix, B: sp.ImmutableDenseMatrix, poles: Sequence[sp.Expr], names: Sequence[str], asked: str
) -> sp.ImmutableDenseMatrix:
    """(m, n) K that gives A − B K these eigenvalues.

    One input: Ackermann's formula, exact. Several: Tits and Yang's robust method, or, where a pole is asked for more
    often than there are inputs, one combination of the inputs (Heymann's lemma).

    Args:
        A: (n, n); B: (n, m), rational. poles: conjugates together; one for each mode that the inputs move.
        names: of the states. asked: for the error.

    Raises:
        DesignError: for a mode that grows and that no input moves, or another number of poles.

    Reference:
        M. Heymann, IEEE Trans. Automatic Control 13 (1968); A. Tits, Y. Yang, ibid. 41 (1996).
    """
    a, b = as_numbers(A), as_numbers(B)
    found = split(a, b, names)
    require_stabilisable(found, asked)
    if len(poles) != found.reached:
        fixed = "; ".join(map(str, found.fixed))
        why = f" (of {len(a)} modes {fixed} cannot be moved)" if fixed else ""
        count = f"{len(poles)} given, {found.reached} needed{why}."
        raise DesignError("poles", count, "Give one for each mode that can be moved.")
    if found.fixed:
        _warn_of_fixed(found, asked)
        r = found.reached
        K = _in_numbers(found.A[:r, :r], found.B[:r], poles) @ found.inverse[:r]
        return as_rational(K)
    if b.shape[1] == 1:
        return _ackermann(A, B, poles)
    numbers = [complex(p) for p in poles]
    most = max(sum(abs(p - q) <= 1e-9 * max(1.0, abs(p)) for q in numbers) for p in numbers)
    if most > np.linalg.matrix_rank(b):
        return _by_one_combination(A, B, poles)
    return as_rational(_in_numbers(found.A, found.B, poles) @ found.inverse)


def least_cost(
    A: sp.ImmutableDenseMatrix,
    B: sp.ImmutableDenseMatrix,
    weights: tuple[np.ndarray, np.ndarray],
    names: Sequence[str],
    asked: str,
) -> sp.ImmutableDenseMatrix:
    """(m, n) K = R⁻¹ Bᵀ P that minimises ∫ dxᵀ Q dx + duᵀ R du (`lqr` of other tools).

    Args:
        A: (n, n); B: (n, m). weights: diagonals of Q, nonnegative, and R, positive.
        names: of the states. asked: for the error.

    Raises:
        DesignError: for a mode that grows or stays and that no input moves, a mode that stays and costs nothing.
    """
    a, b = as_numbers(A), as_numbers(B)
    q, r = weights
    found = split(a, b, names)
    require_stabilisable(found, asked)
    free = [mode for mode in split(a.T, np.diag(np.sqrt(q)), names).fixed if not mode.value.real]
    if free:
        raise DesignError(
            asked,
            f"the weights leave the mode {free[0]} without cost, so nothing damps it.",
            f"Give {free[0].states[0]} a weight above zero.",
        )
    gain = _riccati(found.A, found.B, found.T.T @ np.diag(q) @ found.T, np.diag(r), asked) @ found.inverse
    if found.fixed:
        _warn_of_fixed(found, asked)
    return as_rational(gain)


def least_effort(
    A: sp.ImmutableDenseMatrix, B: sp.ImmutableDenseMatrix, bandwidth: float, names: Sequence[str], asked: str
) -> sp.ImmutableDenseMatrix:
    """(m, n) K of least ∫ e^{ωt} duᵀ du that makes dx e^{ωt/2} die out: every mode slower than ω/2 is mirrored at −ω/2.

    A mode at 0 goes to −ω, one at ω to −2ω, faster stable ones stay. It depends on no unit of a state; those of the
    inputs weigh alike.

    Args:
        A: (n, n); B: (n, m). bandwidth: ω in rad/s. names: of the states. asked: for the error.

    Raises:
        DesignError: for a mode that grows or stays and that no input moves.

    Reference:
        B. D. O. Anderson, J. B. Moore, Optimal Control: Linear Quadratic Methods, 1990, sections 3.5 and 7.2.
    """
    a, b = as_numbers(A), as_numbers(B)
    found = split(a, b, names)
    require_stabilisable(found, asked)
    r = found.reached
    inner, fields = found.A[:r, :r], found.B[:r]
    shift = bandwidth / 2.0
    while r and np.abs(np.linalg.eigvals(inner).real + shift).min() < 1e-3 * bandwidth:
        shift *= 1.01  # a mode on the mirror would stay where it is
    gain = _mirrored(inner + shift * np.eye(r), fields) @ found.inverse[:r]
    return as_rational(gain)


def _mirrored(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """(m, r) the gains of least ∫ uᵀu that make A stable: K = Bᵀ X⁻¹ on its growing part, A X + X Aᵀ = B Bᵀ there."""
    from scipy.linalg import schur, solve_continuous_lyapunov

    if not len(A):
        return np.zeros((B.shape[1], 0))
    S, Z, growing = schur(A.T, sort="rhp")
    if not growing:
        return np.zeros((B.shape[1], len(A)))
    part, fields = S[:growing, :growing].T, Z[:, :growing].T @ B
    X = solve_continuous_lyapunov(part, fields @ fields.T)
    return np.linalg.solve(X, fields).T @ Z[:, :growing].T


def _riccati(A: np.ndarray, B: np.ndarray, Q: np.ndarray, R: np.ndarray, asked: str) -> np.ndarray:
    from scipy.linalg import solve_continuous_are

    try:
        P = solve_continuous_are(A, B, (Q + Q.T) / 2, R)
    except (np.linalg.LinAlgError, ValueError) as error:
        hint = "Choose weights within some ten decades of each other."
        raise DesignError(asked, f"the Riccati equation has no solution in numbers ({error}).", hint) from None
    K = np.linalg.solve(R, B.T @ P)
    if len(A) and np.linalg.eigvals(A - B @ K).real.max() >= 0:
        raise DesignError(asked, "the Riccati equation was not solved in numbers.", "Choose other weights.")
    return K


def _in_numbers(A: np.ndarray, B: np.ndarray, poles: Sequence[sp.Expr]) -> np.ndarray:
    """(m, r) gains in numbers."""
    from scipy.signal import place_poles

    if B.shape[1] == 1 or len({complex(p) for p in poles}) < len(poles):
        place = _ackermann if B.shape[1] == 1 else _by_one_combination
        return as_numbers(place(_exactly(A), _exactly(B), poles))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # the last digits of how robust it is do not count
        return np.asarray(place_poles(A, B, [complex(p) for p in poles]).gain_matrix)


def _ackermann(
    A: sp.ImmutableDenseMatrix, b: sp.ImmutableDenseMatrix, poles: Sequence[sp.Expr]
) -> sp.ImmutableDenseMatrix:
    """(1, n) (0 … 0 1) (b, Ab, …)⁻¹ p(A), in rational numbers."""
    n = A.rows
    matrix, column = _exact(A), _exact(b)
    columns = [column]
    for _ in range(n - 1):
        columns.append(matrix * columns[-1])
    reached = columns[0].hstack(*columns[1:])
    last = DomainMatrix([[*([0] * (n - 1)), 1]], (1, n), sp.QQ).convert_to(sp.QQ)
    row = (reached.transpose().lu_solve(last.transpose())).transpose()
    polynomial = sp.Poly.from_list([1], sp.Dummy("s"))
    s = polynomial.gen
    polynomial = sp.Poly(sp.prod([s - p for p in poles]).expand(), s) if poles else polynomial
    total = row * 0
    for coefficient in polynomial.all_coeffs():
        total = total * matrix + row * sp.QQ.from_sympy(_real(coefficient))
    return sp.ImmutableDenseMatrix(total.to_Matrix())


def _by_one_combination(
    A: sp.ImmutableDenseMatrix, B: sp.ImmutableDenseMatrix, poles: Sequence[sp.Expr]
) -> sp.ImmutableDenseMatrix:
    """(m, n) K = F + w k: after a first feedback F one combination w of the inputs reaches every mode."""
    random = np.random.default_rng(0)
    size = float(np.linalg.norm(as_numbers(A))) or 1.0
    best: tuple[float, Any] | None = None
    for _ in range(20):
        F = _short(random.uniform(-1, 1, (B.cols, A.rows)) * 0.3 * size / max(1e-12, float(B.norm())))
        w = _short(random.uniform(-1, 1, (B.cols, 1)))
        inner, column = sp.ImmutableDenseMatrix(A - B * F), sp.ImmutableDenseMatrix(B * w)
        if split(as_numbers(inner), as_numbers(column), [""] * A.rows).reached < A.rows:
            continue
        K = sp.ImmutableDenseMatrix(F + w * _ackermann(inner, column, poles))
        effort = float(np.linalg.norm(as_numbers(K)))
        if best is None or effort < best[0]:
            best = (effort, K)
    if best is None:
        raise DesignError(
            "poles", "no combination of the inputs reaches every mode in numbers.", "Repeat each pole fewer times."
        )
    return best[1]


def _warn_of_fixed(found: Split, asked: str) -> None:
    modes = "; ".join(map(str, found.fixed))
    warnings.warn(f"{asked}: {modes} cannot be moved and stays.", UlnaWarning, stacklevel=4)


def _exactly(matrix: np.ndarray) -> sp.ImmutableDenseMatrix:
    return sp.ImmutableDenseMatrix(*matrix.shape, [sp.Rational(float(e)) for e in matrix.ravel()])


def _short(matrix: np.ndarray) -> sp.Matrix:
    return sp.Matrix(matrix).applyfunc(lambda e: sp.Rational(f"{float(e):.3g}"))


def _real(value: sp.Expr) -> sp.Rational:
    """A coefficient of a polynomial with conjugate roots, rational to 40 digits."""
    value = sp.re(value) if value.has(sp.I) else value
    return value if value.is_Rational else sp.Rational(str(sp.N(value, 40)))


def _exact(matrix: sp.ImmutableDenseMatrix) -> DomainMatrix:
    return DomainMatrix.from_Matrix(matrix).convert_to(sp.QQ)
