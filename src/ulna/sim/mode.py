"""`Mode`: a span of a run during which the motion stays on the same surfaces."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ulna.sim.event import Event, EventKind


@dataclass(frozen=True, slots=True, kw_only=True)
class Mode:
    """A span of a run between two changes of what is held.

    Attributes:
        start, end: s. held: the surfaces at which a jump of the right-hand side holds the motion, "v = 0".

    Examples:
        >>> ulna.Mode(start=0.0, end=0.4, held=("friction",)).held
        ('friction',)
    """

    start: float
    end: float
    held: tuple[str, ...]


def modes_of(events: Iterable[Event], start: float, end: float) -> tuple[Mode, ...]:
    """The spans of a run from its events in order of time; spans without length are left out."""
    found: list[Mode] = []
    held: list[str] = []
    for event in events:
        if event.kind not in (EventKind.HELD, EventKind.RELEASED):
            continue
        if event.time > start:
            found.append(Mode(start=start, end=event.time, held=tuple(held)))
            start = event.time
        if event.kind is EventKind.HELD:
            held.append(event.signal)
        elif event.signal in held:
            held.remove(event.signal)
    return (*found, Mode(start=start, end=end, held=tuple(held)))
