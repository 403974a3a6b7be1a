"""`Taylor`: how a system is integrated in continuous time."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ulna.base import SimulationError


@dataclass(frozen=True, slots=True, kw_only=True)
class Taylor:
    """Integration by Taylor series of adaptive order and step (heyoka), exact to rounding where the plant allows it.

    What is promised of a step's error: it is below the tolerance times the size of each state, the largest value that
    the state takes during the run, be that 1e-20 or 1e9. States whose sizes lie within a factor of 1000 of each other
    and of 1 are held to the largest of them. Others are found after a first attempt and divided by powers of two for
    a second one, which costs as much again; a state of rounding errors is such a one, too.

    Jumps in the right-hand side (limits, `Abs`, `Piecewise`, …), saturation and end stops of the loop are located to
    rounding; the series of a step knows one side of them only. Contact with an end stop, rest at it and release are
    found; rebounds that would fly for less than 1e-9 of the run or rise by less than 1e-14 of the bound count as rest.

    Args:
        tolerance: relative size of the first neglected term of each step; 1e-13 keeps the global error of a stable
            loop below 1e-9 with a wide margin.
        bound: the run ends as blown up where the Euclidean norm of the state (SI) reaches this.
        maximum_steps: the run ends with `Outcome.STEP_LIMIT` after so many steps, per stretch between input jumps.
        optimise: compile for speed (a run 1.6 times faster, the first one 0.1 s later). Compiled loops are kept on
            disk by heyoka.
        compact: compile to loops instead of straight code, which large systems need; by default above 12 states.

    Raises:
        SimulationError: a setting out of its range.

    Reference:
        F. Biscani, D. Izzo, "Revisiting high-order Taylor methods for astrodynamics and celestial mechanics",
        Monthly Notices of the Royal Astronomical Society 504 (2021), 2614–2628.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> run = ulna.simulate(spring, [1, 0], np.linspace(0, 5, 11), engine=ulna.Taylor(tolerance=1e-10))
        >>> run.outcome.text
        'reached the final time'
    """

    tolerance: float = 1e-13
    bound: float = 1e12
    maximum_steps: int = 200_000
    optimise: bool = True
    compact: bool | None = None

    def __post_init__(self) -> None:
        if not (2.2e-16 <= self.tolerance <= 1e-2):
            raise SimulationError(
                "tolerance of Taylor()", f"{self.tolerance} is not between 2.2e-16 and 0.01.", "1e-13 is usual."
            )
        if not (self.bound > 0 and math.isfinite(self.bound)):
            raise SimulationError("bound of Taylor()", f"{self.bound} is not a positive finite number.")
        if self.maximum_steps < 1:
            raise SimulationError("maximum_steps of Taylor()", f"{self.maximum_steps} is less than one.")
