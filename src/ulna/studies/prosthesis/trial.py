"""A contender at a task on the plants of a bench: whole trajectories."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.util import find_spec
from typing import Any

import numpy as np
import sympy as sp

from ulna.base import OptionalDependencyError
from ulna.studies.prosthesis.contender import CONTROL_INPUTS, Contender
from ulna.studies.prosthesis.designs import gain_numbers
from ulna.studies.prosthesis.lanes import LANES, Block, block
from ulna.studies.prosthesis.plant import Bench, Draws
from ulna.studies.prosthesis.tasks import PERIOD, Task
from ulna.system import System

NOISE = 0.3
"""Standard deviation of the noise before the encoder's quantiser, in codes (choice)."""
STIFFNESS = 2.0
"""Largest Runge-Kutta step of the plant in electrical time constants La/Ra; 2.78 is the bound of stability."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Runs:
    """Trajectories of D plants at N samples, in SI; `limited` where the drive could not give what was asked."""

    angle: np.ndarray
    current: np.ndarray
    voltage: np.ndarray
    limited: np.ndarray


def run_trial(
    bench: Bench, contender: Contender, chosen: Mapping[str, float], task: Task, draws: Draws, *, finer: int = 1
) -> Runs:
    """The contender with its chosen numbers at the task on every plant of the draws.

    Each plant starts at rest under its own load, held by the drive; the controller knows the nominal load only.

    Args:
        finer: so many times more steps of the plant than needed, to check the steps.
    """
    plant = compiled_plant(bench.plant)
    return run_on(bench, contender, chosen, task, draws, plant.function, plant.numbers(draws.parameters), finer=finer)


def run_on(
    bench: Bench,
    contender: Contender,
    chosen: Mapping[str, float],
    task: Task,
    draws: Draws,
    plant: Any,
    numbers: np.ndarray,
    *,
    finer: int = 1,
) -> Runs:
    """`run_trial` with the plants' rates as a function of `loop.run_blocks` and the (D, P) numbers that it wants."""
    starts, voltages = starts_at_rest(bench, task, draws)
    return run_loop(
        plant,
        numbers,
        contender.system,
        control_numbers(bench, contender, chosen),
        first_memory(bench, contender, chosen, task),
        finer * plant_steps(bench),
        starts,
        voltages,
        task,
        encoder_noise(bench.step, task.key, task.count, draws.count, draws.seed),
        hardware_of(bench, draws),
    )


def run_loop(
    plant: Any,
    plant_numbers: np.ndarray,
    controller: System,
    values: np.ndarray,
    memory: np.ndarray,
    steps: int,
    starts: np.ndarray,
    voltages: np.ndarray,
    task: Task,
    noise: np.ndarray,
    hardware: np.ndarray,
) -> Runs:
    """Any controller on D plants at a task.

    Args:
        plant: rates of a block; plant_numbers: (D, P) what they want.
        controller: its inputs among `CONTROL_INPUTS`; values: (Q,) of its parameters, in order; memory: (m,) at first.
        steps: of the plant a period. starts: (D, n) plant states; voltages: (D,) on the motor at first.
        noise: (D, N) rad. hardware: (D, 11), see `loop.run_blocks`.
    """
    command, rates = compiled_control(controller)
    record = np.empty((4, len(starts), task.count + 1))
    _loop()(
        plant,
        command.function,
        rates.function,
        LANES,
        PERIOD,
        steps,
        starts,
        memory[None, :],
        voltages[:, None],
        plant_numbers,
        command.numbers(values[None, :]),
        rates.numbers(values[None, :]),
        np.ascontiguousarray(task.reference),
        task.load,
        task.push,
        noise,
        hardware,
        record,
    )
    return Runs(angle=record[0], current=record[1], voltage=record[2], limited=record[3])


def prepare(bench: Bench, contender: Contender) -> None:
    """Compile what a trial needs, so that threads find it ready."""
    _loop()
    compiled_plant(bench.plant)
    compiled_control(contender.system)


def plant_steps(bench: Bench) -> int:
    """Runge-Kutta steps a period: the electrical time constant, at the warmest winding, sets them."""
    return max(1, math.ceil(PERIOD / bench.electrical_time * 1.2 / STIFFNESS))


