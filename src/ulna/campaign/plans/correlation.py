"""Correlated quantities from independent ones: the Gaussian copula."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ulna.campaign.errors import CampaignError

ROUNDING = 1e-4
"""Numbers rounded to some digits may leave a matrix of correlations as slightly indefinite as this."""

Pairs = Sequence[tuple[str, str, float]]


def checked(
    pairs: Sequence[tuple[str, str, object]], names: Sequence[str], what: str
) -> tuple[tuple[str, str, float], ...]:
    """The pairs in floats.

    Raises:
        CampaignError: a name that does not vary, a pair twice, numbers that no quantities can have together.
    """
    found, seen = [], set()
    for first, second, number in pairs:
        value = float(number)  # type: ignore[arg-type]
        asked = f"correlation of '{first}' with '{second}' in {what}"
        for name in (first, second):
            if name not in names:
                raise CampaignError(asked, f"'{name}' does not vary.", f"Varied: {', '.join(names)}.")
        if first == second or frozenset((first, second)) in seen or not -1.0 <= value <= 1.0:
            found = f"{value:g}: expected each pair once, with a correlation between -1 and 1."
            raise CampaignError(asked, found, "Give (name, name, number).")
        seen.add(frozenset((first, second)))
        found.append((str(first), str(second), value))
    root(found, names, what)
    return tuple(found)


def root(pairs: Pairs, names: Sequence[str], what: str) -> np.ndarray:
    """(n, n) lower triangle L with L Lᵀ the correlations, each row of length one.

    Raises:
        CampaignError: for numbers that no quantities can have together.
    """
    count = len(names)
    matrix, found = np.eye(count), np.zeros((count, count))
    for first, second, number in pairs:
        a, b = names.index(first), names.index(second)
        matrix[a, b] = matrix[b, a] = number
    for j in range(count):
        left = float(matrix[j, j] - found[j, :j] @ found[j, :j])
        if left < -ROUNDING:
            raise CampaignError(
                f"correlations of {', '.join(names)} in {what}",
                "no quantities can have them together: their matrix is not positive.",
                "Take them all from one fit.",
            )
        found[j, j] = math.sqrt(max(left, 0.0))
        below = matrix[j + 1 :, j] - found[j + 1 :, :j] @ found[j, :j]
        found[j + 1 :, j] = below / found[j, j] if left > ROUNDING * ROUNDING else 0.0
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def correlated(points: np.ndarray, triangle: np.ndarray, half: float) -> np.ndarray:
    """(N, n) points of the unit cube whose normal scores have the correlations, from independent ones.

    Args:
        points: (N, n) independent ones. triangle: as `root` gives. half: how near points may come to 0 and 1.

    Reference:
        M. Cario, B. Nelson, "Modeling and generating random vectors with arbitrary marginal distributions and
        correlation matrix", Northwestern University 1997.
    """
    from scipy.special import ndtr, ndtri

    scores = ndtri(points)
    # Sums written out: a product of matrices rounds otherwise when a batch has another length.
    columns = [
        sum((triangle[j, k] * scores[:, k] for k in range(1, j + 1)), triangle[j, 0] * scores[:, 0])
        for j in range(len(triangle))
    ]
    mixed = [points[:, j] if triangle[j, j] == 1.0 else ndtr(column) for j, column in enumerate(columns)]
    return np.clip(np.stack(mixed, axis=1), half, 1.0 - half)
