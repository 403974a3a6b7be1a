"""`FixedSteps`: how a loop with a processor is run."""

from __future__ import annotations

from dataclasses import dataclass

from ulna.base import SimulationError
from ulna.loop import Steps
from ulna.sim.sampled.gpu import Gpu


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedSteps:
    """Explicit Runge-Kutta steps of the plant between the samples; the controller runs as `Hardware` says.

    Args:
        number: steps for each stretch of constant input: a period, or its parts before and after a delay or pulse.
        order: 4, the classical step, or 2, the midpoint rule at half the price.
        bound: a run ends as blown up where the Euclidean norm of the plant's state (SI) reaches this.
        device: a `Gpu` that runs take place on instead of the processors.

    Raises:
        SimulationError: a setting out of its range.
    """

    number: int = 1
    order: int = 4
    bound: float = 1e12
    device: Gpu | None = None

    def __post_init__(self) -> None:
        _ = self.steps
        if not (self.bound > 0):
            raise SimulationError(f"FixedSteps(bound={self.bound})", "the bound must be positive.")

    @property
    def steps(self) -> Steps:
        """The plant's steps."""
        return Steps(number=self.number, order=self.order)
