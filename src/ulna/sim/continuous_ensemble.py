"""Many runs of a continuous loop through one batch integrator of heyoka."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np

from ulna.sim.cache import IdentityCache
from ulna.sim.continuous import Continuous
from ulna.sim.flow import COMPACT_ABOVE
from ulna.sim.inputs import Constant
from ulna.sim.job import Job
from ulna.sim.metrics import BAND, output_metrics
from ulna.sim.outcome import Outcome
from ulna.sim.simulate import simulate
from ulna.symbolic.program.hoist import Hoisted, hoist
from ulna.symbolic.program.kernel import Kernel, kernel
from ulna.symbolic.program.lowering.numpy import to_numpy
from ulna.symbolic.program.modes import with_modes
from ulna.system import System

BATCH = 8
"""Runs of a batch: one vector register of the machines that have wide ones."""

CHUNK = 64
"""Batches whose paths are kept at a time where figures are taken along the way."""

CODES = {outcome: code for code, outcome in enumerate(Outcome)}
"""Code of each outcome, in the order in which they are defined."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Batch:
    """A plant compiled for eight runs at once; None instead of an integrator where its right-hand side jumps."""

    hoisted: Hoisted
    integrator: Any
    readouts: Kernel
    lock: threading.Lock


_BATCHES = IdentityCache(16)


def continuous_figures(job: Job, settings: Continuous, samples: int | None) -> dict[str, Any]:
    """The fields of an `EnsembleResult`.

    Runs that end early, plants with jumps and inputs that are no constants go one by one through `simulate`.

    Args:
        job: the runs. settings: of the integrator.
        samples: intervals of the grid on which figures are taken; None: only the end of each run is.
    """
    batch: Batch = _BATCHES.get(job.plant, settings, lambda: _compiled(job.plant, settings))
    figures = _empty(job)
    if batch.integrator is None or job.inputs:
        alone: Any = range(len(job.initial))
    else:
        alone = _in_batches(job, settings, batch, samples, figures)
    for run in alone:
        _single(job, settings, samples, run, figures)
    return figures


def _compiled(plant: System, settings: Continuous) -> Batch:
    import heyoka as hy

    from ulna.symbolic.program.lowering.heyoka import to_heyoka

    held = [*plant.input_symbols, *plant.parameter_symbols]
    names = {f"{s.name}'": e for s, e in zip(plant.states, plant.inline(plant.rates), strict=True)}
    split = hoist(kernel(plant.name, [*plant.state_symbols, *held], names, held=held), [s.name for s in held])
    shown = {s.name: e for s, e in zip(plant.outputs, plant.inline(plant.readouts), strict=True)}
    readouts = kernel(f"outputs of {plant.name}", [*plant.state_symbols, *held], shown)
    integrator = None
    # What happens at limits and walls differs from lane to lane.
    if not with_modes(split.main).guards and settings.saturation is None and not settings.end_stops:
        variables = [hy.expression(f"s{k}") for k in range(len(plant.states))]
        sources = dict(zip((s.name for s in plant.states), variables, strict=True))
        sources |= {name: hy.par[k] for k, name in enumerate(split.before.outputs)}
        rates = list(to_heyoka(split.main, sources).values())
        compact = settings.compact
        integrator = hy.taylor_adaptive_batch(
            list(zip(variables, rates, strict=True)),
            np.zeros((len(variables), BATCH)),
            tol=settings.tolerance,
            opt_level=3 if settings.optimise else 0,
            compact_mode=len(variables) > COMPACT_ABOVE if compact is None else compact,
        )
    return Batch(hoisted=split, integrator=integrator, readouts=readouts, lock=threading.Lock())


def _empty(job: Job) -> dict[str, Any]:
    runs, outputs = len(job.initial), len(job.plant.outputs)
    figures: dict[str, Any] = {
        name: np.full((runs, outputs), np.nan) for name in ("settling_time", "overshoot", "steady_error", "peak_error")
    }
    figures |= {
        "input_names": (),
        "peak_input": np.zeros((runs, 0)),
        "rms_input": np.zeros((runs, 0)),
        "code": np.zeros(runs, dtype=np.int8),
        "end_time": np.full(runs, job.horizon),
        "final_state": np.empty_like(job.initial),
    }
    return figures


def _held(job: Job) -> list[np.ndarray]:
    """(N,) of each input and each parameter of the plant, in its order."""
    zeros = np.zeros(len(job.initial))
    own = [job.own_inputs.get(s.name, zeros) for s in job.plant.inputs]
    return own + [job.parameters[:, k] for k in range(len(job.plant.parameters))]


def _in_batches(
    job: Job, settings: Continuous, batch: Batch, samples: int | None, figures: dict[str, Any]
) -> list[int]:
    """Fill in the figures; the runs that did not reach the horizon."""
    names = [s.name for s in (*job.plant.inputs, *job.plant.parameters)]
    held = dict(zip(names, _held(job), strict=True))
    before = batch.hoisted.before
    found = to_numpy(before)(*(held[name] for name in before.inputs)) if before.outputs else ()
    runs = len(job.initial)
    constants = np.zeros((len(found), runs))
    for row, value in enumerate(found):
        constants[row] = value
    starts = list(range(0, runs, BATCH * CHUNK))
    threads = min(job.threads, len(starts))
    # Copies take a millisecond; with them several threads of a process may be at work on one loop.
    with batch.lock:
        integrators = [deepcopy(batch.integrator) for _ in range(threads)]

    def work(worker: int) -> list[int]:
        left: list[int] = []
        for start in starts[worker::threads]:
            chosen = np.arange(start, min(start + BATCH * CHUNK, runs))
            left += _chunk(job, settings, batch, integrators[worker], constants, samples, chosen, figures)
        return left

    if threads == 1:
        return work(0)
    with ThreadPoolExecutor(threads) as pool:
        return sorted(run for left in pool.map(work, range(threads)) for run in left)


