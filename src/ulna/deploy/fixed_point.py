"""`FixedPoint`: what to compute in integers, over which ranges."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from ulna.deploy.errors import DeployError


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedPoint:
    """Integers of 32 bits, each value with a binary point of its own that interval analysis chooses.

    Inputs and memory are limited to their ranges; over these no value in between can overflow, and one that has no
    bounds is refused. Numbers are never infinite or NaN, so there is nothing for a `Guard` to do.

    Args:
        factor: bits of the factors of a product: 32 (Q31), or 16 (Q15) where a multiplication of 16 bits is all that
            the processor has; sums and memory have 32 bits in both.
        ranges: SI, (lower, upper) by name of measured signals, references, driven inputs and states of the controller.
            Left out: the range that the signal declares, the saturation of an input, else four times what a rehearsed
            run from near the operating point needs, which may be too little for others.
    """

    factor: int = 32
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.factor not in (16, 32):
            raise DeployError(f"FixedPoint(factor={self.factor})", "expected 32 or 16 bits.")
        for name, (low, high) in self.ranges.items():
            if not (-math.inf < low < high < math.inf):
                raise DeployError(
                    f"the range of '{name}'",
                    f"{low:g} to {high:g} is not a finite range.",
                    "Give a finite lower end and a larger finite upper end.",
                )

    @property
    def name(self) -> str:
        """Q31 or q15, as on the command line."""
        return f"q{self.factor - 1}"
