"""The load-robust loop as on hardware, for random loads, resistances and set points: does every run come to rest?"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from ulna.design import Track
from ulna.plants import Preset
from ulna.sim.references import minimum_jerk
from ulna.studies.prosthesis.designs import joined
from ulna.studies.prosthesis.load_robust_designs import SPREAD, TUNINGS, load_robust_design
from ulna.studies.prosthesis.plant import Bench, Draws, bench_of, draws_of
from ulna.studies.prosthesis.tasks import PERIOD, Task
from ulna.studies.prosthesis.trial import (
    NOISE,
    Runs,
    compiled_control,
    compiled_plant,
    hardware_of,
    plant_steps,
    run_loop,
)
from ulna.system import System

VOLTAGE, CURRENT = 60.0, 60.0
"""V and A, limits of the paper's arm, which names none: a choice."""
SECONDS = 6.5
"""s of every run."""
FIRST, SECOND = 0.8, 3.0
"""s when the motion to the set point and the one to its other side begin."""
WINDOW = 0.5
"""s before the second motion and before the end over which the arm must rest."""
WIDEST = math.radians(60.0)
"""Largest set point, either side."""
_CHUNK = 200


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadCampaign:
    """Runs of one controller on many plants.

    Attributes:
        preset: the arm; voltage, current: limits in V and A.
        loads: (N, 2) kg before and after the change; resistances: (N,) ohm; set_points: (N,) rad of the first motion,
            the negative of it of the second: what was drawn.
        errors: (N, 2) largest |angle − set point| in the windows after either motion, degrees; infinite where it is
            no number.
        overshoot: (N,) of the second motion, % of its way. peak_current: (N,) A.
        limited: (N,) % of the samples at which the drive could not give what was asked.
    """

    preset: Preset
    voltage: float
    current: float
    loads: np.ndarray
    resistances: np.ndarray
    set_points: np.ndarray
    errors: np.ndarray
    overshoot: np.ndarray
    peak_current: np.ndarray
    limited: np.ndarray

    @property
    def worst_error(self) -> float:
        """Largest of `errors`."""
        return float(self.errors.max())

    def missed(self, tolerance: float = 0.2) -> np.ndarray:
        """(N,) whether a run does not come to rest within so many degrees, both times."""
        return ~(self.errors.max(axis=1) <= tolerance)


def load_campaign(
    preset: Preset,
    runs: int,
    *,
    seed: int = 0,
    threads: int = 2,
    loads: tuple[float, float] | None = None,
    current: float | None = None,
    voltage: float | None = None,
) -> LoadCampaign:
    """The preset's load-robust compensator at 1 kHz behind encoder, noise, one sample of delay, and the drive's limits.

    Every run begins at rest in the horizontal without current, so that the arm falls first. A minimum-jerk motion takes
    it to the set point, up to 60° either side, another one to the opposite angle; half-way there the load is picked up
    or dropped, wholly or in part. Loads (0 … heaviest), armature resistance (±20 %) and set point are drawn evenly.
    Limits are voltage, battery and peak current of the preset; there are no stops. The same numbers for the same
    arguments, whatever the number of threads.

    Args:
        preset: an arm with a load-robust design.
        runs: how many.
        seed: of the draws and of the encoder's noise.
        threads: how many to use.
        loads: kg, range of the draws in place of 0 … heaviest; twice the same for a load that stays.
        current, voltage: limits in A and V in place of the preset's.

    Raises:
        PlantError: for a preset without a tuning.
        OptionalDependencyError: without Numba, the extra [campaign].
    """
    bench = bench_of(preset)
    design = load_robust_design(preset, reference=Track()).compensator
    controller = joined("load-robust compensator", design.law, design.observer)
    random = np.random.default_rng(seed)
    low, high = loads or (0.0, TUNINGS[preset.name].heaviest * bench.value("m2"))
    carried = random.uniform(low, high, (runs, 2))
    resistances = bench.value("Ra") * random.uniform(*SPREAD, runs)
    set_points = random.uniform(-WIDEST, WIDEST, runs)
    volts = voltage or (VOLTAGE if math.isinf(bench.voltage) else bench.voltage)
    amperes = current or (CURRENT if math.isinf(bench.current) else bench.current)
    compiled_plant(bench.plant)
    compiled_control(controller)

    def chunk(first: int) -> np.ndarray:
        rows = slice(first, first + _CHUNK)
        noise = np.random.default_rng([seed, first])
        drawn = (carried[rows], resistances[rows], set_points[rows])
        return _figures(_runs(bench, controller, drawn, (volts, amperes), noise), set_points[rows])

    with ThreadPoolExecutor(max_workers=threads) as pool:
        table = np.concatenate(list(pool.map(chunk, range(0, runs, _CHUNK))))
    return LoadCampaign(
        preset=preset,
        voltage=volts,
        current=amperes,
        loads=carried,
        resistances=resistances,
        set_points=set_points,
        errors=table[:, :2],
        overshoot=table[:, 2],
        peak_current=table[:, 3],
        limited=table[:, 4],
    )


