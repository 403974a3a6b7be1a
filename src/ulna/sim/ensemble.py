"""`run_ensemble`: many runs of one loop, each answered by its figures instead of its path."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ulna.base import SimulationError
from ulna.sim.continuous.continuous import Continuous
from ulna.sim.continuous.ensemble import continuous_figures
from ulna.sim.continuous.prepared import default_values
from ulna.sim.inputs import Constant, Input, as_input
from ulna.sim.job import Job
from ulna.sim.outcome import Outcome
from ulna.sim.sampled.ensemble import sampled_figures
from ulna.sim.sampled.gpu import Gpu
from ulna.sim.sampled.sampled import Sampled
from ulna.system import System

CODES = tuple(Outcome)
"""Outcome of each code."""


@dataclass(frozen=True, kw_only=True, eq=False)
class EnsembleResult:
    """Figures of N runs, in SI. Names in the order of the plant; rows are runs.

    Attributes:
        plant: what was run. horizon: s.
        code: (N,) place in `CODES`: 0 finished, 1 blew up, 2 not finite, 3 sliding, 4 step limit.
        end_time: (N,) s, where the run ended.
        final_state: (N, n).
        peak_input, rms_input: (N, m) of the driven inputs, by `input_names`; NaN where they were not recorded.
        settling_time: (N, p) s from which each output stays in its 2 % band; infinite if it does not.
        overshoot: (N, p) farthest beyond the target as a fraction of the way from the start; NaN without a way.
        steady_error: (N, p) last value − target.
        peak_error: (N, p) largest |value − target|.
    """

    plant: System
    horizon: float
    input_names: tuple[str, ...]
    code: np.ndarray
    end_time: np.ndarray
    final_state: np.ndarray
    peak_input: np.ndarray
    rms_input: np.ndarray
    settling_time: np.ndarray
    overshoot: np.ndarray
    steady_error: np.ndarray
    peak_error: np.ndarray

    @property
    def finished(self) -> np.ndarray:
        """(N,) whether the run reached the horizon."""
        return self.code == 0

    def outcome(self, run: int) -> Outcome:
        """How a run ended."""
        return CODES[int(self.code[run])]

    def __len__(self) -> int:
        return len(self.code)


def run_ensemble(
    plant: System,
    initial: np.ndarray | Sequence[Any],
    horizon: float,
    *,
    time: Sampled | Continuous,
    parameters: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    references: Mapping[str, Any] | None = None,
    controller_initial: Mapping[str, Any] | None = None,
    targets: Mapping[str, Any] | None = None,
    seeds: np.ndarray | Sequence[int] | None = None,
    samples: int | None = None,
    threads: int | None = None,
    device: Gpu | None = None,
) -> EnsembleResult:
    """N runs from 0 to the horizon, their figures taken along the way; memory does not grow with the horizon.

    A run gives the same bits alone or among others, whatever the number of threads. Numbers stand for all runs alike,
    arrays of length N for one value each.

    Args:
        plant: what is simulated: with `Sampled` the plant, with `Continuous` a whole closed loop.
        initial: (N, n), or (n,) for all runs; N is the longest length that occurs among the arguments.
        horizon: s.
        time: the loop and its engine.
        parameters: SI values by name, number or (N,).
        inputs: disturbances by name: number, (N,), or an input as of `simulate` that all runs share.
        references: by name number or (N,), in place of those in `Sampled`.
        controller_initial: states of estimator and controller at the start by name, number or (N,), in place of
            `Sampled(initial=...)`.
        targets: by output name where it should end: number or (N,), else 0.
        seeds: (N,) of the random numbers; by default the loop's seed plus the number of the run.
        samples: with `Continuous`, a number asks for the figures of the outputs; by default only the end of each run is
            looked at and they are NaN. They are read off the steps' polynomials, to about the tolerance (a crossing of
            the band that is nearly a touch to its root). Runs that go one by one (jumps, limits, end stops, inputs that
            are no constants) are looked at on so many intervals. A sampled loop takes them at its samples.
        threads: how many to use, by default one for each core.
        device: a `Gpu` to run a sampled loop on, instead of the processors.

    Raises:
        SimulationError: shapes and names that do not fit, values that are not finite. A run that blows up is one
            result and no error.
    """
    given = {"parameters": parameters, "inputs": inputs, "references": references, "targets": targets}
    given["controller_initial"] = controller_initial
    count = _count(plant, initial, given, seeds)
    _check_time(horizon, samples)
    if not isinstance(time, Sampled):
        _check_continuous(controller_initial, device)
    names = [signal.name for signal in plant.inputs]
    shared, own = _split_inputs(inputs or {}, names, count, plant)
    first_seed = time.seed if isinstance(time, Sampled) else 0
    job = Job(
        plant=plant,
        horizon=float(horizon),
        initial=_initial(plant, initial, count),
        parameters=_parameters(plant, parameters or {}, count),
        inputs=shared,
        own_inputs=own,
        references={name: _per_run(f"reference '{name}'", value, count) for name, value in (references or {}).items()},
        controller={
            name: _per_run(f"initial '{name}'", value, count) for name, value in (controller_initial or {}).items()
        },
        targets=_targets(plant, targets or {}, count),
        seeds=_seeds(seeds, first_seed, count),
        threads=threads or os.cpu_count() or 1,
    )
    if isinstance(time, Sampled):
        figures = sampled_figures(job, time, device=device)
    else:
        figures = continuous_figures(job, time, samples)
    return EnsembleResult(plant=plant, horizon=float(horizon), **figures)


def _check_time(horizon: float, samples: int | None) -> None:
    if not (0 < horizon < np.inf):
        raise SimulationError("horizon of the ensemble", f"{horizon} is not a positive time in s.")
    if samples is not None and samples < 1:
        raise SimulationError(f"run_ensemble(samples={samples})", "at least one interval is needed.")


def _check_continuous(controller_initial: Mapping[str, Any] | None, device: Gpu | None) -> None:
    if controller_initial:
        raise SimulationError(
            "run_ensemble(controller_initial=...)",
            "a continuous loop has no controller beside the plant.",
            "Its states are among those of the plant: initial=.",
        )
    if device is not None:
        raise SimulationError(
            "run_ensemble(device=...)", "continuous loops run on processors only.", "Leave it out, or give Sampled."
        )


def _count(plant: System, initial: Any, given: Mapping[str, Mapping[str, Any] | None], seeds: Any) -> int:
    """The number of runs."""
    lengths = {}
    shape = np.shape(initial)
    if len(shape) == 2:
        lengths["initial"] = shape[0]
    for what, table in given.items():
        for name, value in (table or {}).items():
            if isinstance(value, np.ndarray | list | tuple):
                lengths[f"{what}['{name}']"] = len(value)
    if seeds is not None:
        lengths["seeds"] = len(seeds)
    if len(set(lengths.values())) > 1:
        shown = ", ".join(f"{name}: {length}" for name, length in lengths.items())
        raise SimulationError(f"ensemble of '{plant.name}'", f"the numbers of runs differ ({shown}).")
    count = next(iter(lengths.values()), 1)
    if not count:
        raise SimulationError(f"ensemble of '{plant.name}'", "it has no runs.")
    return count


def _per_run(what: str, value: Any, count: int) -> np.ndarray:
    try:
        row = np.broadcast_to(np.asarray(value, dtype=float), (count,))
    except (TypeError, ValueError):
        raise SimulationError(what, f"{value!r} is neither a number nor {count} of them.") from None
    if not np.isfinite(row).all():
        raise SimulationError(what, "a value is not a finite number.")
    return row


def _initial(plant: System, given: Any, count: int) -> np.ndarray:
    n = len(plant.states)
    try:
        rows = np.array(np.broadcast_to(np.asarray(given, dtype=float), (count, n)), order="C")
    except (TypeError, ValueError):
        raise SimulationError(
            f"initial states of '{plant.name}'",
            f"shape {np.shape(given)} instead of ({count}, {n}) or ({n},).",
            f"One column for each state: {', '.join(s.name for s in plant.states)}.",
        ) from None
    if not np.isfinite(rows).all():
        raise SimulationError(f"initial states of '{plant.name}'", "a value is not a finite number.")
    return rows


def _parameters(plant: System, given: Mapping[str, Any], count: int) -> np.ndarray:
    values = default_values(plant)
    unknown = [name for name in given if name not in values]
    if unknown:
        raise SimulationError(
            f"parameter '{unknown[0]}' of '{plant.name}'",
            "there is no such parameter.",
            f"Known: {', '.join(values) or 'none'}.",
        )
    missing = [name for name, value in values.items() if value is None and name not in given]
    if missing:
        raise SimulationError(f"ensemble of '{plant.name}'", f"parameters without a value: {', '.join(missing)}.")
    table = np.zeros((count, max(1, len(values))))
    for column, (name, value) in enumerate(values.items()):
        table[:, column] = _per_run(f"parameter '{name}'", given.get(name, value), count)
    return table


def _split_inputs(
    given: Mapping[str, Any], names: list[str], count: int, plant: System
) -> tuple[dict[str, Input], dict[str, np.ndarray]]:
    """(inputs that all runs share, inputs of which each run has its own constant)."""
    shared: dict[str, Input] = {}
    own: dict[str, np.ndarray] = {}
    for name, value in given.items():
        if name not in names:
            raise SimulationError(
                f"inputs of '{plant.name}'", f"it has no input {name}.", f"Its inputs: {', '.join(names) or 'none'}."
            )
        if isinstance(value, np.ndarray | list | tuple | float | int | Constant):
            row = value.value if isinstance(value, Constant) else value
            own[name] = _per_run(f"input '{name}'", row, count)
        else:
            shared[name] = as_input(name, value)
    return shared, own


def _targets(plant: System, given: Mapping[str, Any], count: int) -> np.ndarray:
    names = [signal.name for signal in plant.outputs]
    unknown = [name for name in given if name not in names]
    if unknown:
        raise SimulationError(
            f"targets of '{plant.name}'", f"{unknown[0]} is no output.", f"Its outputs: {', '.join(names) or 'none'}."
        )
    table = np.zeros((count, max(1, len(names))))
    for name, value in given.items():
        table[:, names.index(name)] = _per_run(f"target of '{name}'", value, count)
    return table


def _seeds(given: Any, first: int, count: int) -> np.ndarray:
    if given is None:
        return np.uint64(first) + np.arange(count, dtype=np.uint64)
    seeds = np.asarray(given)
    if seeds.shape != (count,) or seeds.dtype.kind not in "iu" or (seeds.dtype.kind == "i" and (seeds < 0).any()):
        raise SimulationError("seeds of the ensemble", f"they are not {count} whole numbers from 0 on.")
    return seeds.astype(np.uint64)
