"""Many runs of a continuous loop, a Taylor step of many at a time."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from ulna.program import hoist, to_numpy, with_modes
from ulna.sim.cache import IdentityCache
from ulna.sim.continuous.continuous import Continuous
from ulna.sim.continuous.lane_step import FIGURES, LaneStep, lane_step
from ulna.sim.continuous.one_thread import one_thread
from ulna.sim.inputs import Constant
from ulna.sim.job import Job
from ulna.sim.metrics import BAND, output_metrics
from ulna.sim.outcome import Outcome
from ulna.sim.simulate import simulate
from ulna.symbolic.compiling import kernel
from ulna.system import System

LANES = 16
"""Runs are filled up to a multiple of this: vector code and the code for what is left over round differently."""

CHUNK = 2048
"""Runs that step together at most."""

LOOK = 4
"""Steps between two looks at who has arrived."""

CROWD = 0.75
"""Part of the runs that must still be under way for the others to be dragged along."""

CODES = {outcome: code for code, outcome in enumerate(Outcome)}
"""Code of each outcome, in the order in which they are defined."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lanes:
    """A plant compiled for many runs at once.

    Attributes:
        needed: names of the inputs and parameters that `constants` takes. constants: of the step, for arrays of runs.
        readouts: states, inputs, parameters → outputs, for arrays of runs.
        step: None where the right-hand side jumps or is too long.
    """

    needed: tuple[str, ...]
    constants: Callable[..., tuple[np.ndarray, ...]]
    readouts: Callable[..., tuple[np.ndarray, ...]]
    step: LaneStep | None


_LANES = IdentityCache(16)
_COMPILING = threading.Lock()


def continuous_figures(job: Job, settings: Continuous, samples: int | None) -> dict[str, Any]:
    """The fields of an `EnsembleResult`.

    Runs that end early, plants with jumps, limits or end stops and inputs that are no constants go one by one through
    `simulate`.

    Args:
        job: the runs. settings: of the integrator.
        samples: None: only the end of each run is looked at. A number: figures are taken along the way, off the
            polynomials of the steps; of runs that go one by one, on so many intervals.
    """
    with _COMPILING:
        lanes: Lanes = _LANES.get(
            job.plant, (settings, samples is None), lambda: _compiled(job.plant, settings, figures=samples is not None)
        )
    figures = _empty(job)
    if lanes.step is None or job.inputs:
        alone: Any = range(len(job.initial))
    else:
        alone = _together(job, settings, lanes, lanes.step, figures)
    for run in alone:
        _single(job, settings, samples, run, figures)
    return figures


def _compiled(plant: System, settings: Continuous, *, figures: bool) -> Lanes:
    held = [*plant.input_symbols, *plant.parameter_symbols]
    states = [s.name for s in plant.states]
    rates = {f"{s.name}'": e for s, e in zip(plant.states, plant.inline(plant.rates), strict=True)}
    shown = {f"output {s.name}": e for s, e in zip(plant.outputs, plant.inline(plant.readouts), strict=True)}
    symbols = [*plant.state_symbols, *held]
    whole = kernel(plant.name, symbols, rates | (shown if figures else {}), held=held)
    split = hoist(whole, [s.name for s in held])
    step = None
    # What happens at limits and walls differs from lane to lane.
    if not with_modes(split.main).guards and settings.saturation is None and not settings.end_stops:
        step = lane_step(
            split.main,
            states,
            split.before.outputs,
            tuple(shown) if figures else (),
            settings.tolerance,
            optimise=settings.optimise,
        )
    return Lanes(
        needed=split.before.inputs,
        constants=to_numpy(split.before),
        readouts=to_numpy(kernel(f"outputs of {plant.name}", symbols, shown)),
        step=step,
    )


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


def _held(job: Job, chosen: slice) -> list[np.ndarray]:
    """Of each input and each parameter of the plant, in its order, the values in the chosen runs."""
    zeros = np.zeros(chosen.stop - chosen.start)
    own = [job.own_inputs[s.name][chosen] if s.name in job.own_inputs else zeros for s in job.plant.inputs]
    return own + [job.parameters[chosen, k] for k in range(len(job.plant.parameters))]


