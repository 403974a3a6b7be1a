"""Runs of a system in discrete time, x⁺ = F(x, u, p): one at a time or many side by side."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ulna.base import SimulationError
from ulna.loop import TINY
from ulna.program import to_numpy
from ulna.sim.cache import IdentityCache
from ulna.sim.ensemble import CODES, empty_figures
from ulna.sim.figures import FIGURE_NAMES
from ulna.sim.inputs import Held, Input, input_values, of_run
from ulna.sim.metrics import output_metrics
from ulna.sim.outcome import Outcome
from ulna.sim.parameters import default_values, parameter_values
from ulna.sim.record import Ends, Paths, Record
from ulna.sim.starts import Request
from ulna.sim.trajectory import Trajectory
from ulna.symbolic.compiling import kernel
from ulna.system import System

MOST_STEPS = 10_000_000
"""Of one run, whose states are kept in memory."""
BOUND = 1e12
"""A run ends as blown up where the Euclidean norm of the state (SI) reaches this."""


def run_difference(
    system: System,
    initial: np.ndarray,
    times: np.ndarray,
    inputs: Mapping[str, Input],
    parameters: Mapping[str, float] | None,
) -> Trajectory:
    """The run at the times, which are multiples of the period; of a final time alone at every one up to it.

    Args:
        system: in discrete time. initial: (n,) SI, at the first time. times: (T,) s.
        inputs: what drives its inputs, taken at each multiple. parameters: SI values in place of its own.

    Raises:
        SimulationError: times that are no multiples of the period, too many of them, parameters without a value.
    """
    known = parameter_values(default_values(system), parameters, system.name)
    grid, rows = _grid(system, times)
    drive = {name: given for name, given in inputs.items() if name in {s.name for s in system.inputs}}
    values = np.zeros((len(grid), 1, len(system.inputs)))
    for column, signal in enumerate(system.inputs):
        if signal.name in drive:
            values[:, 0, column] = input_values(drive[signal.name], grid, known)
    states = np.full((len(grid), 1, len(system.states)), np.nan)
    states[0, 0] = initial
    ended = _stepped(system, states, values, np.array([list(known.values())]).reshape(1, -1))
    last, outcome = int(ended[0, 0]), CODES[int(ended[0, 1])]
    kept = rows[rows <= last]
    if outcome is not Outcome.FINISHED and last not in kept:
        kept = np.append(kept, last)
    return Trajectory(
        system=system, parameters=known, drive=drive, times=grid[kept], states=states[kept, 0], outcome=outcome
    )


def difference_figures(asked: Request, record: Record) -> dict[str, Any]:
    """The fields of an `Ensemble` of runs in discrete time."""
    system, starts, figures = asked.system, asked.starts, empty_figures(asked)
    grid, rows = _grid(system, asked.times)
    runs = len(starts.initial)
    names = [p.name for p in system.parameters]
    values = np.zeros((len(grid), runs, len(system.inputs)))
    for column, signal in enumerate(system.inputs):
        if signal.name in starts.own:
            values[:, :, column] += starts.own[signal.name]
        if signal.name in starts.inputs:
            for run in range(runs):
                given = of_run(starts.inputs[signal.name], run)
                known = dict(zip(names, starts.parameters[run].tolist(), strict=True))
                values[:, run, column] += input_values(given, grid, known)
    states = np.full((len(grid), runs, len(system.states)), np.nan)
    states[0] = starts.initial
    ended = _stepped(system, states, values, starts.parameters)
    if isinstance(record, Paths):
        figures["times"], figures["paths"] = grid[rows], {}
    for run in range(runs):
        last = int(ended[run, 0])
        trajectory = Trajectory(
            system=system,
            parameters=dict(zip(names, starts.parameters[run].tolist(), strict=True)),
            drive={
                s.name: Held.known(times=grid[: last + 1], values=values[: last + 1, run, k])
                for k, s in enumerate(system.inputs)
            },
            times=grid[: last + 1],
            states=states[: last + 1, run],
            outcome=CODES[int(ended[run, 1])],
        )
        _fill(figures, run, trajectory, starts.targets[run], record, rows)
    return figures


def _fill(
    figures: dict[str, Any], run: int, trajectory: Trajectory, targets: np.ndarray, record: Record, rows: np.ndarray
) -> None:
    finished = trajectory.outcome is Outcome.FINISHED
    figures["code"][run] = CODES.index(trajectory.outcome)
    figures["end_time"][run] = trajectory.times[-1]
    figures["final_state"][run] = trajectory.final_state
    if isinstance(record, Ends):
        return
    for column in range(len(trajectory.system.outputs)):
        found = output_metrics(trajectory.times, trajectory.outputs[:, column], float(targets[column]))
        for name in FIGURE_NAMES:
            figures[name][run, column] = getattr(found, name)
        if not finished:
            figures["settling_time"][run, column] = np.inf
    if isinstance(record, Paths):
        kept = rows[rows < len(trajectory.times)]
        for name in record.names:
            paths = figures["paths"].setdefault(name, np.full((len(figures["code"]), len(rows)), np.nan))
            paths[run, : len(kept)] = trajectory[name][kept]


def _grid(system: System, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(multiples of the period from the first time to the last, places of those asked for)."""
    period = float(system.period or math.nan)
    first, last = times[0] / period, times[-1] / period
    begin, end = round(first), math.floor(last + TINY * max(1.0, last))
    if end - begin > MOST_STEPS:
        raise SimulationError(
            f"simulation of '{system.name}'", f"{end - begin:.3g} steps, at most {MOST_STEPS:.0e}.", "Run shorter."
        )
    rows = np.arange(end - begin + 1) if len(times) == 2 else np.rint(times / period).astype(int) - begin
    asked = times[:1] if len(times) == 2 else times
    off = np.abs(asked / period - np.rint(asked / period)) > TINY * np.maximum(1.0, asked / period)
    if off.any():
        raise SimulationError(
            f"times of '{system.name}'",
            f"{asked[int(np.argmax(off))]:g} s is not a multiple of its period of {period:g} s.",
            "Ask for multiples, or give only the final time for all of them.",
        )
    if end <= begin:
        raise SimulationError(
            f"times of '{system.name}'", f"the period of {period:g} s is longer than the run.", "Run longer."
        )
    return np.arange(begin, end + 1) * period, rows


