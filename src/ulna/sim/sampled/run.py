"""One run of a sampled loop as a `Trajectory`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from ulna.base import SimulationError
from ulna.sim.event import Event, EventKind, switched
from ulna.sim.inputs import Held, Input
from ulna.sim.outcome import Outcome
from ulna.sim.sampled.loop import Loop, loop_of
from ulna.sim.sampled.sampled import Sampled
from ulna.sim.sampled.tables import TINY, Tables, as_rows, disturbance_table, reference_table, samples_of
from ulna.sim.trajectory import Series, Trajectory
from ulna.system import System

OUTCOMES = tuple(Outcome)
"""Outcome of each code that a compiled loop hands back: their order of definition."""


def run_sampled(
    plant: System,
    initial: np.ndarray,
    times: np.ndarray,
    inputs: Mapping[str, Input],
    parameters: Mapping[str, float],
    settings: Sampled,
) -> Trajectory:
    """The run at the sample times; of more than two times given, at those only.

    Args:
        plant: what is controlled. initial: (n,) SI. times: (N,) s, from 0; two of them mean every sample.
        inputs: disturbances. parameters: SI values of all the plant's parameters. settings: of the loop.

    Raises:
        SimulationError: names and settings that fit nothing, times that are no sample times.
    """
    count = samples_of(settings, float(times[0]), float(times[-1]))
    loop = loop_of(plant, settings, inputs, lanes=1, recording=True)
    _check_driven(loop, inputs)
    rows = _rows(times, settings)
    wiring = loop.layout.wiring
    columns = loop.columns
    record = np.empty((len(columns), count + 1))
    results = np.zeros((1, len(loop.results)))
    values = [parameters[p.name] for p in plant.parameters]
    tables = Tables(
        settings=loop.values,
        held=loop.held,
        memory=loop.memory,
        initial=as_rows(1, len(initial), initial),
        parameters=as_rows(1, len(values), values),
        references=reference_table(settings, wiring, count),
        own_references=as_rows(1, len(wiring.references)),
        others=disturbance_table(inputs, settings, wiring, count, parameters),
        own_others=as_rows(1, len(wiring.others)),
        seeds=np.array([settings.seed], dtype=np.uint64),
        targets=as_rows(1, loop.layout.outputs),
    )
    last = loop.run(0, 1, count, *tables.all(), results, record)
    ended = dict(zip(loop.results, results[0].tolist(), strict=True))
    outcome = OUTCOMES[int(ended["code"])]
    # The trajectory and what drove it share these numbers.
    record.flags.writeable = False
    record = record[:, : last + 1]
    return _trajectory(plant, parameters, inputs, settings, loop, record, rows, outcome, ended)


def _check_driven(loop: Loop, inputs: Mapping[str, Input]) -> None:
    both = [s.name for s in loop.layout.wiring.driven if s.name in inputs]
    if both:
        raise SimulationError(f"input '{both[0]}'", "the controller drives it already.", "Leave it out of `inputs`.")


def _rows(times: np.ndarray, settings: Sampled) -> np.ndarray | None:
    """(N,) which samples are asked for; None for all."""
    if len(times) == 2:
        return None
    rows = np.rint(times / settings.period).astype(int)
    off = np.abs(times / settings.period - rows) > TINY * np.maximum(1.0, rows) + TINY
    if off.any():
        raise SimulationError(
            "times of a sampled run",
            f"{times[int(np.argmax(off))]:g} s is no multiple of the period of {settings.period:g} s.",
            "Ask for sample times, or give only the final time for all of them.",
        )
    return np.asarray(rows)


def _trajectory(
    plant: System,
    parameters: Mapping[str, float],
    inputs: Mapping[str, Input],
    settings: Sampled,
    loop: Loop,
    record: np.ndarray,
    rows: np.ndarray | None,
    outcome: Outcome,
    ended: Mapping[str, float],
) -> Trajectory:
    columns, n = loop.columns, loop.layout.states
    times, states = record[columns["time"]], record[1 : 1 + n].T
    if rows is not None:
        rows = rows[rows < len(times)]
    kept_times, kept_states = (times, states) if rows is None else (times[rows], states[rows])
    extra = 0
    if outcome is Outcome.BLEW_UP and all(math.isfinite(ended[f"x{k}"]) for k in range(n)):
        # The first state outside the bound stands at the end, on no sample's row.
        final = np.array([ended[f"x{k}"] for k in range(n)])
        kept_times = np.append(kept_times, max(ended["end"], np.nextafter(times[-1], np.inf)))
        kept_states = np.vstack([kept_states, final])
        extra = 1
    return Trajectory(
        system=plant,
        parameters=parameters,
        drive={**inputs, **_applied(settings, loop, record, finite=outcome is not Outcome.NOT_FINITE)},
        times=kept_times,
        states=kept_states,
        outcome=outcome,
        further=MappingProxyType(_series(loop, record, rows, extra)),
        events=_events(plant, settings, loop, record, outcome, ended),
    )


def _applied(settings: Sampled, loop: Loop, record: np.ndarray, *, finite: bool) -> dict[str, Input]:
    """What each driven input was held at; with a split period two values a period."""
    columns, layout = loop.columns, loop.layout
    times = record[columns["time"]]
    applied: dict[str, Input] = {}
    for k, signal in enumerate(layout.wiring.driven):
        at, values = times, record[columns.get(f"ub{k}", columns[f"h{k}_0"])]
        if layout.split:
            spans = np.append(np.diff(times), settings.period)
            change = times + (settings.delay / settings.period - layout.whole_delay) * spans
            at = np.stack([times, change], axis=1).ravel()
            values = np.stack([record[columns[f"ua{k}"]], values], axis=1).ravel()
        if not finite:
            # The command at which the run ended is no number.
            values = np.nan_to_num(values, posinf=0.0, neginf=0.0)
        applied[signal.name] = Held.known(times=at, values=values)
    return applied


def _series(loop: Loop, record: np.ndarray, rows: np.ndarray | None, extra: int) -> dict[str, Series]:
    """Commands, limited commands, measured values, estimates and the controller's states by name."""
    found: dict[str, Series] = {}
    for row, role, signal in loop.series:
        values = record[row] if rows is None else record[row, rows]
        values = np.append(values, values[-1]) if extra else values
        found[signal.name] = Series(signal=signal, role=role, values=values)
    return found