def control_numbers(bench: Bench, contender: Contender, chosen: Mapping[str, float]) -> np.ndarray:
    """(Q,) the numbers of the contender's system, in the order of its parameters."""
    from ulna.studies.prosthesis.baselines import DIFFERENTIATOR, VISUAL_DELAY

    known = dict(bench.lumps) | dict(chosen) | gain_numbers(contender, dict(chosen))
    known |= {"T_d": DIFFERENTIATOR, "T_see": VISUAL_DELAY, "v_max": 1.2 * bench.motion.speed}
    known["u_max"] = bench.voltage if bench.voltage < math.inf else 1e9
    return np.array([known[p.name] for p in contender.system.parameters])


@lru_cache(maxsize=6)
def encoder_noise(step: float, key: str, count: int, plants: int, seed: int) -> np.ndarray:
    """(D, N) noise in rad before the quantiser of a task of this key, the same for every controller."""
    generator = np.random.default_rng([seed, sum(map(ord, key))])
    noise = NOISE * step * generator.standard_normal((plants, count + 1))
    noise.flags.writeable = False
    return noise


def hardware_of(bench: Bench, draws: Draws) -> np.ndarray:
    """(D, 11) the rows that the loop wants; see `run_blocks`. The amplifier measures current: it knows each winding."""
    ohms = draws.parameters[:, [p.name for p in bench.plant.parameters].index("Ra")]
    before = (bench.step, bench.voltage, bench.cell, bench.cell_resistance, bench.current)
    after = (bench.value("N") * bench.value("kb"), *bench.walls, 1.0, 1.0)
    return np.array([[*before, each, *after] for each in ohms])


def starts_at_rest(bench: Bench, task: Task, draws: Draws) -> tuple[np.ndarray, np.ndarray]:
    """(D, 3) states at rest and (D,) voltages that hold them."""
    names = [p.name for p in bench.plant.parameters]
    m1, m2, b, g, n, km, eta, ohms = (
        draws.parameters[:, names.index(k)] for k in ("m1", "m2", "b", "g", "N", "km", "eta", "Ra")
    )
    moment = (m2 + task.load[0] + m1 / 2) * g * b * math.cos(task.start)
    current = -moment / (eta * n * km)
    angle = np.full(draws.count, task.start)
    return np.stack([angle, np.zeros(draws.count), current], axis=1), ohms * current


def first_memory(bench: Bench, contender: Contender, chosen: Mapping[str, float], task: Task) -> np.ndarray:
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
    return np.array([known.get(s.name, 0.0) for s in contender.system.states])


def compiled_plant(plant: System) -> Block:
    """The plant's rates. Presets differ in numbers only, so that all of them share one function."""
    rates = plant.inline(plant.rates)
    return _rates_block("bench", rates, plant.state_symbols, plant.input_symbols, plant.parameter_symbols)


@lru_cache(maxsize=32)
def compiled_control(system: System) -> tuple[Block, Block]:
    """The controller's command, and the rates of its memory."""
    inputs = tuple(sp.Symbol(name, real=True) for name in CONTROL_INPUTS)
    symbols = system.state_symbols, inputs, system.parameter_symbols
    command = block(system.name, *symbols, {"u": system.inline(system.readouts)[0]})
    return command, _rates_block(system.name, system.inline(system.rates), *symbols)


@lru_cache(maxsize=32)
def _rates_block(
    name: str,
    rates: tuple[sp.Expr, ...],
    states: tuple[sp.Symbol, ...],
    inputs: tuple[sp.Symbol, ...],
    parameters: tuple[sp.Symbol, ...],
) -> Block:
    return block(name, states, inputs, parameters, {f"rate{k}": e for k, e in enumerate(rates)})


@cache
def _loop() -> Callable[..., None]:
    """`run_blocks`, compiled.

    Raises:
        OptionalDependencyError: without Numba.
    """
    if find_spec("numba") is None:
        raise OptionalDependencyError("the comparison of controllers", "campaign")
    # Late: its import compiles.
    from ulna.studies.prosthesis.loop import run_blocks

    return run_blocks