def _chunk(
    job: Job,
    settings: Continuous,
    batch: Batch,
    integrator: Any,
    constants: np.ndarray,
    samples: int | None,
    chosen: np.ndarray,
    figures: dict[str, Any],
) -> list[int]:
    n = len(job.plant.states)
    # The last batch is filled up with copies of its last run, which nobody asks for.
    padded = np.minimum(np.arange(chosen[0], chosen[0] + -(-len(chosen) // BATCH) * BATCH), chosen[-1])
    initial = np.ascontiguousarray(job.initial[padded].T)
    values = constants[:, padded]
    final = np.empty((n, len(padded)))
    grid = None if samples is None else np.linspace(0.0, job.horizon, samples + 1)
    path = None if grid is None else np.empty((len(grid), n, len(padded)))
    state, pars = integrator.state, integrator.pars
    used = len(pars)
    for first in range(0, len(padded), BATCH):
        lanes = slice(first, first + BATCH)
        integrator.set_time(0.0)
        state[:] = initial[:, lanes]
        if used:
            pars[:] = values[:used, lanes]
        if grid is None or path is None:
            integrator.propagate_until(job.horizon, max_steps=settings.maximum_steps)
        else:
            # Shape (times, states, lanes).
            everywhere = np.repeat(grid[:, None], BATCH, axis=1)
            path[:, :, lanes] = integrator.propagate_grid(everywhere, max_steps=settings.maximum_steps)[1]
        final[:, lanes] = state
    count = len(chosen)
    figures["final_state"][chosen] = final[:, :count].T
    # Written so that a NaN is outside. A run that met the bound only on the way is caught where there is a path.
    inside = np.square(final[:, :count]).sum(axis=0) < settings.bound**2
    if grid is not None and path is not None:
        inside &= (np.square(path[:, :, :count]).sum(axis=1) < settings.bound**2).all(axis=0)
        held = [value[chosen] for value in _held(job)]
        evaluate = to_numpy(batch.readouts)
        shown = evaluate(*np.moveaxis(path[:, :, :count], 1, 0), *held) if batch.readouts.outputs else ()
        for column, rows in enumerate(shown):
            _put(figures, chosen, column, output_figures(grid, rows, job.targets[chosen, column]))
    return [int(run) for run in chosen[~inside]]


def _put(figures: dict[str, Any], runs: Any, column: int, found: dict[str, np.ndarray]) -> None:
    for name, values in found.items():
        figures[name][runs, column] = values


def output_figures(times: np.ndarray, values: np.ndarray, targets: np.ndarray) -> dict[str, np.ndarray]:
    """Settling time, overshoot, steady and peak error of one output in many runs, as `metrics` has them.

    Args:
        times: (K,) s. values: (K, N). targets: (N,).
    """
    way = targets - values[0]
    error = values - targets
    with np.errstate(divide="ignore", invalid="ignore"):
        farthest = np.where(way > 0, values.max(axis=0) - values[0], values.min(axis=0) - values[0]) / way
        distance = np.abs(error)
        outside = ~(distance <= BAND * np.abs(way))
        last = len(times) - 1 - np.argmax(outside[::-1], axis=0)
        runs = np.arange(len(targets))
        after = np.minimum(last + 1, len(times) - 1)
        high, low = distance[last, runs], distance[after, runs]
        crossing = times[last] + (high - BAND * np.abs(way)) / (high - low) * (times[after] - times[last])
    settled = np.where(outside.any(axis=0), np.where(outside[-1], np.inf, crossing), 0.0)
    return {
        "settling_time": np.where(way == 0.0, np.nan, settled),
        "overshoot": np.where(way == 0.0, np.nan, np.maximum(0.0, farthest - 1.0)),
        "steady_error": error[-1],
        "peak_error": distance.max(axis=0),
    }


def _single(job: Job, settings: Continuous, samples: int | None, run: int, figures: dict[str, Any]) -> None:
    plant = job.plant
    inputs = {**job.inputs, **{name: Constant(value=float(row[run])) for name, row in job.own_inputs.items()}}
    trajectory = simulate(
        plant,
        job.initial[run],
        np.linspace(0.0, job.horizon, (samples or 1) + 1),
        inputs=inputs,
        parameters={p.name: float(job.parameters[run, k]) for k, p in enumerate(plant.parameters)},
        time=settings,
        throw=False,
    )
    figures["code"][run] = CODES[trajectory.outcome]
    figures["end_time"][run] = trajectory.times[-1]
    figures["final_state"][run] = trajectory.final_state
    if samples is None:
        return
    for column in range(len(plant.outputs)):
        found = output_metrics(trajectory.times, trajectory.outputs[:, column], float(job.targets[run, column]))
        finished = trajectory.outcome is Outcome.FINISHED
        figures["settling_time"][run, column] = found.settling_time if finished else np.inf
        figures["overshoot"][run, column] = found.overshoot
        figures["steady_error"][run, column] = found.steady_error
        figures["peak_error"][run, column] = found.peak_error
