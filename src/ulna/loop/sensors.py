"""What stands between a plant's output and the number a controller reads: noise, then steps."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ulna.base import SimulationError


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantiser:
    """y ↦ step · round(y / step), half a step rounded up, then limited to [lower, upper].

    Args:
        step: SI. lower, upper: what the converter can show, SI.

    Examples:
        >>> ulna.Hardware(period=1e-3, sensors=ulna.Quantiser(step=2 * np.pi / 4096)).period
        0.001
    """

    step: float
    lower: float = -math.inf
    upper: float = math.inf

    def __post_init__(self) -> None:
        if not (0 < self.step < math.inf):
            raise SimulationError(f"Quantiser(step={self.step})", "the step must be a positive number.")
        if not (self.lower < self.upper):
            raise SimulationError("Quantiser", f"the lower end {self.lower} is not below the upper end {self.upper}.")

    @classmethod
    def encoder(cls, *, bits: int, turn: float = 2 * math.pi) -> Quantiser:
        """An encoder of 2^bits codes a turn; it counts turns. turn: SI."""
        return cls(step=turn / 2 ** _positive(bits))

    @classmethod
    def converter(cls, *, bits: int, lower: float, upper: float) -> Quantiser:
        """An analogue-to-digital converter of 2^bits codes from lower to upper, SI."""
        return cls(step=(upper - lower) / (2 ** _positive(bits) - 1), lower=lower, upper=upper)


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasurementNoise:
    """Independent Gaussian noise of each sample. std: SI; the seed is the loop's.

    Examples:
        >>> ulna.Hardware(period=1e-3, noise=ulna.MeasurementNoise(std=0.002)).noise
        MeasurementNoise(std=0.002)
    """

    std: float

    def __post_init__(self) -> None:
        if not (0 <= self.std < math.inf):
            raise SimulationError(f"MeasurementNoise(std={self.std})", "expected 0 or a positive number.")


def _positive(bits: int) -> int:
    if not (1 <= bits <= 52):
        raise SimulationError(f"a quantiser of {bits} bits", "expected 1 to 52 bits.")
    return bits
