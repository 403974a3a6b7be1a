"""`simulate`: a loop or a system, an initial state and times in; a `Trajectory` or an `Ensemble` out."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ulna.base import SimulationError
from ulna.loop import Loop
from ulna.plants import as_plant
from ulna.sim.continuous.ensemble import continuous_figures
from ulna.sim.continuous.implicit import Implicit
from ulna.sim.continuous.rules import Limits, Reported
from ulna.sim.continuous.run import run_continuous
from ulna.sim.continuous.taylor import Taylor
from ulna.sim.difference import difference_figures, run_difference
from ulna.sim.ensemble import Ensemble
from ulna.sim.outcome import Outcome
from ulna.sim.record import Figures, Paths, Record
from ulna.sim.request import continuous_run, count_of, instants, request
from ulna.sim.sampled import AbstractProcessor, FixedSteps, run_sampled, sampled_figures
from ulna.sim.starts import Request
from ulna.sim.static import run_static
from ulna.sim.trajectory import Trajectory
from ulna.system import System

Times = float | Sequence[float] | np.ndarray
TAYLOR, STEPS = Taylor(), FixedSteps()


def simulate(
    loop: Any,
    initial: Sequence[Any] | np.ndarray | Mapping[str, Any],
    times: Times,
    *,
    inputs: Mapping[str, Any] | None = None,
    parameters: Mapping[str, Any] | None = None,
    engine: Taylor | Implicit | FixedSteps | AbstractProcessor | None = None,
    record: Record | None = None,
    events: Sequence[Reported] = (),
    targets: Mapping[str, Any] | None = None,
    seed: int | Sequence[int] | np.ndarray = 0,
    threads: int | None = None,
    throw: bool = True,
) -> Any:
    """The motion of a loop or a system from `initial` at `times`: a `Trajectory`, or of many runs an `Ensemble`.

    Many runs are a matter of shape: where `initial` has two axes, or an initial value, a parameter, an input, a target
    or `seed` has N values, there are N runs. A run gives the same bits alone or among others of a loop with a
    processor, whatever the number of threads.

    Args:
        loop: a `Loop`, a `System`, what has a `.system`, or the name or file of a plant; parameters may be symbolic.
            One without states has outputs along the time and nothing else; `initial` is () then.
        initial: states in SI: (n,) in order, or by name. Of a `Loop` the plant's states are enough: the controller's
            states start at 0 (a filter's covariance at its own), or where they or the estimates (`x_hat`) are named, as
            may be a driven input: what the drive holds before the first command. For N runs (N, n), by name (N,).
        times: (T,) increasing instants in s, T ≥ 2, the first where `initial` holds; or one final time for (0, T). With
            a processor they are sample times from 0, and a final time alone stands for all of them; in discrete time
            they are multiples of the period.
        inputs: references and disturbances by name: a number, a formula in `TIME`, a function of time, `Held` or
            `Interpolated` samples; an array of N numbers, or samples with N rows, for N runs. A disturbance left out
            is 0, a reference has to be given. `<y>_noise`: samples in place of the noise drawn for y, in SI.
        parameters: SI values in place of the own ones; nothing is compiled anew. A name that plant and controller
            share means the plant's.
        engine: `Taylor(...)` for continuous loops, `FixedSteps(...)` for those with a processor. A loop that `Taylor`
            finds stiff goes over to `Implicit(...)` by itself, and the trajectory's `note` says so.
            `ulna.deploy.Compiled(folder)`: the C of a folder computes the samples (software in the loop).
        record: of many runs `Ends()`, `Figures()` (default) or `Paths(...)`.
        events: what a continuous run reports besides saturation and end stops: `Crossing(...)`, `Settling(...)`. A
            terminal crossing ends it.
        targets: by output name where it should end, for figures and settling events, else 0.
        seed: of noise and clock; for N runs N of them, or the first of N that follow. threads: of many runs.
        throw: raise where one run does not reach the end; otherwise the trajectory says so in `outcome`.

    Raises:
        SimulationError: wrong number or names of states, times that do not increase or are negative, NaN, unknown
            names, parameters without a value, inputs not defined over the whole time; and, of one run with `throw`,
            an end before the last time (its `value` is the trajectory).

    Examples:
        >>> simulate(loop, (1, 0, 0), np.linspace(0, 5, 501))["theta"]  # doctest: +SKIP
    """
    system, found = _asked(loop)
    runs = count_of(initial, parameters, inputs, targets, seed)
    at = instants(times)
    if isinstance(engine, AbstractProcessor):
        engine = FixedSteps(processor=engine)
    sampled = found is not None and found.sampled
    _check_engine(engine, sampled=sampled, events=bool(events))
    moved = sampled or (bool(system.states) and not system.discrete)
    if not moved:
        _check_unmoved(system, engine, several=runs is not None, watched=bool(events or _limits(found)))
    plant = None if found is None or sampled or found.controller is None else found.plant
    if runs is None and not sampled:
        run = continuous_run(system, found, initial, at, inputs, parameters)
        settings = engine if isinstance(engine, Taylor | Implicit) else TAYLOR
        if moved:
            trajectory = run_continuous(system, *run, engine=settings, limits=_limits(found), reported=tuple(events))
        else:
            trajectory = run_difference(system, *run) if system.discrete else run_static(system, *run[1:])
        if plant is not None:  # a copy costs a tenth of a short run
            trajectory = replace(trajectory, plant=plant)
        return _finished(trajectory, float(at[-1])) if throw else trajectory
    asked = request(system, found, runs, initial, at, inputs, parameters, targets, seed, threads)
    if runs is None and found is not None:
        steps = engine if isinstance(engine, FixedSteps) else STEPS
        trajectory = replace(run_sampled(found, steps, asked.starts, at), plant=plant)
        return _finished(trajectory, float(at[-1])) if throw else trajectory
    return replace(_many(asked, found, engine, record or Figures(), sampled=sampled), plant=plant)


def _many(
    asked: Request, loop: Loop | None, engine: Taylor | Implicit | FixedSteps | None, record: Record, *, sampled: bool
) -> Ensemble:
    if asked.times[0] != 0.0:
        raise SimulationError("times of many runs", f"they begin at {asked.times[0]:g} s.", "Many runs begin at 0 s.")
    end = float(asked.times[-1])
    if asked.system.discrete and not sampled:
        return Ensemble(system=asked.system, horizon=end, **difference_figures(asked, record))
    if sampled and loop is not None:
        steps = engine if isinstance(engine, FixedSteps) else STEPS
        names = record.names if isinstance(record, Paths) else ()
        figures = sampled_figures(loop, steps, asked.starts, end, paths=names, threads=asked.threads)
        return Ensemble(system=asked.system, horizon=end, **figures)
    settings = engine if isinstance(engine, Taylor | Implicit) else TAYLOR
    return Ensemble(system=asked.system, horizon=end, **continuous_figures(asked, settings, _limits(loop), record))


def _asked(given: Any) -> tuple[System, Loop | None]:
    """(system whose states `initial` names, the loop if it is one)."""
    if isinstance(given, Loop):
        return (given.plant if given.sampled else given.system), given
    if isinstance(given, str | os.PathLike):
        given = as_plant(given)
    system = given if isinstance(given, System) else getattr(given, "system", None)
    if not isinstance(system, System):
        raise SimulationError(
            f"simulate({type(given).__name__}, ...)",
            "it is neither a System nor a Loop.",
            "Give a System, a Loop, what has a .system, or the name or file of a plant.",
        )
    return system, None


def _limits(loop: Loop | None) -> Limits:
    if loop is None or loop.hardware is None:
        return Limits()
    return Limits(saturation=tuple(loop.saturation.items()), end_stops=loop.hardware.end_stops)


def _check_engine(engine: Taylor | Implicit | FixedSteps | None, *, sampled: bool, events: bool) -> None:
    if sampled and isinstance(engine, Taylor | Implicit):
        raise SimulationError(
            f"engine={type(engine).__name__}(...)",
            "the loop has a processor.",
            "Give engine=FixedSteps(...), or leave it out.",
        )
    if not sampled and isinstance(engine, FixedSteps):
        raise SimulationError(
            "engine=FixedSteps(...)",
            "it is for a loop whose controller runs once a period.",
            "Give Loop(..., hardware=Hardware(period=...)), or engine=Taylor(...).",
        )
    if sampled and events:
        raise SimulationError(
            "events of a sampled run", "it reports what happens at its samples by itself.", "Leave them out."
        )


def _check_unmoved(system: System, engine: object, *, several: bool, watched: bool) -> None:
    """Refuse what makes sense only for a system that is integrated."""
    if system.discrete:
        for what, given in (("engine", engine is not None), ("events", watched)):
            if given:
                found = f"it moves in {system.time_text}, nothing is in between."
                raise SimulationError(f"{what} of a run of '{system.name}'", found, "Leave them out.")
    elif several or watched:
        hint = "Simulate it once, without limits and events: its outputs are functions of its inputs."
        raise SimulationError(f"simulation of '{system.name}'", "it has no states, so nothing in it moves.", hint)


def _finished(trajectory: Trajectory, wanted: float) -> Trajectory:
    if trajectory.outcome in (Outcome.FINISHED, Outcome.STOPPED):
        return trajectory
    last = ", ".join(
        f"{signal.name} = {value:.4g}"
        for signal, value in zip(trajectory.system.states, trajectory.states[-1], strict=True)
    )
    why = trajectory.events[-1].signal if trajectory.outcome is Outcome.EDGE else trajectory.outcome.text
    raise SimulationError(
        f"simulation of '{trajectory.system.name}' to {wanted:g} s",
        f"at {trajectory.times[-1]:.6g} s {why} ({last}).",
        f"{trajectory.outcome.remedy} throw=False returns the part before.",
        value=trajectory,
    )
