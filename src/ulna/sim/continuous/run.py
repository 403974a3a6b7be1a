"""One continuous run as a `Trajectory`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from ulna.base import SimulationError
from ulna.sim.continuous.at_edge import edge_met
from ulna.sim.continuous.flow import Flow, Stretch
from ulna.sim.continuous.implicit import EXTRA, Implicit, implicit_available
from ulna.sim.continuous.prepared import (
    Commands,
    Engine,
    Prepared,
    prepared,
    shape_of,
    stretch_values,
)
from ulna.sim.continuous.rules import Limits, Reported
from ulna.sim.continuous.switching import Switching
from ulna.sim.continuous.watchers import new_course
from ulna.sim.continuous.yardstick import Yardstick, looked_at
from ulna.sim.event import Event, EventKind
from ulna.sim.inputs import Held, Input, Interpolated
from ulna.sim.outcome import Outcome
from ulna.sim.parameters import parameter_values
from ulna.sim.trajectory import Series, Trajectory
from ulna.system import System

UNLIMITED = Limits()


def run_continuous(
    system: System,
    initial: np.ndarray,
    times: np.ndarray,
    inputs: Mapping[str, Input],
    parameters: Mapping[str, float] | None,
    *,
    engine: Engine,
    limits: Limits = UNLIMITED,
    reported: tuple[Reported, ...] = (),
) -> Trajectory:
    """The solution of x' = F(x, u, p) at the times.

    Args:
        system: what is integrated. initial: (n,) SI. times: (N,) s, N ≥ 2. inputs: what drives its inputs.
        parameters: SI values in place of the system's own. engine: settings. limits: saturation and end stops.
        reported: events to report.

    Raises:
        SimulationError: parameters without a value, inputs not defined over the whole time, names that fit nothing.
    """
    shape, note = shape_of(inputs, system) if system.inputs else (), ""
    ready = prepared(system, shape, engine, limits, reported)
    if parameters is None and ready.ready is not None:
        known = ready.parameters
    else:
        known = parameter_values(ready.values, parameters, system.name)
    run, happened = _integrated(ready, initial, times, inputs, known, default=parameters is None)
    if run.stiff:
        note = f"stiff: explicit steps had come to {run.times[-1]:.3g} s of {times[-1]:g} s"
        if implicit_available():
            implicit = Implicit(tolerance=max(engine.tolerance, Implicit().tolerance), bound=engine.bound)
            ready = prepared(system, shape, implicit, limits, reported)
            run, happened = _integrated(ready, initial, times, inputs, known, default=parameters is None)
            note += "; integrated by Implicit()"
        else:
            note += f"; pip install 'ulna[{EXTRA}]' brings Implicit() for it"
    trajectory = Trajectory(
        system=ready.shown,
        parameters=known,
        drive=inputs,
        times=run.times,
        states=run.states,
        outcome=run.outcome,
        events=happened,
        note=note,
    )
    if ready.commands is not None:
        return replace(trajectory, further=_limited(ready.commands, trajectory))
    return trajectory


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
    if breakpoints is None and isinstance(flow, Flow):
        values = ready.ready if default else None
        start, end = float(times[0]), float(times[-1])
        if values is None:
            values = stretch_values(ready, parameters, inputs, start, end)
        if len(times) == 2:
            with flow.lock:
                final = flow.final(state, start, end, values)
            if final is not None:
                return Stretch(times=times, states=np.array((state, final)), outcome=Outcome.FINISHED), ()
        looked = looked_at(times)
        with np.errstate(all="ignore"), flow.lock:
            run = flow.run(state, looked, values, Yardstick())
        if run.outcome is Outcome.FINISHED and looked is times:
            return run, ()
        happened = _ended(run)
    else:
        looked = looked_at(times)
        edges = [*times[:1], *(() if breakpoints is None else breakpoints), *times[-1:]]
        # What is not finite is found and told of by its outcome.
        with np.errstate(all="ignore"):
            run, happened = _stretches(ready, state, looked, edges, inputs, parameters)
    if len(looked) > len(times):
        kept = np.isin(run.times, times)
        kept[-1] = True
        run = replace(run, times=run.times[kept], states=run.states[kept])
    if run.outcome in (Outcome.NOT_FINITE, Outcome.STEP_LIMIT):
        return _at_edge(ready, run, happened, inputs, parameters)
    return run, happened


def _at_edge(
    ready: Prepared,
    run: Stretch,
    happened: tuple[Event, ...],
    inputs: Mapping[str, Input],
    parameters: Mapping[str, float],
) -> tuple[Stretch, tuple[Event, ...]]:
    """The run with the edge of its domain named, if that is where it ended."""
    states = {s.name: run.states[:, k] for k, s in enumerate(ready.system.states)}
    name = edge_met(ready.edges, run.times, states, inputs, parameters)
    if name is None:
        return run, happened
    last = Event(time=float(run.times[-1]), kind=EventKind.AT_EDGE, signal=name, state=tuple(run.states[-1].tolist()))
    before = tuple(event for event in happened if event.kind is not EventKind.NOT_FINITE)
    return replace(run, outcome=Outcome.EDGE), (*before, last)


def _stretches(
    ready: Prepared,
    state: np.ndarray,
    times: np.ndarray,
    edges: list[Any],
    inputs: Mapping[str, Input],
    parameters: Mapping[str, float],
) -> tuple[Stretch, tuple[Event, ...]]:
    """One stretch after the other between the breakpoints of the inputs; breakpoints nobody asked for are dropped."""
    flow, sizes = ready.flow, Yardstick()
    course: Any = None
    if isinstance(flow, Switching):
        span = float(times[-1] - times[0])
        course = new_course(flow.motion, ready.rules, span, ready.surfaces, ready.branches)
    all_times, all_states, outcome = [times[:1]], [state[None, :]], Outcome.FINISHED
    stiff = False
    for start, end in pairwise(edges):
        inner = times[np.searchsorted(times, start, side="right") : np.searchsorted(times, end, side="left")]
        grid = np.concatenate(([start], inner, [end]))
        values = stretch_values(ready, parameters, inputs, float(start), float(end))
        with flow.lock:
            if isinstance(flow, Flow):
                run = flow.run(state, grid, values, sizes)
            else:
                course, run = flow.run(course, state, grid, values, sizes)
        outcome, stiff = run.outcome, run.stiff
        if outcome is not Outcome.FINISHED:
            all_times.append(run.times[1:])
            all_states.append(run.states[1:])
            break
        state = run.states[-1]
        asked = end == times[min(np.searchsorted(times, end), len(times) - 1)]
        keep = slice(1, None if asked else -1)
        all_times.append(grid[keep])
        all_states.append(run.states[keep])
    whole = Stretch(times=np.concatenate(all_times), states=np.concatenate(all_states), outcome=outcome, stiff=stiff)
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
                    f"it is given from {given.times[0]:g} s to {given.times[-1]:g} s, "
                    f"but the run goes from {first:g} s to {last:g} s.",
                    "Give samples for the whole run.",
                )
            found.append(given.times[(given.times > first) & (given.times < last)])
    breakpoints = np.unique(np.concatenate(found)) if found else ()
    return np.asarray(breakpoints) if len(breakpoints) else None
