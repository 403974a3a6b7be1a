"""`Crossing`: an event of one's own, an expression that passes through zero."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import sympy as sp

from ulna.base import SimulationError


class Direction(Enum):
    """Which passages count.

    Examples:
        >>> ulna.Direction.FALLING.value
        'from above zero to below'
    """

    RISING = "from below zero to above"
    FALLING = "from above zero to below"
    EITHER = "both ways"


@dataclass(frozen=True, slots=True, kw_only=True)
class Crossing:
    """The instants at which an expression passes through zero, to rounding.

    A touch of zero that turns back within 1e-10 of the run is no passage. At the jump of an input or of a velocity
    (`EndStop`) the expression may pass through zero without having the value zero.

    Args:
        name: what the event is called.
        expression: in states, inputs, outputs, parameters and definitions of the system and in the time `t`; a SymPy
            expression or a formula as text.
        direction: which passages count.
        terminal: the run ends at the first one, with `Outcome.STOPPED`.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> top = ulna.Crossing(name="top", expression="s", direction=ulna.Direction.FALLING)
        >>> run = ulna.simulate(spring, [0, 1], np.linspace(0, 5, 101), events=[top])
        >>> [round(event.time, 3) for event in run.events]
        [0.728, 3.895]
    """

    name: str
    expression: sp.Expr | str
    direction: Direction = Direction.EITHER
    terminal: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.expression, sp.Expr | str):
            raise SimulationError(
                f"Crossing(name='{self.name}')",
                f"its expression is a {type(self.expression).__name__}.",
                "Give a SymPy expression or a formula as text.",
            )

    def counts(self, direction: int) -> bool:
        """Whether a passage upwards (1) or downwards (−1) is meant."""
        return self.direction is Direction.EITHER or (direction > 0) == (self.direction is Direction.RISING)
