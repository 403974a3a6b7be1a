"""The loop of the bench, plain Python for Numba: processor at the samples, plant in Runge-Kutta steps between.

It differs from the general sampled loop of `ulna.sim`: it keeps whole trajectories of many plants, knows a battery and
a current limit, and is compiled once for all controllers, which it gets as functions.

Longer than 80 lines because one period of one run stands in one function, in the order in which it happens.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any, no_type_check

import numpy as np

from ulna.base import OptionalDependencyError
from ulna.symbolic.program.kernel import Kernel
from ulna.symbolic.program.lowering.python_source import to_python_source


# Compiled by Numba, which cannot read what run-time type checks put around a function.
@no_type_check
def run_block(  # noqa: PLR0912, PLR0915 (one period of one run, in the order in which it happens)
    plant: Any,
    control: Any,
    period: float,
    steps: int,
    starts: np.ndarray,
    memory: np.ndarray,
    voltages: np.ndarray,
    plant_numbers: np.ndarray,
    control_numbers: np.ndarray,
    reference: np.ndarray,
    load: np.ndarray,
    push: np.ndarray,
    noise: np.ndarray,
    hardware: np.ndarray,
    record: np.ndarray,
) -> None:
    """Run a controller on many plants, one after the other; results go into `record`.

    At sample k: quantise the angle, compute the command from the memory, hold the command of sample k − 1 (limited by
    battery and current) on the motor until k + 1, advance the controller's memory with it and the plant in `steps`
    classical Runge-Kutta steps, stop at the walls.

    Args:
        plant, control: f(state, input, numbers, out). The plant's input is (u, load, push); the control's is
            `CONTROL_INPUTS`, its out the memory's rates, then the command.
        period: s. steps: of the plant a period.
        starts: (D, n) plant states. memory: (m,) of the controller. voltages: (D,) on the motor at first.
        plant_numbers: (D, P). control_numbers: (Q,). reference: (4, N). load, push: (N,). noise: (D, N) rad.
        hardware: (D, 9) encoder step, voltage limit, cell voltage, cell resistance, current limit, Ra, N kb, lower
            wall, upper wall; infinite where there is none.
        record: (4, D, N) angle, current, voltage on the motor, whether the command was limited.
    """
    n, m = starts.shape[1], memory.shape[0]
    x, x_at, z, z_at = np.empty(n), np.empty(n), np.empty(m), np.empty(m)
    k1, k2, k3, k4 = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    r1, r2, r3, r4 = np.empty(m + 1), np.empty(m + 1), np.empty(m + 1), np.empty(m + 1)
    seen, driven = np.empty(8), np.empty(3)
    h = period / steps
    for d in range(starts.shape[0]):
        step, limit, cell, inner, peak, ohms, emf, low, high = hardware[d]
        x[:] = starts[d]
        z[:] = memory
        command = voltages[d]
        numbers = plant_numbers[d]
        for k in range(reference.shape[1]):
            # What the bridge can give now: battery behind its resistance, then the current limit of the amplifier.
            upper = min(limit, cell - inner * x[2]) if cell < math.inf else limit
            lower = max(-limit, -cell - inner * x[2]) if cell < math.inf else -limit
            if peak < math.inf:
                upper = min(upper, max(lower, emf * x[1] + ohms * peak))
                lower = max(lower, min(upper, emf * x[1] - ohms * peak))
            u = min(max(command, lower), upper)
            record[0, d, k] = x[0]
            record[1, d, k] = x[2]
            record[2, d, k] = u
            record[3, d, k] = 0.0 if u == command else 1.0
            seen[0] = step * math.floor((x[0] + noise[d, k]) / step + 0.5)
            seen[1] = x[1]
            seen[2] = x[2]
            seen[3] = reference[0, k]
            seen[4] = reference[1, k]
            seen[5] = reference[2, k]
            seen[6] = reference[3, k]
            seen[7] = u
            control(z, seen, control_numbers, r1)
            command = r1[m]
            # A controller that has lost itself gives nothing: 0 V, as a watchdog does.
            if not (abs(command) < 1e9):
                command = 0.0
            for j in range(m):
                z_at[j] = z[j] + 0.5 * period * r1[j]
            control(z_at, seen, control_numbers, r2)
            for j in range(m):
                z_at[j] = z[j] + 0.5 * period * r2[j]
            control(z_at, seen, control_numbers, r3)
            for j in range(m):
                z_at[j] = z[j] + period * r3[j]
            control(z_at, seen, control_numbers, r4)
            for j in range(m):
                z[j] += period / 6.0 * (r1[j] + 2.0 * r2[j] + 2.0 * r3[j] + r4[j])
            driven[0] = u
            driven[1] = load[k]
            driven[2] = push[k]
            for _ in range(steps):
                plant(x, driven, numbers, k1)
                for j in range(n):
                    x_at[j] = x[j] + 0.5 * h * k1[j]
                plant(x_at, driven, numbers, k2)
                for j in range(n):
                    x_at[j] = x[j] + 0.5 * h * k2[j]
                plant(x_at, driven, numbers, k3)
                for j in range(n):
                    x_at[j] = x[j] + h * k3[j]
                plant(x_at, driven, numbers, k4)
                for j in range(n):
                    x[j] += h / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j])
                if x[0] > high:
                    x[0] = high
                    x[1] = min(x[1], 0.0)
                elif x[0] < low:
                    x[0] = low
                    x[1] = max(x[1], 0.0)


def compiled_function(kernel: Kernel, sizes: tuple[int, int]) -> Callable[..., None]:
    """The kernel, inputs in the order state, input, numbers, as a compiled f(state, input, numbers, out).

    Args:
        kernel: all its inputs in that order. sizes: of state and input.

    Raises:
        OptionalDependencyError: without Numba.
    """
    numba = _numba()
    states, inputs = sizes
    places = [f"state[{k}]" for k in range(states)] + [f"given[{k}]" for k in range(inputs)]
    places += [f"numbers[{k}]" for k in range(len(kernel.inputs) - states - inputs)]
    source = to_python_source(kernel, function_name="formulas").splitlines()
    body = [f"    {name} = {place}" for name, place in zip(kernel.identifiers, places, strict=True)]
    values = source[-1].strip().removeprefix("return (").removesuffix(")")
    results = [value.strip() for value in values.split(",") if value.strip()]
    lines = ["def function(state, given, numbers, out):", *body, *source[1:-1]]
    lines += [f"    out[{k}] = {value}" for k, value in enumerate(results)]
    namespace: dict[str, Any] = {"math": math}
    # The source comes from a Kernel, never from a user's text.
    exec(compile("\n".join(lines), f"<ulna bench {kernel.name}>", "exec"), namespace)  # noqa: S102
    return numba.njit(_signature(numba), error_model="numpy", nogil=True)(namespace["function"])


@cache
def compiled_loop(plant: Callable[..., None]) -> Callable[..., None]:
    """`run_block` for a plant from `compiled_function`, put in line, and any controller, called through its address."""
    numba = _numba()
    function = numba.types.FunctionType(_signature(numba))
    real, row, table = numba.float64, numba.float64[::1], numba.float64[:, ::1]
    arguments = (numba.typeof(plant), function, real, numba.int64, table, row, row, table, row, table, row, row, table)
    signature = numba.void(*arguments, table, numba.float64[:, :, ::1])
    return numba.njit(signature, error_model="numpy", nogil=True)(run_block)


def _signature(numba: Any) -> Any:
    row = numba.float64[::1]
    return numba.void(row, row, row, row)


def _numba() -> Any:
    try:
        import numba
    except ImportError:
        raise OptionalDependencyError("the comparison of controllers", "campaign") from None
    return numba
