"""A contender at a task on the plants of a bench: whole trajectories."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from ulna.loop import Loop
from ulna.sim import FixedSteps, Held, Paths, simulate
from ulna.studies.prosthesis.baselines import DIFFERENTIATOR, VISUAL_DELAY
from ulna.studies.prosthesis.contender import Contender
from ulna.studies.prosthesis.designs import gain_numbers
from ulna.studies.prosthesis.hardware import NOISE, hardware_of
from ulna.studies.prosthesis.plant import Bench, Draws
from ulna.studies.prosthesis.tasks import PERIOD, Task

STIFFNESS = 2.0
"""Largest Runge-Kutta step of the plant in electrical time constants La/Ra; 2.78 is the bound of stability."""
ANGLE, CURRENT, VOLTAGE, LIMITED = "theta", "i", "u", "u_cut"

Runs = Mapping[str, np.ndarray]
"""(D, N) of D plants at N samples in SI: `ANGLE`, `CURRENT`, `VOLTAGE`, and `LIMITED`, 1 where the drive could not give
what was asked."""


@lru_cache(maxsize=64)
def loop_of(bench: Bench, contender: Contender) -> Loop:
    """The contender on the bench."""
    return Loop(plant=bench.plant, controller=contender.controller, hardware=hardware_of(bench))


def run_trial(
    bench: Bench, contender: Contender, chosen: Mapping[str, float], task: Task, draws: Draws, *, finer: int = 1
) -> Runs:
    """The contender with its chosen numbers at the task on every plant of the draws.

    Each plant starts at rest under its own load, held by the drive; the controller knows the nominal load only.

    Args:
        finer: so many times more steps of the plant than needed, to check the steps.

    Raises:
        OptionalDependencyError: without Numba.
    """
    loop = loop_of(bench, contender)
    plant = dict(zip((p.name for p in bench.plant.parameters), draws.parameters.T, strict=True))
    found = simulate(
        loop,
        {**starts_at_rest(task, plant), **first_memory(bench, contender, chosen, task)},
        PERIOD * task.count,
        inputs=inputs_of(loop, task) | {"y_noise": encoder_noise(bench.step, task.key, task.count, draws)},
        parameters=plant | control_numbers(bench, contender, chosen),
        engine=FixedSteps(number=finer * plant_steps(bench), within=STIFFNESS),
        record=Paths(ANGLE, CURRENT, VOLTAGE, LIMITED),
        threads=1,
    )
    return found.paths


def inputs_of(loop: Loop, task: Task) -> dict[str, Held]:
    """Load and push, and of the reference and its derivatives what the controller reads."""
    rows = {"load": task.load, "push": task.push}
    rows |= zip(("y_ref", "y_ref_d1", "y_ref_d2", "y_ref_d3"), task.reference, strict=True)
    wanted = (*loop.disturbances, *loop.references)
    return {s.name: Held.known(times=task.times, values=rows[s.name]) for s in wanted}


def plant_steps(bench: Bench) -> int:
    """Runge-Kutta steps a period: the electrical time constant, at the warmest winding, sets them."""
    return max(1, math.ceil(PERIOD / bench.electrical_time * 1.2 / STIFFNESS))


def control_numbers(bench: Bench, contender: Contender, chosen: Mapping[str, float]) -> dict[str, float]:
    """The numbers of the contender's formulas by name."""
    known = {**bench.lumps, **chosen, **gain_numbers(contender, dict(chosen))}
    known |= {"T_d": DIFFERENTIATOR, "T_see": VISUAL_DELAY, "v_max": 1.2 * bench.motion.speed}
    known["u_max"] = bench.voltage if bench.voltage < math.inf else 1e9
    return {name: known[name] for name in contender.parameters}


@lru_cache(maxsize=6)
def _noise(step: float, key: str, count: int, plants: int, seed: int) -> Held:
    generator = np.random.default_rng([seed, sum(map(ord, key))])
    values = NOISE * step * generator.standard_normal((plants, count + 1))
    # In columns, as the loop reads it.
    return Held.known(times=PERIOD * np.arange(count + 1), values=np.asfortranarray(values))


def encoder_noise(step: float, key: str, count: int, draws: Draws) -> Held:
    """Noise in rad before the quantiser of each plant at a task of this key, the same for every controller."""
    return _noise(step, key, count, draws.count, draws.seed)


def starts_at_rest(task: Task, plant: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """(D,) states of plants with these (D,) parameters at rest, and the voltages that hold them."""
    m1, m2, b, g, n, km, eta, ohms = (plant[name] for name in ("m1", "m2", "b", "g", "N", "km", "eta", "Ra"))
    moment = (m2 + task.load[0] + m1 / 2) * g * b * math.cos(task.start)
    current = -moment / (eta * n * km)
    angle = np.full_like(current, task.start)
    return {"theta": angle, "omega": np.zeros_like(current), "i": current, "u": ohms * current}


def first_memory(bench: Bench, contender: Contender, chosen: Mapping[str, float], task: Task) -> dict[str, float]:
    """The controller's memory at first: what holds the nominal arm at rest; a practised user knows it too."""
    lumps = bench.lumps
    current = -lumps["c1"] / lumps["c3"] * math.cos(task.start)
    voltage = lumps["c5"] / lumps["c6"] * current
    speed = voltage * lumps["c6"] / lumps["c4"]
    known = {
        "theta_hat": task.start,
        "i_hat": current,
        "user_sum": speed / chosen["user_i"] if contender.key == "proportional_voltage" else 0.0,
        "servo_sum": voltage / chosen.get("servo_i", 1.0),
        "servo_lag": task.start,
        "pid_lag": task.start,
    }
    memory = {s.name for s in loop_of(bench, contender).wiring.memory}
    return {name: value for name, value in known.items() if name in memory}