def _events(
    plant: System,
    settings: Sampled,
    loop: Loop,
    record: np.ndarray,
    outcome: Outcome,
    ended: Mapping[str, float],
) -> tuple[Event, ...]:
    columns, layout = loop.columns, loop.layout
    numbers = record[columns["time"]]
    found: list[Event] = []
    for k, signal in enumerate(layout.wiring.driven):
        if layout.saturated[k]:
            beyond = record[columns[f"c{k}"]] != record[columns[f"h{k}_0"]]
            if layout.slewed[k]:
                limits = settings.saturation
                limit = limits.get(signal.name) if isinstance(limits, Mapping) else limits
                command = record[columns[f"c{k}"]]
                beyond = (command > limit.upper) | (command < limit.lower) if limit else np.zeros(len(command), bool)
            entered, left = EventKind.SATURATION_ENTERED, EventKind.SATURATION_LEFT
            found += switched(numbers, beyond, signal.name, entered, left)
    for k, wall in enumerate(settings.end_stops):
        # The flag at a sample tells of the period before it.
        hit = record[columns[f"hit{k}"]] == 1.0
        found += switched(numbers, hit, wall.position, EventKind.END_STOP_ENTERED, EventKind.END_STOP_LEFT)
    for k, output in enumerate(plant.outputs):
        if outcome is Outcome.FINISHED and ended[f"outside{k}"] == 0.0 and ended[f"settled{k}"] > 0.0:
            found.append(Event(time=ended[f"settled{k}"], kind=EventKind.SETTLED, signal=output.name))
    if outcome is Outcome.BLEW_UP:
        found.append(Event(time=ended["end"], kind=EventKind.BLEW_UP))
    if outcome is Outcome.NOT_FINITE:
        found.append(Event(time=ended["end"], kind=EventKind.NOT_FINITE))
    return tuple(sorted(found, key=lambda event: event.time))
