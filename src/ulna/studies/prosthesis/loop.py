"""The loop of the bench: processor at the samples, plant in Runge-Kutta steps between, many plants side by side.

It differs from the general sampled loop of `ulna.sim`: it keeps whole trajectories of many plants, knows a battery and
a current limit, and is compiled once for all controllers, which it gets as functions; tests hold the two against each
other. Numbers of a block of plants lie in rows of `lanes`, quantity by quantity: quantity j of plant l at
[j · lanes + l]. A row is what the compiler makes vector code of.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, no_type_check

import numpy as np

ROUNDING = 6755399441055744.0
"""1.5 · 2^52: adding and subtracting it rounds to the nearest whole number."""
REFERENCE, APPLIED = 3, 7
"""First row of the reference, and row of the applied voltage, among what a controller reads."""
LOST = 1e9
"""V from which a command counts as that of a controller that has lost itself."""


def _signature(numba: Any) -> Any:
    """That of `run_blocks`."""
    row, table, stack = numba.float64[::1], numba.float64[:, ::1], numba.float64[:, :, ::1]
    rates = numba.types.FunctionType(numba.void(*[row] * 4))
    kept = numba.types.Array(numba.float64, 2, "C", readonly=True)
    numbers = (numba.int64, numba.float64, numba.int64)
    return numba.void(*[rates] * 3, *numbers, *[table] * 7, row, row, kept, table, stack)


def _compiled(function: Callable[..., Any], signature: Callable[[Any], Any] | None = None) -> Any:
    """The function compiled, once a machine where there is a folder to keep it in; as it is without Numba."""
    try:
        import numba
    except ImportError:
        return function
    arguments = () if signature is None else (signature(numba),)
    try:
        return numba.njit(*arguments, error_model="numpy", nogil=True, cache=True)(function)
    except RuntimeError:
        return numba.njit(*arguments, error_model="numpy", nogil=True)(function)


# Compiled by Numba, which cannot read what run-time type checks put around a function.
@_compiled
@no_type_check
def limit(lanes, x, hardware, wanted, given, flags):  # noqa: ANN001, ANN201
    """What the bridge can give now of `wanted`, into the first row of `given`; `flags` where that is not all.

    Battery behind its resistance, then the current limit of the amplifier.
    """
    for lane in range(lanes):
        ceiling, cell = hardware[lanes + lane], hardware[2 * lanes + lane]
        drop = hardware[3 * lanes + lane] * x[2 * lanes + lane]
        peak, ohms = hardware[4 * lanes + lane], hardware[5 * lanes + lane]
        emf = hardware[6 * lanes + lane] * x[lanes + lane]
        upper, lower = min(ceiling, cell - drop), max(-ceiling, -cell - drop)
        upper = min(upper, max(lower, emf + ohms * peak))
        lower = max(lower, min(upper, emf - ohms * peak))
        u = min(max(wanted[lane], lower), upper)
        given[lane] = u
        flags[lane] = 0.0 if u == wanted[lane] else 1.0


@_compiled
@no_type_check
def keep(k, first, count, lanes, x, given, flags, record):  # noqa: ANN001, ANN201
    """Angle, current, voltage and flag of sample k into the record."""
    for lane in range(count):
        record[0, first + lane, k] = x[lane]
        record[1, first + lane, k] = x[2 * lanes + lane]
        record[2, first + lane, k] = given[lane]
        record[3, first + lane, k] = flags[lane]


@_compiled
@no_type_check
def sense(k, lanes, x, noise, hardware, reference, seen):  # noqa: ANN001, ANN201
    """What controllers read at sample k: `CONTROL_INPUTS` but for the voltage, the angle through noise and encoder."""
    for lane in range(lanes):
        step = hardware[lane]
        seen[lane] = step * (((x[lane] + noise[lane]) / step + ROUNDING) - ROUNDING)
        seen[lanes + lane] = x[lanes + lane]
        seen[2 * lanes + lane] = x[2 * lanes + lane]
    for row in range(reference.shape[0]):
        value = reference[row, k]
        for lane in range(lanes):
            seen[(REFERENCE + row) * lanes + lane] = value * hardware[9 * lanes + lane]


@_compiled
@no_type_check
def runge_kutta(rates, h, x, begin, middle, end, numbers, at, slope, total):  # noqa: ANN001, ANN201
    """One classical Runge-Kutta step of length h, in place; `rates` is f(at, given, numbers, slope).

    What is given is `begin`, `middle` and `end` at the places of the step.
    """
    half, sixth, size = 0.5 * h, h / 6.0, x.shape[0]
    rates(x, begin, numbers, slope)
    for j in range(size):
        total[j] = slope[j]
        at[j] = x[j] + half * slope[j]
    rates(at, middle, numbers, slope)
    for j in range(size):
        total[j] += 2.0 * slope[j]
        at[j] = x[j] + half * slope[j]
    rates(at, middle, numbers, slope)
    for j in range(size):
        total[j] += 2.0 * slope[j]
        at[j] = x[j] + h * slope[j]
    rates(at, end, numbers, slope)
    for j in range(size):
        x[j] += sixth * (total[j] + slope[j])


@_compiled
@no_type_check
def stop_at_walls(lanes, x, hardware):  # noqa: ANN001, ANN201
    """An arm beyond its range is put back on the wall; a speed into the wall is lost."""
    for lane in range(lanes):
        low, high = hardware[7 * lanes + lane], hardware[8 * lanes + lane]
        angle, speed = x[lane], x[lanes + lane]
        x[lane] = min(max(angle, low), high)
        slowed = min(speed, 0.0) if angle > high else speed
        x[lanes + lane] = max(speed, 0.0) if angle < low else slowed


@_compiled
@no_type_check
def in_lanes(table, first, lanes, rows):  # noqa: ANN001, ANN201
    """Rows first … of (D, Q) into lanes; a block that is not full is filled up with the last row."""
    for lane in range(lanes):
        place = min(first + lane, table.shape[0] - 1)
        for column in range(table.shape[1]):
            rows[column * lanes + lane] = table[place, column]


@partial(_compiled, signature=_signature)
@no_type_check
def run_blocks(
    plant: Any,
    command: Any,
    memory_rates: Any,
    lanes: int,
    period: float,
    steps: int,
    starts: np.ndarray,
    memory: np.ndarray,
    voltages: np.ndarray,
    plant_numbers: np.ndarray,
    command_numbers: np.ndarray,
    memory_numbers: np.ndarray,
    reference: np.ndarray,
    load: np.ndarray,
    push: np.ndarray,
    noise: np.ndarray,
    hardware: np.ndarray,
    record: np.ndarray,
) -> None:
    """Run a controller on many plants, block by block; results go into `record`.

    At sample k: quantise the angle; advance the controller's memory from k − 1, what it reads on straight lines between
    the samples; compute the command; hold the command of sample k − 1 (limited by battery and current) on the motor
    until k + 1; advance the plant in `steps` classical Runge-Kutta steps, stop at the walls.

    Args:
        plant, memory_rates: f(state, input, numbers, out), the rates of a block. command: the same, out the command.
            The plant's input is (u, load, push); the controller's is `CONTROL_INPUTS`.
        lanes: plants of a block, for which the functions are made. period: s. steps: of the plant a period.
        starts: (D, n) plant states. memory: (1, m) of the controller. voltages: (D, 1) on the motor at first.
        plant_numbers: (D, P). command_numbers: (1, Q), memory_numbers: (1, R).
        reference: (4, N). load, push: (N,). noise: (D, N) rad.
        hardware: (D, 11) encoder step, voltage limit, cell voltage, cell resistance, current limit, Ra, N kb, lower
            wall, upper wall; infinite where there is none; then factors of the plant's own on reference and load.
        record: (4, D, N) angle, current, voltage on the motor, whether the command was limited.
    """
    n, m = starts.shape[1] * lanes, memory.shape[1] * lanes
    x, x_at, x_slope, x_sum = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    z, z_at, z_slope, z_sum = np.empty(m), np.empty(m), np.empty(m), np.empty(m)
    own = np.empty(plant_numbers.shape[1] * lanes)
    held, kept = np.empty(command_numbers.shape[1] * lanes), np.empty(memory_numbers.shape[1] * lanes)
    parts, heard = np.empty(hardware.shape[1] * lanes), np.empty(lanes)
    given = np.empty(3 * lanes)
    older, between, seen = np.empty(8 * lanes), np.empty(8 * lanes), np.empty(8 * lanes)
    wanted, flags = np.empty(lanes), np.empty(lanes)
    for first in range(0, starts.shape[0], lanes):
        count = min(lanes, starts.shape[0] - first)
        in_lanes(starts, first, lanes, x)
        in_lanes(memory, 0, lanes, z)
        in_lanes(voltages, first, lanes, wanted)
        in_lanes(plant_numbers, first, lanes, own)
        in_lanes(command_numbers, 0, lanes, held)
        in_lanes(memory_numbers, 0, lanes, kept)
        in_lanes(hardware, first, lanes, parts)
        for k in range(reference.shape[1]):
            for lane in range(lanes):
                heard[lane] = noise[min(first + lane, starts.shape[0] - 1), k]
                given[lanes + lane] = load[k] * parts[10 * lanes + lane]
                given[2 * lanes + lane] = push[k]
            limit(lanes, x, parts, wanted, given, flags)
            keep(k, first, count, lanes, x, given, flags, record)
            sense(k, lanes, x, heard, parts, reference, seen)
            if k > 0 and m > 0:
                for j in range(8 * lanes):
                    between[j] = 0.5 * (older[j] + seen[j])
                runge_kutta(memory_rates, period, z, older, between, seen, kept, z_at, z_slope, z_sum)
            for lane in range(lanes):
                seen[APPLIED * lanes + lane] = given[lane]
            command(z, seen, held, wanted)
            for j in range(8 * lanes):
                older[j] = seen[j]
            for lane in range(lanes):
                # A controller that has lost itself gives nothing: 0 V, as a watchdog does. A NaN is lost too.
                wanted[lane] = wanted[lane] if abs(wanted[lane]) < LOST else 0.0
            for _ in range(steps):
                runge_kutta(plant, period / steps, x, given, given, given, own, x_at, x_slope, x_sum)
                stop_at_walls(lanes, x, parts)
