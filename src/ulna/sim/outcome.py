"""How a simulation can end."""

from __future__ import annotations

from enum import Enum


class Outcome(Enum):
    """The result code of a simulation; the value is what people read."""

    FINISHED = "reached the final time"
    BLEW_UP = "the norm of the state passed the bound"
    NOT_FINITE = "the state or its derivative stopped being a finite number"
    SLIDING = "a jump pushes the state back from both sides"
    STEP_LIMIT = "the largest number of steps was used up before the final time"
    STOPPED = "a terminal event ended the run"

    @property
    def text(self) -> str:
        """The outcome in words."""
        return self.value

    @property
    def finished(self) -> bool:
        """Whether the whole time span was simulated."""
        return self is Outcome.FINISHED
