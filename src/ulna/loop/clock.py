"""What a real clock does to the sampling instants."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ulna.base import SimulationError


@dataclass(frozen=True, slots=True, kw_only=True)
class Jitter:
    """Sample k happens at k · period + U(0, width): the controller starts late by a random time and does not know.

    Args:
        width: s, less than the period.

    Examples:
        >>> ulna.Hardware(period=1e-3, clock=ulna.Jitter(width=1e-4)).clock
        Jitter(width=0.0001)
    """

    width: float

    def __post_init__(self) -> None:
        if not (0 <= self.width < math.inf):
            raise SimulationError(f"Jitter(width={self.width})", "expected a time of 0 s or more.")


@dataclass(frozen=True, slots=True, kw_only=True)
class MissedSamples:
    """Each sample is missed with a probability: the controller does not run, its output and memory stay.

    Args:
        probability: of one sample, independent of the others.

    Examples:
        >>> ulna.Hardware(period=1e-3, clock=ulna.MissedSamples(probability=0.01)).clock
        MissedSamples(probability=0.01)
    """

    probability: float

    def __post_init__(self) -> None:
        if not (0 <= self.probability < 1):
            raise SimulationError(f"MissedSamples(probability={self.probability})", "expected a number in [0, 1).")
