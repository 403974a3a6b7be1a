"""`Settling`: the instant from which an output stays close to its target."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ulna.base import SimulationError
from ulna.sim.figures import BAND


@dataclass(frozen=True, slots=True, kw_only=True)
class Settling:
    """The last entry of an output into the band |y − target| ≤ fraction · |target − y(0)|, to rounding.

    A run that does not end within the band, never leaves it or starts on the target has no such event.

    Args:
        output: name of the output, or of a state. target: SI. fraction: half-width of the band, part of the way.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> run = ulna.simulate(spring, [1, 0], np.linspace(0, 60, 601), events=[ulna.Settling(output="y")])
        >>> [round(event.time, 3) for event in run.events]
        [14.657]
    """

    output: str
    target: float = 0.0
    fraction: float = BAND

    def __post_init__(self) -> None:
        if not math.isfinite(self.target):
            raise SimulationError(f"Settling(output='{self.output}')", f"its target is {self.target}.")
        if not (0.0 < self.fraction < 1.0):
            raise SimulationError(
                f"Settling(output='{self.output}')", f"the fraction {self.fraction} does not lie between 0 and 1."
            )
