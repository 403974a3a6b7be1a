"""How a simulation can end, and what to try then."""

from __future__ import annotations

from enum import Enum


class Outcome(Enum):
    """The result code of a simulation: what people read, and what helps.

    Examples:
        >>> ulna.Outcome.FINISHED.text
        'reached the final time'
        >>> ulna.Outcome.BLEW_UP.remedy
        'The loop is unstable from here; a smaller initial state or another design may hold it.'
    """

    FINISHED = ("reached the final time", "")
    BLEW_UP = (
        "the norm of the state passed the bound",
        "The loop is unstable from here; a smaller initial state or another design may hold it.",
    )
    NOT_FINITE = (
        "the state or its derivative stopped being a finite number",
        "Look for a division by zero, a root or a logarithm of a negative number on the way.",
    )
    AMBIGUOUS = (
        "more than one motion can follow from a jump of the right-hand side",
        "Start beside the surface, on the side that you mean, or write jumps that act together as one.",
    )
    STEP_LIMIT = (
        "the largest number of steps was used up before the final time",
        "Raise maximum_steps of the engine; if the system is stiff, engine=Implicit() takes long steps.",
    )
    STOPPED = ("a terminal event ended the run", "")
    EDGE = (
        "the motion reached the edge of where its right-hand side is defined",
        "The equations have no meaning beyond it: limit the argument, or end the run there by a terminal event.",
    )
    COARSE = (
        "the plant moved too fast for the steps between two samples",
        "Leave out FixedSteps(number=...), sample faster, or leave the fastest part out of the plant.",
    )

    ZENO = (
        "infinitely many switchings meet at one instant",
        "What follows is not known; a small dead band or hysteresis keeps them apart.",
    )

    @property
    def text(self) -> str:
        """The outcome in words."""
        return self.value[0]

    @property
    def remedy(self) -> str:
        """What to try."""
        return self.value[1]

    @property
    def finished(self) -> bool:
        """Whether the whole time span was simulated."""
        return self is Outcome.FINISHED
