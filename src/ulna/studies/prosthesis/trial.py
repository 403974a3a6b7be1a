"""A contender at a task on the plants of a bench: whole trajectories."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp

from ulna.studies.prosthesis.contender import CONTROL_INPUTS, Contender
from ulna.studies.prosthesis.designs import gain_numbers
from ulna.studies.prosthesis.loop import compiled_function, compiled_loop
from ulna.studies.prosthesis.plant import Bench, Draws
from ulna.studies.prosthesis.tasks import PERIOD, Task
from ulna.symbolic.program.hoist import hoist
from ulna.symbolic.program.kernel import kernel
from ulna.symbolic.program.lowering.numpy import to_numpy
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
    plant, numbers = _compiled_plant(bench.plant)
    control = compiled_control(contender.system)
    starts, voltages = starts_at_rest(bench, task, draws)
    record = np.empty((4, draws.count, task.count + 1))
    compiled_loop(plant)(
        plant,
        control,
        PERIOD,
        finer * plant_steps(bench),
        starts,
        first_memory(bench, contender, chosen, task),
        voltages,
        numbers(draws.parameters),
        control_numbers(bench, contender, chosen),
        np.ascontiguousarray(task.reference),
        task.load,
        task.push,
        encoder_noise(bench, task, draws),
        hardware_of(bench, draws),
        record,
    )
    return Runs(angle=record[0], current=record[1], voltage=record[2], limited=record[3])


def prepare(bench: Bench, contender: Contender) -> None:
    """Compile what a trial needs, so that threads find it ready."""
    plant, _ = _compiled_plant(bench.plant)
    compiled_loop(plant)
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


def encoder_noise(bench: Bench, task: Task, draws: Draws) -> np.ndarray:
    """(D, N) noise in rad before the quantiser, the same for every controller."""
    generator = np.random.default_rng([draws.seed, sum(map(ord, task.key))])
    return NOISE * bench.step * generator.standard_normal((draws.count, task.count + 1))


def hardware_of(bench: Bench, draws: Draws) -> np.ndarray:
    """(D, 9) the rows that the loop wants; see `run_block`. The amplifier measures current: it knows each winding."""
    ohms = draws.parameters[:, [p.name for p in bench.plant.parameters].index("Ra")]
    before = (bench.step, bench.voltage, bench.cell, bench.cell_resistance, bench.current)
    after = (bench.value("N") * bench.value("kb"), *bench.walls)
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


def _compiled_plant(plant: System) -> tuple[Any, Callable[[np.ndarray], np.ndarray]]:
    """The plant as a compiled function, and what makes its numbers, (D, H), of parameters (D, P).

    Presets differ in numbers only, so that all of them share one function.
    """
    return _compiled_rates(plant.inline(plant.rates), plant.state_symbols, plant.input_symbols, plant.parameter_symbols)


@lru_cache(maxsize=8)
def _compiled_rates(
    rates: tuple[sp.Expr, ...],
    states: tuple[sp.Symbol, ...],
    inputs: tuple[sp.Symbol, ...],
    parameters: tuple[sp.Symbol, ...],
) -> tuple[Any, Callable[[np.ndarray], np.ndarray]]:
    named = {f"rate{k}": e for k, e in enumerate(rates)}
    names = [p.name for p in parameters]
    parts = hoist(kernel("bench", [*states, *inputs, *parameters], named, held=parameters), names)
    before = to_numpy(parts.before)
    columns = [names.index(name) for name in parts.before.inputs]

    def numbers(table: np.ndarray) -> np.ndarray:
        rows = before(*table.T[columns])
        return np.ascontiguousarray(np.stack([np.broadcast_to(row, len(table)) for row in rows], axis=1))

    return compiled_function(parts.main, (len(states), len(inputs))), numbers


@lru_cache(maxsize=32)
def compiled_control(system: System) -> Any:
    """The controller as a compiled function: out holds the rates of its memory, then the command."""
    inputs = [sp.Symbol(name, real=True) for name in CONTROL_INPUTS]
    symbols = [*system.state_symbols, *inputs, *system.parameter_symbols]
    outputs = {f"rate{k}": e for k, e in enumerate(system.inline(system.rates))}
    outputs["u"] = system.inline(system.readouts)[0]
    return compiled_function(kernel(system.name, symbols, outputs), (len(system.states), len(inputs)))
