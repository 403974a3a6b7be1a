"""`Watcher`: something that a run with events looks out for."""

from __future__ import annotations

from abc import ABC, abstractmethod

from ulna.sim.continuous.course import Course
from ulna.sim.event import Event


class Watcher(ABC):
    """Something that is looked out for by some event functions, given by their numbers."""

    def __init__(self, functions: range) -> None:
        self.functions = functions

    @abstractmethod
    def begin(self, at: Course) -> None:
        """Set sides and modes; an input may have jumped since the stretch before."""

    @abstractmethod
    def crossed(self, at: Course, function: int) -> None:
        """Its function is about to change sides."""

    def decide(self, at: Course) -> None:  # noqa: B027
        """After an event: look again at what stood at zero, as a velocity does at an end stop."""

    def at_edge(self, at: Course, function: int) -> bool:  # noqa: ARG002
        """Whether an event that was found here means that it meets the edge of its domain, whichever function it is."""
        return False

    def named(self, function: int) -> str:  # noqa: ARG002
        """What it is that one of its functions tells of."""
        return ""

    def jumped(self, at: Course) -> None:  # noqa: B027
        """The state was moved by hand: decide jumps anew."""

    def last(self) -> tuple[Event, ...]:
        """What can be told only when the run has reached its end."""
        return ()