def _together(job: Job, settings: Continuous, lanes: Lanes, step: LaneStep, figures: dict[str, Any]) -> list[int]:
    """Fill in the figures; the runs that did not arrive."""
    runs = len(job.initial)
    # As many for each thread.
    length = -(-runs // (job.threads * -(-runs // (job.threads * CHUNK))))
    chunks = [slice(begin, min(begin + length, runs)) for begin in range(0, runs, length)]

    def work(chosen: slice) -> np.ndarray:
        return _chunk(job, settings, lanes, step, chosen, figures)

    with one_thread():
        if min(job.threads, len(chunks)) == 1:
            left = [work(chosen) for chosen in chunks]
        else:
            with ThreadPoolExecutor(min(job.threads, len(chunks))) as pool:
                left = list(pool.map(work, chunks))
    return np.concatenate(left).tolist()


def _chunk(
    job: Job, settings: Continuous, lanes: Lanes, step: LaneStep, chosen: slice, figures: dict[str, Any]
) -> np.ndarray:
    """Fill in the figures of the chosen runs; the numbers of those that did not arrive."""
    held, initial = _held(job, chosen), job.initial[chosen]
    targets = job.targets[chosen, : step.outputs].T
    count, n = len(initial), step.states
    names = [s.name for s in (*job.plant.inputs, *job.plant.parameters)]
    known = dict(zip(names, held, strict=True))
    constants = lanes.constants(*(known[name] for name in lanes.needed)) if lanes.needed else ()
    start = _outputs(lanes, step, initial, held)
    kept = np.stack([start, start, np.zeros_like(start)], axis=1).reshape(FIGURES * step.outputs, count)
    bands = np.stack([targets, BAND * np.abs(targets - start)], axis=1).reshape(2 * step.outputs, count)
    stays = [np.broadcast_to(row, count) for row in (job.horizon, *constants, *bands)]
    last = _march(step, settings, np.stack([np.zeros(count), *initial.T, *kept, *stays]))
    final = figures["final_state"][chosen] = last[1 : 1 + n].T
    if step.outputs:
        _put(figures, chosen, targets, start, _outputs(lanes, step, final, held), last[1 + n :])
    # Written so that a NaN has not arrived.
    arrived = (last[0] == job.horizon) & (_squared(last[1 : 1 + n]) < settings.bound**2)
    return chosen.start + np.flatnonzero(~arrived)


def _march(step: LaneStep, settings: Continuous, rows: np.ndarray) -> np.ndarray:
    """(moving, runs) after all runs arrived, passed the bound or used up their steps; rows: as of `LaneStep`."""
    last = np.empty((step.moving, rows.shape[1]))
    lanes = _filled(np.arange(rows.shape[1]))
    here = np.take(rows, lanes, axis=1)
    there = here.copy()
    for count in range(1, settings.maximum_steps + 1):
        step.evaluate(here, outputs=there[: step.moving])
        here, there = there, here
        if count % LOOK:
            continue
        inside = _squared(here[1 : 1 + step.states]) < settings.bound**2
        under_way = np.flatnonzero((here[0] < here[step.moving]) & inside)
        if not len(under_way):
            break
        if len(under_way) <= CROWD * len(lanes):
            last[:, lanes] = here[: step.moving]
            filled = _filled(under_way)
            here, lanes = np.take(here, filled, axis=1), lanes[filled]
            there = here.copy()
    last[:, lanes] = here[: step.moving]
    return last


def _squared(states: np.ndarray) -> np.ndarray:
    """(runs,) sum of the squares of the rows."""
    return np.einsum("ij,ij->j", states, states)


def _filled(lanes: np.ndarray) -> np.ndarray:
    """Lane numbers, the last one repeated up to a multiple of LANES; copies come out alike."""
    return np.concatenate([lanes, np.repeat(lanes[-1:], -len(lanes) % LANES)])


def _outputs(lanes: Lanes, step: LaneStep, states: np.ndarray, held: list[np.ndarray]) -> np.ndarray:
    """(outputs, N) at the states (N, n)."""
    found = np.empty((step.outputs, len(states)))
    if step.outputs:
        for row, values in zip(found, lanes.readouts(*states.T, *held), strict=True):
            row[:] = values
    return found


def _put(
    figures: dict[str, Any], chosen: slice, targets: np.ndarray, start: np.ndarray, end: np.ndarray, kept: np.ndarray
) -> None:
    """Settling time, overshoot, steady and peak error as `metrics` defines them; targets, start, end: (outputs, N)."""
    way = targets - start
    high, low, left = kept.reshape(len(start), FIGURES, -1).transpose(1, 0, 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        farthest = np.where(way > 0, high - start, low - start) / way
    settled = np.where(np.abs(end - targets) <= BAND * np.abs(way), left, np.inf)
    figures["settling_time"][chosen] = np.where(way == 0.0, np.nan, settled).T
    figures["overshoot"][chosen] = np.where(way == 0.0, np.nan, np.maximum(0.0, farthest - 1.0)).T
    figures["steady_error"][chosen] = (end - targets).T
    figures["peak_error"][chosen] = np.maximum(high - targets, targets - low).T


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
