"""What happened during a sampled run and when."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np


class EventKind(Enum):
    """What happened; the value is what people read."""

    SATURATION_ENTERED = "the command passed a limit of the input"
    SATURATION_LEFT = "the command came back within the limits of the input"
    END_STOP_ENTERED = "the position reached an end stop"
    END_STOP_LEFT = "the position left the end stop"
    SETTLED = "the output entered its 2 % band for good"
    BLEW_UP = "the norm of the state passed the bound"
    NOT_FINITE = "the state or the command stopped being a finite number"


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something that happened: at `time` (s), to the signal of this name (empty for the whole state)."""

    time: float
    kind: EventKind
    signal: str = ""


def switched(
    times: np.ndarray, active: np.ndarray, signal: str, entered: EventKind, left: EventKind
) -> Iterator[Event]:
    """The events of a condition that is true or false at each sample. times, active: (N,)."""
    changes = np.flatnonzero(np.diff(np.concatenate(([False], active)).astype(int)))
    for k in changes:
        yield Event(time=float(times[k]), kind=entered if active[k] else left, signal=signal)
