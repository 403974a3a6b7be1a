"""`Yardstick`: how large each state of a run is, so that its error is measured beside its own size."""

from __future__ import annotations

import numpy as np

UNEVEN = 1024.0
"""States that differ by less than this, and from 1, are of one size: the integrator compares them with the largest."""

PASSES = 16
"""Attempts at most; each brings the smallest states about 13 decades closer to their true sizes."""

PARTS = np.linspace(0.0, 1.0, 9)
"""Parts of a run after which sizes are looked at where the run itself has no more instants."""

MANY = 32
"""Rows of a run that are looked at, about."""


class Yardstick:
    """The sizes of the states so far, and what they are divided by inside the integrator.

    An integrator holds the error of a step below its tolerance times the largest state, or times 1 if that is more.
    Where some state stays far below both, the run is done again in states divided by their sizes. Divisors are powers
    of two, which no rounding sees.

    Attributes:
        sizes: (n,) the largest absolute values. divisors: (n,) powers of two; None while all of them are 1.
    """

    __slots__ = ("_attempts", "divisors", "sizes")

    def __init__(self) -> None:
        self.sizes: np.ndarray | float = 0.0
        self.divisors: np.ndarray | None = None
        self._attempts = 0

    def fits(self, states: np.ndarray) -> bool:
        """Take in states of a run, (N, n); whether the present divisors will do, else they change."""
        # An attempt that fails says little of sizes: it is forgotten but for the divisors.
        sizes = np.fmax(self.sizes, np.maximum.reduce(np.abs(states[:: len(states) // MANY + 1])))
        listed = (sizes if self.divisors is None else sizes / self.divisors).tolist()
        largest = max(1.0, *listed)
        if largest > UNEVEN * min(listed) and self._attempts < PASSES:
            moving = [size for size in listed if size > 0.0]
            if moving and largest > UNEVEN * min(moving) and np.isfinite(sizes).all():
                self.divisors = powers_of_two(sizes)
                self._attempts += 1
                return False
        self.sizes, self._attempts = sizes, 0
        return True


def misfits(sizes: np.ndarray) -> np.ndarray:
    """(N,) whether the sizes of N runs, (n, N) in units of their divisors, are too uneven."""
    largest = np.maximum(1.0, sizes.max(axis=0))
    smallest = np.where(sizes > 0.0, sizes, np.inf).min(axis=0)
    # Written so that a run that is not finite fits; none of its sizes is known.
    return (largest > UNEVEN * smallest) & np.isfinite(largest)


def powers_of_two(sizes: np.ndarray) -> np.ndarray:
    """The power of two just below each size; 1 for a size of 0."""
    _, exponents = np.frexp(sizes)
    # Reciprocals are used too: neither may leave the range of normal numbers.
    return np.where(sizes > 0.0, np.ldexp(1.0, np.clip(exponents - 1, -1000, 1000)), 1.0)


def looked_at(times: np.ndarray) -> np.ndarray:
    """(M,) the times, and more between the first and the last if they are few."""
    if len(times) >= len(PARTS):
        return times
    return np.union1d(times, times[0] + (times[-1] - times[0]) * PARTS[1:-1])
