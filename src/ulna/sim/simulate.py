"""`simulate`: a system, an initial state and times in, a `Trajectory` out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from ulna.base import SimulationError
from ulna.sim.continuous.continuous import Continuous
from ulna.sim.continuous.flow import Flow, Stretch
from ulna.sim.continuous.prepared import (
    Commands,
    Prepared,
    default_values,
    parameter_values,
    prepared,
    shape_of,
    stretch_values,
)
from ulna.sim.continuous.rules import Reported
from ulna.sim.continuous.switched_flow import SwitchedFlow
from ulna.sim.continuous.watchers import new_course
from ulna.sim.event import Event, EventKind
from ulna.sim.inputs import Held, Input, Interpolated, as_input
from ulna.sim.outcome import Outcome
from ulna.sim.sampled.run import run_sampled
from ulna.sim.sampled.sampled import Sampled
from ulna.sim.trajectory import Series, Trajectory
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
    events: Sequence[Reported] = (),
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
        events: what a continuous run reports in `events` besides saturation and end stops: `Crossing(...)`,
            `Settling(...)`. A terminal crossing ends it.
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
        if events:
            raise SimulationError(
                "events of a sampled run", "it reports what happens at its samples by itself.", "Leave them out."
            )
        known = parameter_values(default_values(system), parameters, system.name)
        at = _times(times)
        trajectory = run_sampled(system, _initial(system, initial), at, driven, known, time)
        return _finished(trajectory, float(at[-1])) if throw else trajectory
    ready = prepared(system, shape_of(driven, system) if system.inputs else (), time, tuple(events))
    state = _initial(system, initial)
    at = _times(times)
    if parameters is None and ready.ready is not None:
        known = ready.parameters
    else:
        known = parameter_values(ready.values, parameters, system.name)
    run, happened = _integrated(ready, state, at, driven, known, default=parameters is None)
    trajectory = Trajectory(
        system=ready.shown,
        parameters=known,
        drive=driven,
        times=run.times,
        states=run.states,
        outcome=run.outcome,
        events=happened,
    )
    if ready.commands is not None:
        trajectory = replace(trajectory, further=_limited(ready.commands, trajectory))
    return _finished(trajectory, float(at[-1])) if throw else trajectory


def _limited(commands: Commands, trajectory: Trajectory) -> Mapping[str, Series]:
    """What limited inputs would have been, and what they were."""
    system = trajectory.system
    known = {s.name: s for s in (*system.inputs, *system.outputs)}
    values = commands.evaluate(
        *trajectory.states.T, *trajectory.inputs.T, *(trajectory.parameters[p.name] for p in system.parameters)
    )
    found = {}
    for k, name in enumerate(commands.names):
        for role, suffix, row in (("command", "command", 2 * k), ("limited command", "limited", 2 * k + 1)):
            signal = replace(known[name], name=f"{name}_{suffix}")
            found[signal.name] = Series(
                signal=signal, role=role, values=np.broadcast_to(values[row], trajectory.times.shape)
            )
    return found


def _finished(trajectory: Trajectory, wanted: float) -> Trajectory:
    if trajectory.outcome not in (Outcome.FINISHED, Outcome.STOPPED):
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
) -> tuple[Stretch, tuple[Event, ...]]:
    flow = ready.flow
    breakpoints = _breakpoints(inputs, times) if inputs else None
    if breakpoints is not None or isinstance(flow, SwitchedFlow):
        edges = [*times[:1], *(() if breakpoints is None else breakpoints), *times[-1:]]
        return _stretches(ready, state, times, edges, inputs, parameters)
    start, end = float(times[0]), float(times[-1])
    values = ready.ready if default else None
    if values is None:
        values = stretch_values(ready, parameters, inputs, start, end)
    with flow.lock:
        if len(times) == 2:
            final = flow.final(state, start, end, values)
            if final is not None:
                return Stretch(times=times, states=np.array((state, final)), outcome=Outcome.FINISHED), ()
        run = flow.run(state, times, values)
    return run, (() if run.outcome is Outcome.FINISHED else _ended(run))


def _stretches(
    ready: Prepared,
    state: np.ndarray,
    times: np.ndarray,
    edges: list[Any],
    inputs: Mapping[str, Input],
    parameters: Mapping[str, float],
) -> tuple[Stretch, tuple[Event, ...]]:
    """One stretch after the other between the breakpoints of the inputs; breakpoints nobody asked for are dropped."""
    flow = ready.flow
    course: Any = None
    if isinstance(flow, SwitchedFlow):
        course = new_course(flow.motion, ready.rules, float(times[-1] - times[0]))
    all_times, all_states, outcome = [times[:1]], [state[None, :]], Outcome.FINISHED
    for start, end in pairwise(edges):
        inner = times[np.searchsorted(times, start, side="right") : np.searchsorted(times, end, side="left")]
        grid = np.concatenate(([start], inner, [end]))
        values = stretch_values(ready, parameters, inputs, float(start), float(end))
        with flow.lock:
            if isinstance(flow, Flow):
                run = flow.run(state, grid, values)
            else:
                course, run = flow.run(course, state, grid, values)
        outcome = run.outcome
        if outcome is not Outcome.FINISHED:
            all_times.append(run.times[1:])
            all_states.append(run.states[1:])
            break
        state = run.states[-1]
        asked = end == times[min(np.searchsorted(times, end), len(times) - 1)]
        keep = slice(1, None if asked else -1)
        all_times.append(grid[keep])
        all_states.append(run.states[keep])
    whole = Stretch(times=np.concatenate(all_times), states=np.concatenate(all_states), outcome=outcome)
    happened = () if course is None else course.finished(outcome)
    return whole, (happened if outcome is Outcome.FINISHED else (*happened, *_ended(whole)))


def _ended(run: Stretch) -> tuple[Event, ...]:
    kinds = {Outcome.BLEW_UP: EventKind.BLEW_UP, Outcome.NOT_FINITE: EventKind.NOT_FINITE}
    kind = kinds.get(run.outcome)
    if kind is None:
        return ()
    return (Event(time=float(run.times[-1]), kind=kind, state=tuple(run.states[-1].tolist())),)


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
