"""Many runs of a continuous loop, a Taylor step of many at a time."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from ulna.program import branches_of, hoist, to_numpy, with_modes
from ulna.sim.cache import IdentityCache
from ulna.sim.continuous.lane import FIGURES, LaneStep
from ulna.sim.continuous.one_thread import one_thread
from ulna.sim.continuous.prepared import Engine
from ulna.sim.continuous.rules import Limits
from ulna.sim.continuous.run import run_continuous
from ulna.sim.continuous.runge_kutta_flow import taylor_available
from ulna.sim.continuous.stiffness import APPROACH
from ulna.sim.continuous.taylor import Taylor
from ulna.sim.continuous.yardstick import PASSES, misfits, powers_of_two
from ulna.sim.ensemble import empty_figures
from ulna.sim.figures import BAND, FIGURE_NAMES, output_figures
from ulna.sim.inputs import Constant, of_run
from ulna.sim.metrics import output_metrics
from ulna.sim.outcome import Outcome
from ulna.sim.record import Ends, Figures, Paths, Record
from ulna.sim.starts import Request
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


def continuous_figures(asked: Request, settings: Engine, limits: Limits, record: Record) -> dict[str, Any]:
    """The fields of an `Ensemble`.

    Runs that end early, plants with jumps, limits or end stops, inputs that are no constants and paths go one by one.

    Args:
        asked: the runs. settings: of the integrator. limits: of the loop.
        record: what is kept.
    """
    system = asked.system
    wanted = not isinstance(record, Ends)
    with _COMPILING:
        lanes: Lanes = _LANES.get(
            system, (settings, limits, wanted), lambda: _compiled(system, settings, limits, figures=wanted)
        )
    figures = empty_figures(asked)
    runs = len(asked.starts.initial)
    paths = isinstance(record, Paths)
    if paths:
        figures["times"] = asked.times
        figures["paths"] = {name: np.full((runs, len(asked.times)), np.nan) for name in record.names}
    if not isinstance(settings, Taylor) or lanes.step is None or asked.starts.inputs or paths:
        alone: Any = range(runs)
    else:
        alone = _together(asked, settings, lanes, lanes.step, figures)
    for run in alone:
        _single(asked, settings, limits, record, run, figures)
    return figures


def _compiled(plant: System, settings: Engine, limits: Limits, *, figures: bool) -> Lanes:
    held = [*plant.input_symbols, *plant.parameter_symbols]
    states = [s.name for s in plant.states]
    rates = {f"{s.name}'": e for s, e in zip(plant.states, plant.inline(plant.rates), strict=True)}
    shown = {f"output {s.name}": e for s, e in zip(plant.outputs, plant.inline(plant.readouts), strict=True)}
    symbols = [*plant.state_symbols, *held]
    whole = kernel(plant.name, symbols, rates | (shown if figures else {}), held=held)
    split = hoist(whole, [s.name for s in held])
    step = None
    # What happens at limits, walls and branch points differs from lane to lane.
    smooth = not with_modes(split.main).guards and not branches_of(split.main, split.before.outputs)
    if smooth and not limits and isinstance(settings, Taylor) and taylor_available():
        from ulna.sim.continuous.lane_step import lane_step  # heyoka: 0.4 s

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


def _held(asked: Request, chosen: slice) -> list[np.ndarray]:
    """Of each input and each parameter of the plant, in its order, the values in the chosen runs."""
    zeros = np.zeros(chosen.stop - chosen.start)
    own = [asked.starts.own[s.name][chosen] if s.name in asked.starts.own else zeros for s in asked.system.inputs]
    return own + [asked.starts.parameters[chosen, k] for k in range(len(asked.system.parameters))]


def _together(asked: Request, settings: Taylor, lanes: Lanes, step: LaneStep, figures: dict[str, Any]) -> list[int]:
    """Fill in the figures; the runs that did not arrive."""
    runs = len(asked.starts.initial)
    # As many for each thread.
    length = -(-runs // (asked.threads * -(-runs // (asked.threads * CHUNK))))
    chunks = [slice(begin, min(begin + length, runs)) for begin in range(0, runs, length)]

    def work(chosen: slice) -> np.ndarray:
        return _chunk(asked, settings, lanes, step, chosen, figures)

    with one_thread():
        if min(asked.threads, len(chunks)) == 1:
            left = [work(chosen) for chosen in chunks]
        else:
            with ThreadPoolExecutor(min(asked.threads, len(chunks))) as pool:
                left = list(pool.map(work, chunks))
    return np.concatenate(left).tolist()


def _chunk(
    asked: Request, settings: Taylor, lanes: Lanes, step: LaneStep, chosen: slice, figures: dict[str, Any]
) -> np.ndarray:
    """Fill in the figures of the chosen runs; the numbers of those that did not arrive."""
    held, initial = _held(asked, chosen), asked.starts.initial[chosen]
    targets = asked.starts.targets[chosen, : step.outputs].T
    count, n = len(initial), step.states
    names = [s.name for s in (*asked.system.inputs, *asked.system.parameters)]
    known = dict(zip(names, held, strict=True))
    constants = lanes.constants(*(known[name] for name in lanes.needed)) if lanes.needed else ()
    start = _outputs(lanes, step, initial, held)
    kept = np.stack([start, start, np.zeros_like(start)], axis=1).reshape(FIGURES * step.outputs, count)
    bands = np.stack([targets, BAND * np.abs(targets - start)], axis=1).reshape(2 * step.outputs, count)
    end = float(asked.times[-1])
    stays = [np.broadcast_to(row, count) for row in (end, *np.ones((n, 1)), *constants, *bands)]
    rows = np.stack([np.zeros(count), *initial.T, *np.abs(initial.T), *kept, *stays])
    last = _measured(step, settings, rows)
    final = figures["final_state"][chosen] = last[1 : 1 + n].T
    if step.outputs:
        _put(figures, chosen, targets, start, _outputs(lanes, step, final, held), last[1 + 2 * n :])
    # Written so that a NaN has not arrived.
    arrived = (last[0] == end) & (_squared(last[1 : 1 + n]) < settings.bound**2)
    return chosen.start + np.flatnonzero(~arrived)


def _measured(step: LaneStep, settings: Taylor, rows: np.ndarray) -> np.ndarray:
    """What moved, (moving, runs); runs whose states are of uneven sizes go again with each state by its own size."""
    n = step.states
    last = _march(step, settings, rows)
    inverses = slice(step.moving + 1, step.moving + 1 + n)
    runs = np.arange(rows.shape[1])
    for _ in range(PASSES):
        uneven = misfits(last[1 + n : 1 + 2 * n, runs] * rows[inverses, runs])
        runs = runs[uneven]
        if not len(runs):
            break
        rows[inverses, runs] = 1.0 / powers_of_two(last[1 + n : 1 + 2 * n, runs])
        last[:, runs] = _march(step, settings, np.take(rows, runs, axis=1))
    return last


def _march(step: LaneStep, settings: Taylor, rows: np.ndarray) -> np.ndarray:
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
        if count == APPROACH:
            # Whoever would take too many steps is stiff, or soon out of steps: alone it is found out.
            soon = here[0] * settings.maximum_steps >= here[step.moving] * count
            under_way = under_way[soon[under_way]]
        if not len(under_way):
            break
        if len(under_way) <= CROWD * len(lanes) or count == APPROACH:
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
    high, low, left = kept.reshape(len(start), FIGURES, -1).transpose(1, 0, 2)
    found = output_figures(targets, start, end, low, high, left)
    for name in FIGURE_NAMES:
        figures[name][chosen] = getattr(found, name).T


def _single(
    asked: Request, settings: Engine, limits: Limits, record: Record, run: int, figures: dict[str, Any]
) -> None:
    system, starts = asked.system, asked.starts
    own = {name: Constant(value=float(row[run])) for name, row in starts.own.items()}
    samples = record.samples if isinstance(record, Figures) else 1
    times = asked.times if isinstance(record, Paths) else np.linspace(0.0, float(asked.times[-1]), samples + 1)
    trajectory = run_continuous(
        system,
        starts.initial[run],
        times,
        {**{name: of_run(given, run) for name, given in starts.inputs.items()}, **own},
        {p.name: float(starts.parameters[run, k]) for k, p in enumerate(system.parameters)},
        engine=settings,
        limits=limits,
    )
    figures["code"][run] = CODES[trajectory.outcome]
    figures["end_time"][run] = trajectory.times[-1]
    figures["final_state"][run] = trajectory.final_state
    if isinstance(record, Ends):
        return
    finished = trajectory.outcome is Outcome.FINISHED
    for column in range(len(system.outputs)):
        found = output_metrics(trajectory.times, trajectory.outputs[:, column], float(starts.targets[run, column]))
        for name in FIGURE_NAMES:
            figures[name][run, column] = getattr(found, name)
        if not finished:
            figures["settling_time"][run, column] = np.inf
    for name, rows in figures.get("paths", {}).items():
        kept = min(len(trajectory.times), len(times))
        rows[run, :kept] = trajectory[name][:kept]
