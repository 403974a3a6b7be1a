"""Scrambled Sobol points by their numbers."""

from __future__ import annotations

import threading
from functools import lru_cache

import numpy as np

from ulna.campaign.errors import CampaignError

SOBOL_BITS = 30
"""Resolution of the points, and logarithm of how many there are at most."""


class SobolSequence:
    """SciPy's engine with a mark of how far it is: batches are mostly asked for in order, and going back begins anew.

    Args:
        width: number of coordinates. seed: of the scrambling.
    """

    def __init__(self, width: int, seed: int) -> None:
        from scipy.stats import qmc

        self._engine = qmc.Sobol(width, bits=SOBOL_BITS, rng=np.random.default_rng(seed))
        self._at = 0
        self._lock = threading.Lock()

    def points(self, first: int, last: int) -> np.ndarray:
        """(last − first, width) points of the sequence."""
        with self._lock:
            if first < self._at:
                self._engine.reset()
                self._at = 0
            if first > self._at:
                self._engine.fast_forward(first - self._at)
            self._at = last
            if first or last == 1:
                return self._engine.random(last - first)
            # SciPy warns when the first call draws no power of two; the sequence does not care.
            return np.concatenate([self._engine.random(1), self._engine.random(last - 1)])


@lru_cache(maxsize=4)
def _sequence(width: int, seed: int) -> SobolSequence:
    return SobolSequence(width, seed)


def check_points(width: int, count: int) -> None:
    """Refuse what Sobol's sequence does not have.

    Raises:
        CampaignError: more coordinates or more points than there are.
    """
    from scipy.stats import qmc

    if width > qmc.Sobol.MAXDIM:
        raise CampaignError("Sobol points", f"{width} dimensions, {qmc.Sobol.MAXDIM} are known.", "Use Random.")
    if count > 2**SOBOL_BITS:
        raise CampaignError("Sobol points", f"{count} asked for, there are {2**SOBOL_BITS}.", "Use Random.")


def sobol_points(width: int, seed: int, first: int, last: int) -> np.ndarray:
    """(last − first, width) points number first ≤ k < last, between 0 and 1, neither included."""
    # In the middle of their cells they keep clear of 0, whose quantile may be infinite.
    return _sequence(width, seed).points(first, last) + 2.0 ** -(SOBOL_BITS + 1)
