"""What every controller has to do: reach, hold, follow, pick up, drop, be pushed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ulna.sim.references import Reference, minimum_jerk, through_points
from ulna.studies.prosthesis.plant import Bench

PERIOD = 1e-3
"""s between samples."""
BEGIN = 0.2
"""s before a motion starts."""
EVENT = 1.0
"""s when something happens to a held arm."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Task:
    """One task on a bench, at the samples k · PERIOD.

    Attributes:
        key, title: for files and people.
        reference: (4, N) angle wanted and its derivatives. load: (N,) kg on top of m2. push: (N,) N m.
        start: angle at rest at time 0, rad. event: s when something happens, or when the motion starts.
        reaches: whether rise, settling and overshoot mean something.
    """

    key: str
    title: str
    reference: np.ndarray
    load: np.ndarray
    push: np.ndarray
    start: float
    event: float
    reaches: bool = False

    @property
    def count(self) -> int:
        """Samples after the first."""
        return self.reference.shape[1] - 1

    @property
    def times(self) -> np.ndarray:
        """(N,) s."""
        return PERIOD * np.arange(self.count + 1)


def tasks_of(bench: Bench) -> tuple[Task, ...]:
    """The six tasks, inside the functional range of motion and the bench's limits of speed and acceleration."""
    degree = math.pi / 180
    reach = minimum_jerk(50 * degree, -20 * degree, limits=bench.motion, begin=BEGIN)
    path = [point * degree for point in (0.0, 30.0, -25.0, 20.0, -10.0, 0.0)]
    follow = through_points(path, limits=bench.motion, begin=BEGIN)
    extra, shove = bench.extra_load, 0.3 * bench.moment
    mass = f"{extra:g} kg"
    return (
        _task(bench, "reach", "reach from 50° to −20°", reach, BEGIN + reach.duration + 1.5, reaches=True, event=BEGIN),
        _task(bench, "hold", "hold horizontally for 10 s", None, 10.0, event=0.0),
        _task(bench, "follow", "follow a curve through six points", follow, BEGIN + follow.duration + 0.5, event=BEGIN),
        _task(bench, "pick_up", f"pick up {mass}", None, 4.0, load=(extra, EVENT, math.inf)),
        _task(bench, "drop", f"drop {mass}", None, 4.0, load=(extra, 0.0, EVENT)),
        _task(bench, "push", f"be pushed, {shove:.2g} N m for 0.2 s", None, 4.0, push=(shove, EVENT, EVENT + 0.2)),
    )


def _task(
    bench: Bench,
    key: str,
    title: str,
    reference: Reference | None,
    seconds: float,
    *,
    load: tuple[float, float, float] = (0.0, 0.0, 0.0),
    push: tuple[float, float, float] = (0.0, 0.0, 0.0),
    reaches: bool = False,
    event: float = EVENT,
) -> Task:
    times = PERIOD * np.arange(round(seconds / PERIOD) + 1)
    wanted = reference or minimum_jerk(0.0, 0.0, limits=bench.motion)
    rows = wanted.samples(times, derivatives=3)
    return Task(
        key=key,
        title=title,
        reference=rows,
        load=_while(times, *load),
        push=_while(times, *push),
        start=float(rows[0, 0]),
        event=event,
        reaches=reaches,
    )


def _while(times: np.ndarray, value: float, start: float, end: float) -> np.ndarray:
    """The value for start ≤ t < end, else 0; edges rounded to samples."""
    half = PERIOD / 2
    return np.where((times > start - half) & (times < end - half), value, 0.0)