_STEPS = IdentityCache(64)


def _step(system: System) -> Callable[..., tuple[Any, ...]]:
    symbols = [*system.state_symbols, *system.input_symbols, *system.parameter_symbols]
    rates = {s.name: e for s, e in zip(system.states, system.inline(system.rates), strict=True)}
    return _STEPS.get(system, None, lambda: to_numpy(kernel(f"step of {system.name}", symbols, rates)))


def _stepped(system: System, states: np.ndarray, values: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """(N, 2) row of the last state of each run and its code; fills (T, N, n) states. values: (T, N, m) inputs."""
    step, count = _step(system), len(states)
    ended = np.zeros((states.shape[1], 2), dtype=int)
    ended[:, 0] = count - 1
    running = np.ones(states.shape[1], dtype=bool)
    blew, broke = CODES.index(Outcome.BLEW_UP), CODES.index(Outcome.NOT_FINITE)
    with np.errstate(all="ignore"):
        for k in range(count - 1):
            columns = step(*states[k].T, *values[k].T, *parameters.T)
            for place, column in enumerate(columns):
                states[k + 1, :, place] = column
            size = np.sqrt(np.square(states[k + 1]).sum(axis=1))
            if (good := size < BOUND).all():
                continue
            for run in np.flatnonzero(running & ~good):
                finite = bool(np.isfinite(states[k + 1, run]).all())
                ended[run] = (k + 1, blew) if finite else (k, broke)
            running &= good
            states[k + 1, ~running] = np.where(good[~running, None], np.nan, states[k + 1, ~running])
            if not running.any():
                break
    return ended
