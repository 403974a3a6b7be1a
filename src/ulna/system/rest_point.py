"""Where a system rests, and how it moves near there, in numbers: for closed loops with no closed-form equilibrium."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import sympy as sp

from ulna.base.errors import PlantError
from ulna.program import to_numpy
from ulna.symbolic.compiling import kernel
from ulna.system.system import System

_STEPS = 100
_TOLERANCE = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class RestPoint:
    """An equilibrium in numbers.

    Attributes:
        states, outputs: SI value by name.
        poles: (n,) eigenvalues of the linearisation there, slowest first.
    """

    states: Mapping[str, float]
    outputs: Mapping[str, float]
    poles: tuple[complex, ...]


def rest_point(
    system: System, near: Mapping[str, float] | None = None, inputs: Mapping[str, float] | None = None
) -> RestPoint:
    """The equilibrium that Newton's method reaches from a point.

    Args:
        system: its parameters need values.
        near: SI value by state name to start from, zero where left out.
        inputs: constant SI value by input name, zero where left out.

    Raises:
        PlantError: for parameters without value, or if no equilibrium is reached.
    """
    numeric = system.with_values()
    if numeric.parameters:
        names = ", ".join(p.name for p in numeric.parameters)
        raise PlantError(f"rest point of '{system.name}'", f"parameters without a value: {names}.", "Give them values.")
    symbols = (*numeric.state_symbols, *numeric.input_symbols)
    rates = {f"rate_{s.name}": r for s, r in zip(numeric.states, numeric.rates, strict=True)}
    unknown = list(numeric.state_symbols)
    slopes = sp.Matrix(numeric.rates).jacobian(unknown)
    field = to_numpy(kernel("rates", symbols, rates))
    jacobian = to_numpy(kernel("slopes", symbols, {f"s{k}": e for k, e in enumerate(slopes)}))
    held = [float((inputs or {}).get(s.name, 0.0)) for s in numeric.inputs]
    point = np.array([float((near or {}).get(s.name, 0.0)) for s in numeric.states])
    n = len(point)
    residual = np.array(field(*point, *held))
    for _ in range(_STEPS):
        matrix = np.array(jacobian(*point, *held)).reshape(n, n)
        step = np.linalg.lstsq(matrix, residual, rcond=None)[0]
        point, residual = _damped(field, held, point, residual, step)
        if np.max(np.abs(step), initial=0.0) <= _TOLERANCE * (1.0 + np.max(np.abs(point))):
            break
    if not np.max(np.abs(residual), initial=0.0) < 1e-8 * (1.0 + np.max(np.abs(point))):
        raise PlantError(f"rest point of '{system.name}'", "Newton's method found none.", "Start it nearer to one.")
    at = dict(zip(symbols, (sp.Float(v) for v in (*point, *held)), strict=True))
    matrix = np.array(jacobian(*point, *held)).reshape(n, n)
    poles = sorted(np.linalg.eigvals(matrix), key=lambda p: (-p.real, p.imag))
    return RestPoint(
        states={s.name: float(v) for s, v in zip(numeric.states, point, strict=True)},
        outputs={s.name: float(e.subs(at)) for s, e in zip(numeric.outputs, numeric.readouts, strict=True)},
        poles=tuple(complex(p) for p in poles),
    )


def _damped(
    field: Callable[..., tuple[float, ...]],
    held: list[float],
    point: np.ndarray,
    residual: np.ndarray,
    step: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Newton's step, halved until the residual falls (or the step no longer matters)."""
    share = 1.0
    size = np.linalg.norm(residual)
    while True:
        candidate = point - share * step
        value = np.array(field(*candidate, *held))
        if share < 1e-4 or (np.all(np.isfinite(value)) and np.linalg.norm(value) <= size):
            return candidate, value
        share /= 2
