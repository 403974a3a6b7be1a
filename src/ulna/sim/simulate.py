"""`simulate`: a system, an initial state and times in, a `Trajectory` out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ulna.base import SimulationError
from ulna.sim.continuous import Continuous
from ulna.sim.inputs import Held, Input, Interpolated, as_input
from ulna.sim.outcome import Outcome
from ulna.sim.prepared import Prepared, default_values, parameter_values, prepared, shape_of, stretch_values
from ulna.sim.sampled.run import run_sampled
from ulna.sim.sampled.sampled import Sampled
from ulna.sim.trajectory import Trajectory
from ulna.system import System

CONTINUOUS = Continuous()

Times = float | Sequence[float] | np.ndarray


def simulate(
    system: System,
    initial: Sequence[float] | np.ndarray | Mapping[str, float],
    times: Times,
    *,
    inputs: Mapping[str, Any] | None = None,
    parameters: Mapping[str, float] | None = None,
    time: Continuous | Sampled = CONTINUOUS,
    throw: bool = True,
) -> Trajectory:
    """The solution x(t) of x' = F(x, u, p) with x(times[0]) = initial, at the given times.

    Args:
        system: a plant, compensator or closed loop; parameters may be symbolic.
        initial: (n,) state in SI, in the system's order, or a value for every state by name.
        times: (N,) increasing times in s, N ≥ 2, the first where `initial` holds; or one final time T for (0, T).
            With `Sampled` they are sample times from 0, and a final time alone stands for all of them.
        inputs: by input name a number, a formula in `TIME`, `Held` or `Interpolated` samples; left out means 0.
        parameters: SI values that replace those of the system for this run; nothing is compiled anew.
        time: how time passes, and the settings of that engine: `Continuous(...)`, or `Sampled(...)` for a plant in a
            loop with a processor.
        throw: raise where the end is not reached; otherwise the trajectory says so in `outcome` and ends there.

    Raises:
        SimulationError: wrong number or names of states, times that do not increase or are negative, NaN, unknown
            inputs or parameters, parameters without a value, inputs not defined over the whole time; and, with
            `throw`, an end before the last time (its `value` is the trajectory).

    Example:
        >>> simulate(loop, (1, 0, 0), np.linspace(0, 5, 501))["theta"]  # doctest: +SKIP
    """
    driven = _inputs(system, inputs)
    if isinstance(time, Sampled):
        known = parameter_values(default_values(system), parameters, system.name)
        at = _times(times)
        trajectory = run_sampled(system, _initial(system, initial), at, driven, known, time)
        return _finished(trajectory, float(at[-1])) if throw else trajectory
    ready = prepared(system, shape_of(driven, system) if system.inputs else (), time)
    state = _initial(system, initial)
    at = _times(times)
    if parameters is None and ready.ready is not None:
        known = ready.parameters
    else:
        known = parameter_values(ready.values, parameters, system.name)
    end, states, outcome = _integrated(ready, state, at, driven, known, default=parameters is None)
    trajectory = Trajectory(system=system, parameters=known, drive=driven, times=end, states=states, outcome=outcome)
    return _finished(trajectory, float(at[-1])) if throw else trajectory


def _finished(trajectory: Trajectory, wanted: float) -> Trajectory:
    if trajectory.outcome is not Outcome.FINISHED:
        raise _failure(trajectory, wanted)
    return trajectory


def _integrated(
    ready: Prepared,
    state: np.ndarray,
    times: np.ndarray,
    inputs: Mapping[str, Input],
    parameters: Mapping[str, float],
    *,
    default: bool,
) -> tuple[np.ndarray, np.ndarray, Outcome]:
    breakpoints = _breakpoints(inputs, times) if inputs else None
    if breakpoints is not None:
        return _stretches(ready, state, times, breakpoints, inputs, parameters)
    start, end = float(times[0]), float(times[-1])
    values = ready.ready if default else None
    if values is None:
        values = stretch_values(ready, parameters, inputs, start, end)
    with ready.flow.lock:
        if len(times) == 2:
            final = ready.flow.final(state, start, end, values)
            if final is not None:
                return times, np.array((state, final)), Outcome.FINISHED
        run = ready.flow.run(state, times, values)
    return run.times, run.states, run.outcome


def _stretches(
    ready: Prepared,
    state: np.ndarray,
    times: np.ndarray,
    breakpoints: np.ndarray,
    inputs: Mapping[str, Input],
    parameters: Mapping[str, float],
) -> tuple[np.ndarray, np.ndarray, Outcome]:
    """One stretch after the other between the breakpoints of the inputs; breakpoints nobody asked for are dropped."""
    edges = np.concatenate(([times[0]], breakpoints, [times[-1]]))
    all_times, all_states = [times[:1]], [state[None, :]]
    for start, end in pairwise(edges):
        inner = times[np.searchsorted(times, start, side="right") : np.searchsorted(times, end, side="left")]
        grid = np.concatenate(([start], inner, [end]))
        values = stretch_values(ready, parameters, inputs, float(start), float(end))
        with ready.flow.lock:
            run = ready.flow.run(state, grid, values)
        if run.outcome is not Outcome.FINISHED:
            all_times.append(run.times[1:])
            all_states.append(run.states[1:])
            return np.concatenate(all_times), np.concatenate(all_states), run.outcome
        state = run.states[-1]
        asked = end == times[min(np.searchsorted(times, end), len(times) - 1)]
        keep = slice(1, None if asked else -1)
        all_times.append(grid[keep])
        all_states.append(run.states[keep])
    return np.concatenate(all_times), np.concatenate(all_states), Outcome.FINISHED


def _breakpoints(inputs: Mapping[str, Input], times: np.ndarray) -> np.ndarray | None:
    """Times strictly inside the run at which an input or its slope jumps; None where none does."""
    first, last = times[0], times[-1]
    found = []
    for name, given in inputs.items():
        if isinstance(given, Held | Interpolated):
            short = first < given.times[0] or (isinstance(given, Interpolated) and last > given.times[-1])
            if short:
                raise SimulationError(
                    f"input '{name}'",
                    f"it is given from {given.times[0]:g} s to {given.times[-1]:g} s, the run goes from {first:g} s "
                    f"to {last:g} s.",
                    "Give samples for the whole run.",
                )
            found.append(given.times[(given.times > first) & (given.times < last)])
    breakpoints = np.unique(np.concatenate(found)) if found else ()
    return np.asarray(breakpoints) if len(breakpoints) else None


def _inputs(system: System, given: Mapping[str, Any] | None) -> dict[str, Input]:
    if not given:
        return {}
    names = [signal.name for signal in system.inputs]
    unknown = [name for name in given if name not in names]
    if unknown:
        raise SimulationError(
            f"inputs of '{system.name}'",
            f"it has no input {', '.join(unknown)}.",
            f"Its inputs: {', '.join(names) or 'none'}.",
        )
    return {name: as_input(name, given[name]) for name in names if name in given}


def _initial(system: System, given: Sequence[float] | np.ndarray | Mapping[str, float]) -> np.ndarray:
    names = [signal.name for signal in system.states]
    if isinstance(given, Mapping):
        if set(given) != set(names):
            wrong = sorted(set(given) ^ set(names))
            raise SimulationError(
                f"initial state of '{system.name}'",
                f"missing or unknown: {', '.join(wrong)}.",
                f"Its states: {', '.join(names)}.",
            )
        given = [given[name] for name in names]
    try:
        state = np.array(given, dtype=float)
    except (TypeError, ValueError):
        raise SimulationError(f"initial state of '{system.name}'", f"{given!r} is not a row of numbers.") from None
    if state.shape != (len(names),):
        raise SimulationError(
            f"initial state of '{system.name}'",
            f"it has shape {state.shape} instead of ({len(names)},).",
            f"Give one number for each state: {', '.join(names)}.",
        )
    if not math.isfinite(sum(state.tolist())):
        bad = [f"{name} = {value}" for name, value in zip(names, state, strict=True) if not math.isfinite(value)]
        if bad:
            raise SimulationError(f"initial state of '{system.name}'", f"not a finite number: {', '.join(bad)}.")
    return state


def _times(given: Times) -> np.ndarray:
    times = np.array((0.0, given) if isinstance(given, float | int) else given, dtype=float)
    if times.ndim != 1 or len(times) < 2:
        raise SimulationError(
            "times of the simulation", f"they have shape {times.shape}.", "Give a final time or at least two times."
        )
    if len(times) == 2:
        start, end = times.tolist()
        good = 0.0 <= start < end < math.inf
    else:
        good = times[0] >= 0.0 and bool((times[1:] > times[:-1]).all()) and math.isfinite(times[-1])
    if good:
        return times
    if not np.isfinite(times).all():
        found = "one of them is not a finite number."
    elif times.min() < 0:
        found = f"{times.min():g} s is negative."
    else:
        place = int(np.argmin(np.diff(times)))
        found = f"{times[place + 1]:g} s follows {times[place]:g} s."
    raise SimulationError("times of the simulation", found, "Times start at 0 or later and increase.")


def _failure(trajectory: Trajectory, wanted: float) -> SimulationError:
    hints = {
        Outcome.BLEW_UP: "The loop is unstable from here; a smaller initial state or another design may hold it.",
        Outcome.NOT_FINITE: "Look for a division by zero, a root or a logarithm of a negative number on the way.",
        Outcome.SLIDING: "Dry friction at rest or a switching law: replace the jump by a steep slope, e.g. tanh.",
        Outcome.STEP_LIMIT: "The system may be stiff or the run long; raise Continuous(maximum_steps=...).",
    }
    last = ", ".join(
        f"{signal.name} = {value:.4g}"
        for signal, value in zip(trajectory.system.states, trajectory.states[-1], strict=True)
    )
    return SimulationError(
        f"simulation of '{trajectory.system.name}' to {wanted:g} s",
        f"at {trajectory.times[-1]:.6g} s {trajectory.outcome.text} ({last}).",
        f"{hints[trajectory.outcome]} throw=False hands over the part before.",
        value=trajectory,
    )
