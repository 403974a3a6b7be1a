"""Σ |Aᵏ| of a stable matrix, with everything that rounding and cutting off can add."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_SMALL = 1e-3
"""Size of the last power looked at: what is left of the sum is this part of it."""
MOST = 100_000
"""Powers looked at."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DecaySums:
    """Upper bounds, entry by entry.

    Attributes:
        powers: how many were added up. total: (n, n) of Σ |Aᵏ|. largest: (n, n) of each entry over all k.
        pushed: (n, m) of Σ |Aᵏ N|.
    """

    powers: int
    total: np.ndarray
    largest: np.ndarray
    pushed: np.ndarray


def decay_sums(A: np.ndarray, N: np.ndarray) -> DecaySums | None:
    """The sums of a matrix (n, n) and columns (n, m), both exact; None where the powers do not become small.

    With Âₖ in floating point, |A Âₖ − Âₖ₊₁| ≤ E for all k, so |Aᵏ − Âₖ| ≤ S E with S the sum of K powers, and
    S ≤ Ŝ + K S E, S ≤ Ŝ (1 − K E)⁻¹. The whole sum Σ obeys Σ ≤ S + Σ |Aᴷ|, the largest entries X ≤ X̂ + X |Aᴷ|.
    """
    n = len(A)
    power, total, largest, pushed = np.eye(n), np.zeros((n, n)), np.eye(n), np.zeros(N.shape)
    for k in range(MOST):
        size = np.abs(power)
        if not np.isfinite(size).all():
            return None
        if k % 16 == 0 and k > n and size.sum(axis=1).max() < _SMALL:
            break
        total += size
        largest = np.maximum(largest, size)
        pushed += np.abs(power @ N)
        power = A @ power
    else:
        return None
    # Twice what a product of n terms can be off by.
    error = 4 * (n + 2) * np.finfo(float).eps * (np.abs(A) @ largest + 1e-300)
    first = _divided(total * (1 + 1e-9), k * error)
    if first is None:
        return None
    off = first @ error
    last = np.abs(power) + off
    whole, most = _divided(first, last), _divided(largest + off, last)
    if whole is None or most is None:
        return None
    along = np.abs(N)
    more = k * off @ along + whole @ (np.abs(power @ N) + off @ along)
    return DecaySums(powers=k, total=whole, largest=most, pushed=(pushed + more) * (1 + 1e-9))


def _divided(left: np.ndarray, small: np.ndarray) -> np.ndarray | None:
    """A bound of left (1 − small)⁻¹ = left + left small + left small² + …, all entries positive."""
    norm = float(small.sum(axis=1).max())
    if not norm < 0.5:
        return None
    found = left + left @ small + (left.sum(axis=1) * norm**2 / (1 - norm) * 1.0)[:, None]
    return found * (1 + 1e-9)
