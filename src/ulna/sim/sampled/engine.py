"""`FixedSteps`: how a loop with a processor is run."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ulna.base import SimulationError
from ulna.loop import Steps
from ulna.sim.sampled.foreign import AbstractProcessor
from ulna.sim.sampled.gpu import Gpu


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedSteps:
    """Explicit Runge-Kutta steps of the plant between the samples; the controller runs as `Hardware` says.

    Args:
        number: steps for each stretch of constant input: a period, or its parts before and after a delay or pulse.
            None takes as many as each run needs, a power of two. A given number that is too small for a run ends it
            as `Outcome.COARSE`.
        within: how long a step may be over the plant's shortest time constant along the run (of a given number twice
            that): at order 4, 0.25 makes what is fast right to 1e-5 of its jump, 1 to a percent; 2.7 is unstable.
        order: 4, the classical step, or 2, the midpoint rule at half the price.
        bound: a run ends as blown up where the Euclidean norm of the plant's state (SI) reaches this.
        device: a `Gpu` that runs take place on instead of the processors.
        processor: what computes the controller's samples: compiled C, `ulna.deploy.Compiled(folder)`, say.

    Raises:
        SimulationError: a setting out of its range.

    Examples:
        >>> ulna.FixedSteps(number=8, order=4).number
        8
    """

    number: int | None = None
    within: float = 0.25
    order: int = 4
    bound: float = 1e12
    device: Gpu | None = None
    processor: AbstractProcessor | None = None

    def __post_init__(self) -> None:
        _ = self.steps
        if not (0 < self.within < math.inf):
            raise SimulationError(f"FixedSteps(within={self.within})", "it must be a positive number.")
        if not (self.bound > 0):
            raise SimulationError(f"FixedSteps(bound={self.bound})", "the bound must be positive.")
        if self.device is not None and self.processor is not None:
            raise SimulationError("FixedSteps(device=..., processor=...)", "a GPU has no other processor's code.")

    @property
    def steps(self) -> Steps:
        """The plant's steps."""
        return Steps(number=1 if self.number is None else self.number, order=self.order)
