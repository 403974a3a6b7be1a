"""What changes from sample to sample alike in all runs: references and disturbances."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ulna.base import SimulationError
from ulna.sim.cache import IdentityCache
from ulna.sim.inputs import Constant, Formula, Input, Interpolated, as_input, input_values
from ulna.sim.sampled.constants import parameters_of
from ulna.sim.sampled.sampled import Sampled
from ulna.sim.sampled.wiring import Wiring

TINY = 1e-9
"""Part of a period below which a time counts as a whole number of periods."""

MOST_SAMPLES = 100_000_000
"""Of one run: tables and trajectories of more do not fit into memory."""

_TABLES = IdentityCache(16)


def samples_of(settings: Sampled, start: float, end: float) -> int:
    """The number of periods between two times.

    Raises:
        SimulationError: a period longer than the run or too many samples, a run that does not begin at 0.
    """
    if start != 0.0:
        raise SimulationError("times of a sampled run", f"they begin at {start:g} s.", "A sampled run begins at 0 s.")
    count = math.floor(end / settings.period + TINY * max(1.0, end / settings.period))
    if count < 1:
        raise SimulationError(
            f"Sampled(period={settings.period:g})",
            f"the period is longer than the run of {end:g} s.",
            "Run longer or sample faster.",
        )
    if count > MOST_SAMPLES:
        raise SimulationError(
            f"Sampled(period={settings.period:g})",
            f"a run of {end:g} s has {count:.3g} samples, at most {MOST_SAMPLES:.0e} are possible.",
            "Sample more slowly or run shorter.",
        )
    return count


def reference_table(settings: Sampled, wiring: Wiring, count: int) -> np.ndarray:
    """(count + 1, references) values at the nominal sample times; remembered, to be read only."""

    def made() -> np.ndarray:
        names = [s.name for s in wiring.references]
        values = parameters_of(settings, wiring)
        known = dict(zip((name for name, _ in wiring.parameters), values, strict=True))
        given = [as_input(name, settings.references[name]) for name in names]
        return _table(given, names, settings, count, known)

    return _TABLES.get(wiring, (settings, count), made)


def _table(
    inputs: list[Input], names: list[str], settings: Sampled, count: int, parameters: Mapping[str, float]
) -> np.ndarray:
    times = settings.period * np.arange(count + 1)
    table = np.zeros((count + 1, max(1, len(inputs))))
    for column, (name, given) in enumerate(zip(names, inputs, strict=True)):
        _check_span(name, given, float(times[-1]))
        table[:, column] = input_values(given, times, parameters)
    return table


def _check_span(name: str, given: Input, end: float) -> None:
    if isinstance(given, Constant | Formula):
        return
    if given.times[0] > 0.0 or (isinstance(given, Interpolated) and given.times[-1] < end - TINY):
        raise SimulationError(
            f"'{name}' of the sampled loop",
            f"it is given from {given.times[0]:g} s to {given.times[-1]:g} s, the run goes from 0 s to {end:g} s.",
            "Give samples for the whole run.",
        )


def disturbance_table(
    inputs: Mapping[str, Input], settings: Sampled, wiring: Wiring, count: int, parameters: Mapping[str, float]
) -> np.ndarray:
    """(count + 1, 2 others): value at each sample, slope until the next one; to be read only."""
    if not inputs:
        return _TABLES.get(wiring, count, lambda: np.zeros((count + 1, 2 * max(1, len(wiring.others)))))
    table = np.zeros((count + 1, 2 * max(1, len(wiring.others))))
    names = [s.name for s in wiring.others]
    given = [inputs.get(name, Constant(value=0.0)) for name in names]
    values = _table(given, names, settings, count, parameters)
    for column, each in enumerate(given):
        table[:, 2 * column] = values[:, column]
        if isinstance(each, Interpolated):
            table[:-1, 2 * column + 1] = np.diff(values[:, column]) / settings.period
    return table


def as_rows(rows: int, columns: int, values: Any = None) -> np.ndarray:
    """(rows, columns) floats, contiguous, at least one column so that the compiled loop can take it."""
    table = np.zeros((rows, max(1, columns)))
    if values is not None and columns:
        table[:, :columns] = values
    return table


@dataclass(frozen=True, slots=True, kw_only=True)
class Tables:
    """The arrays that a compiled loop takes, in its order; `own` have a row for each run.

    Attributes:
        settings, held: numbers of the loop, constants of the controller, as in `Loop`.
        memory: (N, states of estimator and controller). initial: (N, n). parameters: (N, p).
        references: (samples, r). own_references: (N, r), added. others: (samples, 2 d). own_others: (N, d), added.
        seeds: (N,). targets: (N, outputs).
    """

    settings: np.ndarray
    held: np.ndarray
    memory: np.ndarray
    initial: np.ndarray
    parameters: np.ndarray
    references: np.ndarray
    own_references: np.ndarray
    others: np.ndarray
    own_others: np.ndarray
    seeds: np.ndarray
    targets: np.ndarray

    def all(self) -> list[np.ndarray]:
        """Every array, in order."""
        return [getattr(self, each.name) for each in fields(self)]

    def of(self, rows: slice) -> list[np.ndarray]:
        """Every array, in order; of those with a row for each run these rows."""
        return [
            np.ascontiguousarray(array[rows]) if each.name in _OWN else array
            for each, array in zip(fields(self), self.all(), strict=True)
        ]


_OWN = frozenset({"memory", "initial", "parameters", "own_references", "own_others", "seeds", "targets"})
