"""What happened during a run and when."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np


class EventKind(Enum):
    """What happened; the value is what people read.

    Examples:
        >>> ulna.EventKind.BOUNCED.value
        'the position rebounded from an end stop'
    """

    SATURATION_ENTERED = "the command passed a limit of the input"
    SATURATION_LEFT = "the command came back within the limits of the input"
    END_STOP_ENTERED = "the position reached an end stop"
    END_STOP_LEFT = "the position left the end stop"
    BOUNCED = "the position rebounded from an end stop"
    CROSSED = "the expression passed through zero"
    SETTLED = "the output entered its band for good"
    HELD = "a jump holds the motion on its surface: it sticks, or slides along it"
    RELEASED = "the motion leaves the surface that held it"
    AMBIGUOUS = "more than one motion can follow from the surface"
    ZENO = "infinitely many switchings meet here"
    AT_EDGE = "a function reached the edge of where it is defined"
    BLEW_UP = "the norm of the state passed the bound"
    NOT_FINITE = "the state or the command stopped being a finite number"


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something that happened.

    Attributes:
        time: s. Of a continuous run exact to rounding, of a sampled one a sample time.
        kind: what.
        signal: to which input, position, output or `Crossing`, by name; empty for the whole state.
        direction: 1 upwards or at the upper limit, −1 downwards or at the lower one; 0 where neither is meant.
        state: (n,) the system's state just after it, in SI; empty in sampled runs.

    Examples:
        >>> event = ulna.Event(time=0.4, kind=ulna.EventKind.CROSSED, signal="turns")
        >>> event.kind.value
        'the expression passed through zero'
    """

    time: float
    kind: EventKind
    signal: str = ""
    direction: int = 0
    state: tuple[float, ...] = ()


def switched(
    times: np.ndarray, active: np.ndarray, signal: str, entered: EventKind, left: EventKind
) -> Iterator[Event]:
    """The events of a condition that is true or false at each sample. times, active: (N,)."""
    changes = (active[1:] != active[:-1]).nonzero()[0] + 1
    for k in [*([0] if active[0] else []), *changes.tolist()]:
        yield Event(time=float(times[k]), kind=entered if active[k] else left, signal=signal)
