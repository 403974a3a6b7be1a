"""The runs of a batch of a campaign: figures of every run, as columns."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from ulna.base import unit as unit_of
from ulna.campaign.runs.experiment import Experiment, Role
from ulna.campaign.runs.measures import Column, Window
from ulna.loop import Loop
from ulna.sim import CODES, Ensemble, Figures, Paths, simulate
from ulna.system import Signal, System

OUTCOMES = tuple(outcome.name.lower() for outcome in CODES)
"""Meaning of the numbers in the column `outcome`."""

MOST_NUMBERS = 2**24
"""Of paths in memory at a time, if a run alone has not more."""

_OUTPUT_FIGURES = (
    ("settling_time", "s", "{} stays in its 2 % band from then"),
    ("overshoot", "", "{} beyond its target, part of the way"),
    ("steady_error", None, "last {} − target"),
    ("peak_error", None, "largest |{} − target|"),
)
"""Name, unit (None for that of the output) and text of what is kept of an output."""


def run_batch(experiment: Experiment, first: int, last: int, *, threads: int = 1) -> dict[str, np.ndarray]:
    """(last − first,) values of every one of `columns(experiment)`, for the runs first ≤ k < last.

    A run that blows up has its outcome, and NaN or infinity where a figure means nothing.
    """
    size = _runs_at_a_time(experiment, last - first)
    pieces = [_run(experiment, k, min(k + size, last), threads) for k in range(first, last, size)]
    return {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}


def columns(experiment: Experiment) -> tuple[Column, ...]:
    """What is stored of every run, in order: what varied, how it ended, then the figures."""
    varied = (_varied(experiment, name) for name in experiment.plan.names)
    return (*varied, *(column for column, _ in _measured(experiment)))


def _run(experiment: Experiment, first: int, last: int, threads: int) -> dict[str, np.ndarray]:
    varied, given = experiment.arguments(first, last)
    windows = experiment.measures.windows
    samples = experiment.measures.samples
    found = simulate(
        _watched(experiment),
        times=experiment.sample_times if windows and not experiment.loop.sampled else experiment.horizon,
        engine=experiment.engine,
        record=Paths(*dict.fromkeys(w.signal for w in windows)) if windows else Figures(samples=samples),
        threads=threads,
        **given,
    )
    return varied | {column.name: read(found) for column, read in _measured(experiment)}


def _runs_at_a_time(experiment: Experiment, runs: int) -> int:
    signals = {window.signal for window in experiment.measures.windows}
    return max(1, min(runs, MOST_NUMBERS // max(1, len(signals) * len(experiment.sample_times))))


def _watched(experiment: Experiment) -> Loop | System:
    """The loop with the outputs that are measured: looking at the others takes most of the time."""
    if experiment.loop.hardware is not None:
        return experiment.loop
    measures = experiment.measures
    shown = (*(s.name for s in _outputs(experiment)), *measures.effort, *(w.signal for w in measures.windows))
    return _trimmed(experiment.system, frozenset(shown))


@lru_cache(maxsize=16)
def _trimmed(system: System, wanted: frozenset[str]) -> System:
    kept = [(s, e) for s, e in zip(system.outputs, system.readouts, strict=True) if s.name in wanted]
    return replace(system, outputs=tuple(s for s, _ in kept), readouts=tuple(e for _, e in kept))


def _varied(experiment: Experiment, name: str) -> Column:
    role = experiment.role(name)
    unit = _unit(experiment, name)
    if role is Role.PARAMETER:
        # Values are SI numbers, whatever unit the plant's file is written in.
        given = next(p.unit for p in experiment.system.parameters if p.name == name)
        unit = given if unit_of(given).coherent else f"SI of {given}"
    return Column(name=name, unit=unit, text=role.value, varied=True)


def _measured(experiment: Experiment) -> Iterator[tuple[Column, Callable[[Ensemble], np.ndarray]]]:
    """Each column of a run with how its values are read off many runs."""
    outputs, system = _outputs(experiment), experiment.system
    how = ", ".join(f"{k}: {name}" for k, name in enumerate(OUTCOMES))
    yield Column(name="outcome", unit="", text=how, whole=True), lambda e: e.code
    goals = [s.name for s in outputs if s.name in experiment.measures.targets] or [s.name for s in outputs]
    shown = f"1: finished, with {', '.join(goals) or 'nothing'} settled"
    yield Column(name="settled", unit="", text=shown, whole=True), partial(_settled, goals)
    yield Column(name="end_time", unit="s", text="time at which the run ended"), lambda e: e.end_time
    for signal in outputs:
        for name, unit, text in _OUTPUT_FIGURES:
            column = Column(
                name=f"{name}_{signal.name}",
                unit=signal.unit if unit is None else unit,
                text=text.format(signal.name),
            )
            yield column, partial(_of_output, name, signal.name)
    for signal in system.outputs:
        if signal.name in experiment.measures.effort:
            # Its target is 0.
            yield _peak(signal), partial(_of_output, "peak_error", signal.name)
    for k, signal in enumerate(experiment.loop.wiring.driven if experiment.loop.sampled else ()):
        mean = f"root mean square of {signal.name}"
        yield _peak(signal), partial(_of_column, "peak_input", k)
        yield Column(name=f"rms_{signal.name}", unit=signal.unit, text=mean), partial(_of_column, "rms_input", k)
    for window in experiment.measures.windows:
        for name, text, reduced in (("least", "least", np.min), ("most", "most", np.max), ("mean", "mean of", np.mean)):
            during = f"{text} {window.signal} from {window.begin:g} s to {window.end:g} s"
            column = Column(name=f"{name}_{window.label}", unit=_unit(experiment, window.signal), text=during)
            yield column, partial(_in_window, window, reduced)
    for k, signal in enumerate(system.states):
        text = f"{signal.name} at the end of the run"
        yield Column(name=f"final_{signal.name}", unit=signal.unit, text=text), partial(_of_column, "final_state", k)


def _outputs(experiment: Experiment) -> list[Signal]:
    """Those whose figures are kept."""
    measures = experiment.measures
    if not measures.outputs:
        return [s for s in experiment.system.outputs if s.name not in measures.effort]
    return [s for s in experiment.system.outputs if s.name in (*measures.outputs, *measures.targets)]


def _peak(signal: Signal) -> Column:
    return Column(name=f"peak_{signal.name}", unit=signal.unit, text=f"largest |{signal.name}|")


def _settled(goals: list[str], found: Ensemble) -> np.ndarray:
    """(N,) whether the run finished, with all of these outputs in their bands."""
    chosen = [s.name in goals for s in found.system.outputs]
    return (found.finished & found.settled[:, chosen].all(axis=1)).astype(np.int8)


def _of_output(name: str, output: str, found: Ensemble) -> np.ndarray:
    return getattr(found, name)[:, [s.name for s in found.system.outputs].index(output)]


def _of_column(name: str, column: int, found: Ensemble) -> np.ndarray:
    return getattr(found, name)[:, column]


def _in_window(window: Window, reduced: Callable[..., Any], found: Ensemble) -> np.ndarray:
    """(N,) a number of a signal's path within the window; NaN where a run ended before the window does."""
    # Runs in rows of their own: a sum rounds by where its terms lie, which must not depend on how many runs there are.
    rows = np.ascontiguousarray(found[window.signal][:, window.holds(found.times)])
    return reduced(rows, axis=1)


def _unit(experiment: Experiment, name: str) -> str:
    """Of a state, an input, an output, or what a loop with a processor shows besides."""
    loop, system = experiment.loop, experiment.system
    signals = [*system.states, *system.inputs, *system.outputs]
    if loop.sampled:
        signals += [*loop.references, *loop.wiring.estimates, *loop.wiring.memory]
    for suffix in ("_command", "_limited", "_measured"):
        name = name.removesuffix(suffix)
    return next((s.unit for s in signals if s.name == name), "")
