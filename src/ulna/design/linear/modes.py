"""Modes of dx' = A dx + B du: which the inputs move, which they leave alone, and how fast they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ulna.base import DesignError
from ulna.design.linear.linear_plant import LinearPlant, as_numbers

_RANK = 1e-9
"""Relative size below which a direction counts as not reached, after balancing."""
_STILL = 1e-7
"""Beside the fastest mode: real parts below this count as zero, roots of several equal ones being no better known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mode:
    """An eigenvalue in 1/s that inputs do not move (or outputs do not show), and the states that make it up."""

    value: complex
    states: tuple[str, ...]

    @property
    def stable(self) -> bool:
        """Whether it dies out by itself."""
        return self.value.real < 0

    def __str__(self) -> str:
        value = f"{self.value:.4g}" if self.value.imag else f"{self.value.real:.4g}"
        return f"{value} 1/s (in {', '.join(self.states)})"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Split:
    """Balanced coordinates w = T⁻¹ x in which the first r are what the inputs reach (Kalman's decomposition).

    Attributes:
        T, inverse: (n, n). A: (n, n), zero below the first r rows and columns; B: (n, m), zero below row r.
        reached: r. fixed: the modes that no input moves.
    """

    T: np.ndarray
    inverse: np.ndarray
    A: np.ndarray
    B: np.ndarray
    reached: int
    fixed: tuple[Mode, ...]


def split(A: np.ndarray, B: np.ndarray, names: Sequence[str]) -> Split:
    """What the inputs reach, by an orthonormal basis of B, AB, A²B, … in balanced coordinates.

    For what outputs show hand over Aᵀ and Cᵀ.

    Args:
        A: (n, n); B: (n, m). names: (n,) of the states.

    Reference:
        P. Van Dooren, IEEE Trans. Automatic Control 26 (1981), "The generalized eigenstructure problem".
    """
    n = len(A)
    balanced, scale = _balanced(A)
    fields = B / scale[:, None]
    fields = fields / np.maximum(np.linalg.norm(fields, axis=0), 1e-300)
    size = max(float(np.linalg.norm(balanced)), 1e-300)
    basis = np.zeros((n, 0))
    new = _directions(basis, fields, 1.0)
    while new.shape[1] and basis.shape[1] < n:
        basis = np.hstack([basis, new])
        new = _directions(basis, balanced @ new, size)
    r = basis.shape[1]
    whole = np.linalg.qr(np.hstack([basis, np.eye(n)]))[0] if r < n else basis
    whole[:, :r] = basis
    T, inverse = scale[:, None] * whole, whole.T / scale
    moved, pushed = inverse @ A @ T, inverse @ B
    moved[r:, :r], pushed[r:] = 0.0, 0.0
    return Split(T=T, inverse=inverse, A=moved, B=pushed, reached=r, fixed=_fixed(moved, (r, whole), names))


def _directions(basis: np.ndarray, fields: np.ndarray, size: float) -> np.ndarray:
    """(n, k) an orthonormal basis of what the fields add to the span of the basis."""
    rest = fields
    for _ in range(2):
        rest = rest - basis @ (basis.T @ rest)
    u, s, _ = np.linalg.svd(rest, full_matrices=False)
    return u[:, s > _RANK * size]


def _fixed(A: np.ndarray, reached: tuple[int, np.ndarray], names: Sequence[str]) -> tuple[Mode, ...]:
    """The modes behind the first r balanced coordinates. reached: r and the orthonormal basis."""
    r, basis = reached
    values, left = np.linalg.eig(A[r:, r:].T)
    modes = []
    for value, vector in zip(_rounded(values, float(np.linalg.norm(A))), left.T, strict=True):
        parts = np.abs(basis[:, r:] @ vector)
        inside = tuple(name for name, part in zip(names, parts, strict=True) if part > 0.2 * max(parts))
        modes.append(Mode(value=value, states=inside))
    return tuple(sorted(modes, key=lambda mode: -mode.value.real))


def _rounded(values: np.ndarray, size: float) -> list[complex]:
    """Eigenvalues of a matrix of this size with real and imaginary parts that are rounding errors put to zero."""
    least = _STILL * size
    return [complex(v.real if abs(v.real) > least else 0.0, v.imag if abs(v.imag) > least else 0.0) for v in values]


def require_stabilisable(found: Split, asked: str) -> None:
    """Refuse a mode that grows or stays and that no input moves.

    Raises:
        DesignError: naming it.
    """
    loose = [mode for mode in found.fixed if not mode.stable]
    if loose:
        raise DesignError(
            asked,
            f"no input moves the mode{'s' * (len(loose) > 1)} {'; '.join(map(str, loose))} of the linearisation.",
            "Add an input that reaches it, or choose another [operating_point].",
        )


def own_bandwidth(A: np.ndarray) -> float:
    """ω in rad/s after the plant's own pace: its fastest growing mode; three times its slowest where none grows.

    Where only modes at zero are, a chain of integrators has no pace of its own and ω is 1 rad/s.
    """
    found = np.linalg.eigvals(_balanced(A)[0])
    values = _rounded(found, float(np.abs(found).max()))
    growing, others = [abs(v) for v in values if v.real > 0], [abs(v) for v in values if v]
    if not others:
        return 1.0
    if growing:
        return max(growing)
    return 3.0 * min(others) if all(v.real < 0 for v in values) else min(others)


def _balanced(A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """D⁻¹ A D with rows and columns of like size, and the diagonal of D; SciPy is loaded only here."""
    from scipy.linalg import matrix_balance

    balanced, (scale, _) = matrix_balance(A, permute=False, separate=True)
    return balanced, scale


def holdable(linear: LinearPlant) -> tuple[int, ...]:
    """Places of the first outputs, at most one for each input, that constant inputs set one by one near the point.

    (A B; C D) has full row rank for them: the plant has no zero at 0 between inputs and these outputs.
    """
    A, B, C, D = (as_numbers(M) for M in (linear.A, linear.B, linear.C, linear.D))
    n, m = B.shape
    _, scale = _balanced(A)
    top = np.hstack([A * scale / scale[:, None], B / scale[:, None]])
    chosen: list[int] = []
    for k in range(len(C)):
        rows = [*chosen, k]
        whole = np.vstack([top, np.hstack([C[rows] * scale, D[rows]])])
        sizes = np.linalg.norm(whole, axis=1)
        if sizes.min() and np.linalg.matrix_rank(whole / sizes[:, None], tol=_RANK) == n + len(rows):
            chosen = rows
        if len(chosen) == m:
            break
    return tuple(chosen)