def _runs(
    bench: Bench,
    controller: System,
    drawn: tuple[np.ndarray, np.ndarray, np.ndarray],
    limits: tuple[float, float],
    random: np.random.Generator,
) -> Runs:
    carried, resistances, set_points = drawn
    count = len(carried)
    names = [p.name for p in bench.plant.parameters]
    table = np.tile(draws_of(bench, 1).parameters, (count, 1))
    table[:, names.index("m2")], table[:, names.index("Ra")] = carried[:, 0], resistances
    task = _task(bench)
    draws = Draws(parameters=table, seed=0)
    hardware = hardware_of(bench, draws)
    hardware[:, 1], hardware[:, 4] = limits
    hardware[:, 7:] = np.stack(
        [np.full(count, -math.inf), np.full(count, math.inf), set_points, carried[:, 1] - carried[:, 0]], axis=1
    )
    plant = compiled_plant(bench.plant)
    return run_loop(
        plant.function,
        plant.numbers(table),
        controller,
        np.zeros(0),
        np.zeros(len(controller.states)),
        plant_steps(bench),
        np.zeros((count, 3)),
        np.zeros(count),
        task,
        NOISE * bench.step * random.standard_normal((count, task.count + 1)),
        hardware,
    )


def _task(bench: Bench) -> Task:
    """Motions from 0 to 1 rad and on to −1 rad, of which each run does its own multiple, slow enough for the widest."""
    limits = replace(
        bench.motion,
        speed=bench.motion.speed / WIDEST,
        acceleration=bench.motion.acceleration / WIDEST,
        lower=-1.0,
        upper=1.0,
    )
    out, back = (minimum_jerk(*ends, limits=limits, begin=begin) for *ends, begin in ((0, 1, FIRST), (1, -1, SECOND)))
    times = PERIOD * np.arange(round(SECONDS / PERIOD) + 1)
    second = times >= SECOND - PERIOD / 2
    rows = np.where(second, back.samples(times, derivatives=3), out.samples(times, derivatives=3))
    changed = np.where(times < SECOND + back.duration / 2 - PERIOD / 2, 0.0, 1.0)
    return Task(key="loads", title="", reference=rows, load=changed, push=0.0 * times, start=0.0, event=SECOND)


def _figures(runs: Runs, set_points: np.ndarray) -> np.ndarray:
    """(D, 5) errors after either motion, overshoot of the second, peak current, share of limited samples."""
    turn, window = round(SECOND / PERIOD), round(WINDOW / PERIOD)
    table = np.empty((len(set_points), 5))
    for column, (end, sign) in enumerate(((turn, 1.0), (runs.angle.shape[1], -1.0))):
        error = np.abs(runs.angle[:, end - window : end] - sign * set_points[:, None]).max(axis=1)
        table[:, column] = np.where(np.isfinite(error), np.degrees(error), math.inf)
    beyond = -runs.angle[:, turn:] / set_points[:, None] - 1
    table[:, 2] = 50 * np.maximum(0.0, beyond.max(axis=1))
    table[:, 3] = np.abs(runs.current).max(axis=1)
    table[:, 4] = 100 * runs.limited[:, 1:].mean(axis=1)
    return table
