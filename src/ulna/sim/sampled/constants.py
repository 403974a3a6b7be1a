"""Numbers of a loop that hold for a whole run: of the controller, and what estimator and controller begin with."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy as sp
from scipy.linalg import expm

from ulna.base import SimulationError
from ulna.program import to_python
from ulna.sim.sampled.discretisation import ExactHold
from ulna.sim.sampled.sampled import Sampled
from ulna.sim.sampled.wiring import Wiring
from ulna.symbolic.compiling import kernel, rounded
from ulna.system import LinearInjection


def held_numbers(settings: Sampled, wiring: Wiring) -> np.ndarray:
    """The controller's constants, then Φ, G₀ and G₁ row by row."""
    known = parameters_of(settings, wiring)
    before = wiring.controller.before
    values = to_python(before)(*(known[int(name[1:])] for name in before.inputs))
    if not all(map(math.isfinite, values)):
        raise SimulationError(
            f"controller '{settings.controller.name}'", "its formulas are not finite for its parameters."
        )
    estimator = settings.estimator
    if not isinstance(settings.discretisation, ExactHold) or not isinstance(estimator, LinearInjection):
        return np.array([*values, 0.0])
    symbols = estimator.system.parameter_symbols
    table = dict(zip(symbols, known, strict=False))
    matrix = np.array(estimator.matrix.xreplace(table), dtype=float)
    blocks = held_matrices(matrix, settings.period, interpolate=settings.discretisation.interpolate)
    return np.concatenate([np.array(values), *(block.ravel() for block in blocks)])


def held_matrices(matrix: np.ndarray, period: float, *, interpolate: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(Φ, G₀, G₁), each (n, n), of z' = F z + w with w on a straight line from w₀ to w₁, or held at w₀.

    One matrix exponential gives all three: C. F. Van Loan, "Computing integrals involving the matrix exponential",
    IEEE Trans. Autom. Contr. 23 (1978).
    """
    n = len(matrix)
    whole = np.zeros((3 * n, 3 * n))
    whole[:n, :n] = matrix * period
    whole[:n, n : 2 * n] = np.eye(n) * period
    whole[n : 2 * n, 2 * n :] = np.eye(n)
    grown = expm(whole)
    phi, step, ramp = grown[:n, :n], grown[:n, n : 2 * n], grown[:n, 2 * n :]
    return (phi, step - ramp, ramp) if interpolate else (phi, step, np.zeros((n, n)))


def parameters_of(settings: Sampled, wiring: Wiring) -> list[float]:
    """The SI values of the parameters of estimator and controller."""
    names = [name for name, _ in wiring.parameters]
    unknown = [name for name in settings.parameters if name not in names]
    if unknown:
        raise SimulationError(
            f"parameters of the controller '{settings.controller.name}'",
            f"it has no {', '.join(unknown)}.",
            f"Known: {', '.join(dict.fromkeys(names)) or 'none'}.",
        )
    missing = [name for name, value in wiring.parameters if value is None and name not in settings.parameters]
    if missing:
        raise SimulationError(
            f"controller '{settings.controller.name}'",
            f"parameters without a value: {', '.join(dict.fromkeys(missing))}.",
            f"Give them: Sampled(parameters={{'{missing[0]}': ...}}).",
        )
    return [
        rounded(value, name) if value is not None and name not in settings.parameters else settings.parameters[name]
        for name, value in wiring.parameters
    ]


def memory_rows(settings: Sampled, wiring: Wiring, own: Mapping[str, np.ndarray], runs: int) -> np.ndarray:
    """(runs, states of estimator and controller) at the start, at least one column.

    Args:
        settings: of the loop; what it says holds for all runs alike.
        wiring: names.
        own: by name what each run has of its own, (runs,).
        runs: their number.

    Raises:
        SimulationError: names that fit nothing, values that are not finite.
    """
    names = [s.name for s in wiring.memory]
    estimator = settings.estimator
    shown = [s.name for s in estimator.system.outputs] if isinstance(estimator, LinearInjection) else []
    given = {**settings.initial, **own}
    unknown = [name for name in given if name not in (*names, *shown)]
    if unknown:
        raise SimulationError(
            "initial state of the controller",
            f"there is no {', '.join(unknown)}.",
            f"Known: {', '.join((*names, *shown)) or 'none'}.",
        )
    start = {name: np.broadcast_to(np.asarray(given.get(name, 0.0), dtype=float), (runs,)) for name in names}
    if isinstance(estimator, LinearInjection):
        begun = _started(estimator, {name: given.get(name, 0.0) for name in shown}, settings, wiring, runs)
        start |= {name: values for name, values in begun.items() if name not in given}
    table = np.zeros((runs, max(1, len(names))))
    for column, name in enumerate(names):
        table[:, column] = start[name]
    if not np.isfinite(table).all():
        raise SimulationError("initial state of the controller", "a value is not a finite number.")
    return table


def _started(
    estimator: LinearInjection, shown: Mapping[str, Any], settings: Sampled, wiring: Wiring, runs: int
) -> dict[str, np.ndarray]:
    """The estimator's states for the estimates wanted at the start."""
    symbols = [sp.Symbol(name, real=True) for name in shown]
    own = [s.name for s in estimator.system.states]
    values = dict(zip(estimator.system.parameter_symbols, parameters_of(settings, wiring), strict=False))
    expressions = [expression.xreplace(values) for expression in estimator.start]
    evaluate = to_python(kernel("start", symbols, dict(zip(own, expressions, strict=True))))
    if all(np.ndim(value) == 0 for value in shown.values()):
        row = evaluate(*(float(value) for value in shown.values()))
        return {name: np.full(runs, value) for name, value in zip(own, row, strict=True)}
    # One by one: a run gets the same bits alone.
    rows = np.stack([np.broadcast_to(np.asarray(value, dtype=float), (runs,)) for value in shown.values()], axis=1)
    begun = np.array([evaluate(*row) for row in rows.tolist()])
    return dict(zip(own, begun.T, strict=True))
