"""`Implicit`: how a stiff system is integrated in continuous time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib.util import find_spec

from ulna.base import SimulationError

EXTRA = "stiff"
"""The extra that brings the solver."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Implicit:
    """Integration by backward differentiation of variable order and step (CVODE of SUNDIALS), for stiff systems.

    Its steps follow the slow motion, however fast what has died away would be. Limits, end stops, jumps, branch points
    and events are met as in `Taylor` runs. A plant that `Taylor` finds stiff is handed over to it by itself where the
    extra `stiff` is installed.

    Args:
        tolerance: of each step, relative to each state, and to a millionth of the largest value that it takes during
            the run; the error of a run is some hundred times as much.
        bound: the run ends as blown up where the Euclidean norm of the state (SI) reaches this.
        maximum_steps: the run ends with `Outcome.STEP_LIMIT` after so many steps, per stretch between input jumps.

    Raises:
        SimulationError: a setting out of its range.

    Reference:
        A. C. Hindmarsh et al., "SUNDIALS: Suite of nonlinear and differential/algebraic equation solvers", ACM
        Transactions on Mathematical Software 31 (2005), 363–396.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> run = ulna.simulate(spring, [1, 0], np.linspace(0, 5, 11), engine=ulna.Implicit(tolerance=1e-8))
        >>> run.outcome.text
        'reached the final time'
    """

    tolerance: float = 1e-9
    bound: float = 1e12
    maximum_steps: int = 1_000_000

    def __post_init__(self) -> None:
        if not (1e-14 <= self.tolerance <= 1e-2):
            raise SimulationError(
                "tolerance of Implicit()", f"{self.tolerance} is not between 1e-14 and 0.01.", "1e-9 is usual."
            )
        if not (self.bound > 0 and math.isfinite(self.bound)):
            raise SimulationError("bound of Implicit()", f"{self.bound} is not a positive finite number.")
        if self.maximum_steps < 1:
            raise SimulationError("maximum_steps of Implicit()", f"{self.maximum_steps} is less than one.")


def implicit_available() -> bool:
    """Whether the solver is installed."""
    return find_spec("sksundae") is not None
