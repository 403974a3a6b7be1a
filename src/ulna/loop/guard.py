"""`Guard`: what a processor does where a number is not finite."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ulna.base import SimulationError
from ulna.loop.reaction import Hold, SafeOutput


@dataclass(frozen=True, slots=True, kw_only=True)
class Guard:
    """A sample with a value that is not finite counts as a fault: the memory stays, the command is held or replaced.

    A measured value that is not finite is ignored, as if the sample had been missed. A limiter alone would hand its
    bound on forever: NaN fails every comparison.

    Args:
        reaction: what is commanded instead of a command that is not finite. With `SafeOutput` a simulated run goes on;
            with `Hold` it ends there.
        largest: a command of this size or more counts as not finite.

    Examples:
        >>> guard = ulna.Guard(reaction=ulna.SafeOutput(0.0), largest=1e3)
        >>> ulna.Hardware(period=1e-3, guard=guard).guard.largest
        1000.0
    """

    reaction: Hold | SafeOutput = field(default_factory=Hold)
    largest: float = math.inf

    def __post_init__(self) -> None:
        if not (self.largest > 0):
            raise SimulationError(f"Guard(largest={self.largest})", "the bound must be positive.")
