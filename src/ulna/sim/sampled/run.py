"""One run of a loop with a processor as a `Trajectory`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from ulna.base import SimulationError
from ulna.loop import TINY, Loop
from ulna.sim.event import Event, EventKind, switched
from ulna.sim.figures import outside
from ulna.sim.inputs import Held, Input
from ulna.sim.outcome import Outcome
from ulna.sim.sampled.chatter import chatter
from ulna.sim.sampled.engine import FixedSteps
from ulna.sim.sampled.prepared import HEAD
from ulna.sim.sampled.work import Worked, work
from ulna.sim.starts import Starts
from ulna.sim.trajectory import Series, Trajectory

OUTCOMES = tuple(Outcome)
"""Outcome of each code that a compiled loop hands back: their order of definition."""


def run_sampled(loop: Loop, engine: FixedSteps, starts: Starts, times: np.ndarray) -> Trajectory:
    """The run at the sample times; of more than two times given, at those only.

    Args:
        loop: with a processor. engine: its settings. starts: of one run.
        times: (N,) s, from 0; two of them mean every sample.

    Raises:
        SimulationError: names and settings that fit nothing, times that are no sample times.
    """
    done = work(loop, engine, starts, float(times[-1]), record=None)
    rows = _rows(times, done.made.fitted.period)
    ended = dict(zip((*HEAD, *done.made.results), done.results[0].tolist(), strict=True))
    # The trajectory and what drove it share these numbers.
    record = done.record[:, 0, : done.last + 1]
    record.flags.writeable = False
    return _trajectory(loop, starts, done, record, rows, ended)


def _rows(times: np.ndarray, period: float) -> np.ndarray | None:
    """(N,) which samples are asked for; None for all."""
    if len(times) == 2:
        return None
    rows = np.rint(times / period).astype(int)
    off = np.abs(times / period - rows) > TINY * np.maximum(1.0, rows) + TINY
    if off.any():
        raise SimulationError(
            "times of a sampled run",
            f"{times[int(np.argmax(off))]:g} s is not a multiple of the period of {period:g} s.",
            "Ask for sample times, or give only the final time for all of them.",
        )
    return np.asarray(rows)


def _trajectory(
    loop: Loop, starts: Starts, done: Worked, record: np.ndarray, rows: np.ndarray | None, ended: Mapping[str, float]
) -> Trajectory:
    columns = done.made.rows
    n = len(loop.plant.states)
    outcome = OUTCOMES[int(ended["code"])]
    times, states = record[columns["time"]], record[1 : 1 + n].T
    if rows is not None:
        rows = rows[rows < len(times)]
    kept_times, kept_states = (times, states) if rows is None else (times[rows], states[rows])
    extra = outcome is Outcome.BLEW_UP and all(math.isfinite(ended[f"x{k}"]) for k in range(n))
    if extra:
        # The first state outside the bound stands at the end, on no sample's row.
        final = np.array([ended[f"x{k}"] for k in range(n)])
        kept_times = np.append(kept_times, max(ended["end"], np.nextafter(times[-1], np.inf)))
        kept_states = np.vstack([kept_states, final])
    run = Trajectory(
        system=loop.plant,
        parameters=dict(zip((p.name for p in loop.plant.parameters), starts.parameters[0].tolist(), strict=False)),
        drive={**_given(loop, starts), **_applied(loop, done, record, columns)},
        times=kept_times,
        states=kept_states,
        outcome=outcome,
        further=MappingProxyType(_series(done, record, rows, extra=extra)),
        events=_events(loop, starts, done, record, columns, outcome, ended),
        steps=int(done.steps[0]),
    )
    note = chatter(run, done.made.fitted.period)
    return replace(run, note=note) if note else run


def _given(loop: Loop, starts: Starts) -> dict[str, Input]:
    return {s.name: starts.inputs[s.name] for s in loop.disturbances if s.name in starts.inputs}


def _applied(loop: Loop, done: Worked, record: np.ndarray, columns: Mapping[str, int]) -> dict[str, Input]:
    """What each driven input was held at; with a split period two values a period."""
    fitted, times = done.made.fitted, record[columns["time"]]
    applied: dict[str, Input] = {}
    for k, signal in enumerate(loop.wiring.driven):
        at, values = times, record[columns[f"ub{k}"]]
        if fitted.split:
            spans = np.append(np.diff(times), fitted.period)
            at = np.stack([times, times + fitted.fraction * spans], axis=1).ravel()
            values = np.stack([record[columns[f"ua{k}"]], values], axis=1).ravel()
        applied[signal.name] = Held.known(times=at, values=values)
    return applied


def _series(done: Worked, record: np.ndarray, rows: np.ndarray | None, *, extra: bool) -> dict[str, Series]:
    """Commands, limited commands, measured values, estimates and the controller's states by name."""
    found: dict[str, Series] = {}
    for row, role, signal in done.made.series:
        values = record[row] if rows is None else record[row, rows]
        values = np.append(values, values[-1]) if extra else values
        found[signal.name] = Series(signal=signal, role=role, values=values)
    return found


def _events(
    loop: Loop,
    starts: Starts,
    done: Worked,
    record: np.ndarray,
    columns: Mapping[str, int],
    outcome: Outcome,
    ended: Mapping[str, float],
) -> tuple[Event, ...]:
    fitted, times = done.made.fitted, record[columns["time"]]
    found: list[Event] = []
    for k, signal in enumerate(loop.wiring.driven):
        limit = fitted.saturations[k]
        if limit is not None:
            command = record[columns[f"c{k}"]]
            beyond = (command > limit.upper) | (command < limit.lower)
            entered, left = EventKind.SATURATION_ENTERED, EventKind.SATURATION_LEFT
            found += switched(times, beyond, signal.name, entered, left)
    for k, (position, _) in enumerate(fitted.walls):
        # The flag at a sample tells of the period before it.
        hit = record[columns[f"hit{k}"]] == 1.0
        name = loop.plant.states[position].name
        found += switched(times, hit, name, EventKind.END_STOP_ENTERED, EventKind.END_STOP_LEFT)
    for k, output in enumerate(loop.plant.outputs):
        last, first, settled = (ended[f"{stem}{k}"] for stem in ("last", "first", "settled"))
        if outcome is Outcome.FINISHED and not outside(last, float(starts.targets[0, k]), first) and settled > 0.0:
            found.append(Event(time=settled, kind=EventKind.SETTLED, signal=output.name))
    if outcome is Outcome.BLEW_UP:
        found.append(Event(time=ended["end"], kind=EventKind.BLEW_UP))
    if outcome is Outcome.NOT_FINITE:
        found.append(Event(time=ended["end"], kind=EventKind.NOT_FINITE))
    return tuple(sorted(found, key=lambda event: event.time))
