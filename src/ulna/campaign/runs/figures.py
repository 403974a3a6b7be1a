"""The runs of a batch of a campaign: figures of every run, as columns."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from ulna.base.units import unit as unit_of
from ulna.campaign.runs.experiment import Experiment, Role
from ulna.campaign.runs.measures import Column
from ulna.loop import Loop
from ulna.sim import BAND, CODES, Ensemble, Figures, simulate
from ulna.system import Signal, System

OUTCOMES = tuple(outcome.name.lower() for outcome in CODES)
"""Meaning of the numbers in the column `outcome`."""


def run_batch(experiment: Experiment, first: int, last: int, *, threads: int = 1) -> dict[str, np.ndarray]:
    """(last − first,) values of every one of `columns(experiment)`, for the runs first ≤ k < last.

    A run that blows up has its outcome, and NaN or infinity where a figure means nothing.
    """
    varied, given = experiment.arguments(first, last)
    figures = simulate(
        _watched(experiment),
        times=experiment.horizon,
        engine=experiment.engine,
        record=Figures(samples=experiment.measures.samples),
        threads=threads,
        **given,
    )
    return varied | _kept(experiment, figures)


def _watched(experiment: Experiment) -> Loop | System:
    """The loop with the outputs that are measured: looking at the others takes most of the time."""
    if experiment.loop.hardware is not None:
        return experiment.loop
    wanted = frozenset((*(s.name for s in _judged(experiment)), *experiment.measures.effort))
    return _trimmed(experiment.system, wanted)


@lru_cache(maxsize=16)
def _trimmed(system: System, wanted: frozenset[str]) -> System:
    kept = [(s, e) for s, e in zip(system.outputs, system.readouts, strict=True) if s.name in wanted]
    return replace(system, outputs=tuple(s for s, _ in kept), readouts=tuple(e for _, e in kept))


def columns(experiment: Experiment) -> tuple[Column, ...]:
    """What is stored of every run, in order: what varied, how it ended, then the figures."""
    system, measures = experiment.system, experiment.measures
    varied = [_varied(experiment, name) for name in experiment.plan.names]
    ended = [
        Column(name="outcome", unit="", text=", ".join(f"{k}: {name}" for k, name in enumerate(OUTCOMES)), whole=True),
        Column(name="settled", unit="", text="1: finished, with every output settled", whole=True),
        Column(name="end_time", unit="s", text="time at which the run ended"),
    ]
    figures = []
    for signal in _judged(experiment):
        figures += [
            Column(
                name=f"settling_time_{signal.name}", unit="s", text=f"{signal.name} stays in its 2 % band from then"
            ),
            Column(name=f"overshoot_{signal.name}", unit="", text=f"{signal.name} beyond its target, part of the way"),
            Column(name=f"steady_error_{signal.name}", unit=signal.unit, text=f"last {signal.name} − target"),
            Column(name=f"peak_error_{signal.name}", unit=signal.unit, text=f"largest |{signal.name} − target|"),
        ]
    efforts = [s for s in system.outputs if s.name in measures.effort]
    figures += [Column(name=f"peak_{s.name}", unit=s.unit, text=f"largest |{s.name}|") for s in efforts]
    for signal in _driven(experiment):
        figures.append(Column(name=f"peak_{signal.name}", unit=signal.unit, text=f"largest |{signal.name}|"))
        figures.append(Column(name=f"rms_{signal.name}", unit=signal.unit, text=f"root mean square of {signal.name}"))
    figures += [
        Column(name=f"final_{s.name}", unit=s.unit, text=f"{s.name} at the end of the run") for s in system.states
    ]
    return (*varied, *ended, *figures)


def _varied(experiment: Experiment, name: str) -> Column:
    role = experiment.role(name)
    system = experiment.system
    signals = {s.name: s for s in (*system.states, *system.inputs)}
    unit = signals[name].unit if name in signals else ""
    if role is Role.PARAMETER:
        # Values are SI numbers, whatever unit the plant's file is written in.
        given = next(p.unit for p in system.parameters if p.name == name)
        unit = given if unit_of(given).coherent else f"SI of {given}"
    return Column(name=name, unit=unit, text=role.value, varied=True)


def _judged(experiment: Experiment) -> list[Signal]:
    measures = experiment.measures
    wanted = measures.outputs or [s.name for s in experiment.system.outputs if s.name not in measures.effort]
    return [s for s in experiment.system.outputs if s.name in wanted]


def _driven(experiment: Experiment) -> tuple[Signal, ...]:
    """Inputs whose effort the engine measures; of a continuous loop they are outputs."""
    return experiment.loop.wiring.driven if experiment.loop.sampled else ()


def _kept(experiment: Experiment, figures: Ensemble) -> dict[str, np.ndarray]:
    system = experiment.system
    names = [s.name for s in figures.system.outputs]
    finished = figures.code == 0
    settled = finished.copy()
    kept: dict[str, np.ndarray] = {}
    for signal in _judged(experiment):
        column = names.index(signal.name)
        time, overshoot = figures.settling_time[:, column], figures.overshoot[:, column]
        steady, peak = figures.steady_error[:, column], figures.peak_error[:, column]
        # An output that starts on its target has no way to measure its band by: it must come back from where it went.
        returned = np.abs(steady) <= BAND * peak
        settled &= np.where(np.isnan(overshoot), returned, np.isfinite(time))
        kept |= {
            f"settling_time_{signal.name}": time,
            f"overshoot_{signal.name}": overshoot,
            f"steady_error_{signal.name}": steady,
            f"peak_error_{signal.name}": peak,
        }
    for name in experiment.measures.effort:
        # Their target is 0.
        kept[f"peak_{name}"] = figures.peak_error[:, names.index(name)]
    for column, name in enumerate(figures.input_names):
        kept |= {f"peak_{name}": figures.peak_input[:, column], f"rms_{name}": figures.rms_input[:, column]}
    kept |= {f"final_{s.name}": figures.final_state[:, k] for k, s in enumerate(system.states)}
    ended = {"outcome": figures.code, "settled": settled.astype(np.int8), "end_time": figures.end_time}
    return ended | kept
