"""Where a plant rests with its inputs held, every point with its poles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import sympy as sp

from ulna.base import PlantError
from ulna.design.analysis.answer import Answer, not_applicable
from ulna.symbolic.compiling import batch_jacobian
from ulna.system import NON_SMOOTH, System, equilibria, equilibrium, linearise

_SECONDS = 1.5
"""s of search in boxes."""
_NEAR = 1e-6
_ZERO = 1e-9
"""Real parts, relative to the pole, that say nothing about stability."""


def rest_points(system: System, within: Mapping[str, tuple[float, float]] | None = None) -> dict[str, Answer]:
    """Every equilibrium found with the inputs at the operating point's values, nearest to that point first.

    Args:
        system: the plant.
        within: (lower, upper) by state, SI; left out, what `equilibria` takes.
    """
    key = "rest_points"
    try:
        here = equilibrium(system)
        # Exact: with a rounded input nothing rests where a state is free, as a position is.
        inputs = {u.name: here.inputs[u.symbol].xreplace(system.values) for u in system.inputs}
        found = equilibria(system, within, inputs=inputs, seconds=_SECONDS)
        at = {s.name: here[s.name] for s in system.states}
    except PlantError as error:
        return {key: not_applicable(key, str(error))}
    points = [{s.name: float(point.states[s.symbol]) for s in system.states} for point in found]
    resting = here.verdict.holds and not within
    if resting:
        # It is exact, where a search comes near: at a double zero by 1e-8, which is enough to tilt a pole off the axis.
        # It may also lie in a part that stayed undecided, or on a line of equilibria of which it is the one to show.
        others = [p for p in points if any(abs(p[k] - v) > _NEAR * (1 + abs(v)) for k, v in at.items())]
        points = [at, *(() if found.line and len(others) == len(points) else others)]
    points.sort(key=lambda point: sum(abs(point[name] - value) for name, value in at.items()))
    held = {name: float(value) for name, value in inputs.items()}
    evidence = {"within": dict(found.within), "inputs": inputs} | ({"free": found.free} if found.free else {})
    verdict = replace(found.complete, evidence={**found.complete.evidence, **evidence})
    return {key: Answer(verdict=verdict, value=_told(system.with_values(), points, held))}


def _told(system: System, points: list[dict[str, float]], held: Mapping[str, float]) -> list[dict[str, object]]:
    """States, poles as text and whether they tell stability; None where a pole is on the imaginary axis or none is."""
    if not points:
        return []
    # Compiled once: a plant may rest at hundreds of points.
    symbols = (*system.state_symbols, *system.input_symbols)
    jacobian = batch_jacobian("poles", system.inline(system.rates), system.state_symbols, symbols)
    at = {name: np.array([point[name] for point in points]) for name in points[0]}
    with np.errstate(all="ignore"):
        matrices = jacobian(at | {name: np.array(value) for name, value in held.items()})
    if any(r.has(*NON_SMOOTH) for r in system.inline(system.rates)):
        jumps = [_on_a_jump(system, {**point, **held}) for point in points]
        matrices[jumps] = np.nan
    return [{"states": point} | _stability(A) for point, A in zip(points, matrices, strict=True)]


def _on_a_jump(system: System, point: Mapping[str, float]) -> bool:
    A = linearise(system, point).A
    return A.has(sp.DiracDelta) or not all(e.is_number and e.is_finite for e in A)


def _stability(A: np.ndarray) -> dict[str, object]:
    if not np.isfinite(A).all():
        return {"poles": None, "stable": None}
    poles = sorted(map(complex, np.linalg.eigvals(A)), key=lambda p: (-p.real, p.imag))
    open_question = abs(poles[0].real) <= _ZERO * max(1.0, *(abs(p) for p in poles))
    return {"poles": [_pole(p) for p in poles], "stable": None if open_question else poles[0].real < 0}


def _pole(value: complex) -> str:
    real, imaginary = (part if abs(part) > _ZERO * abs(value) else 0.0 for part in (value.real, value.imag))
    return f"{real:.6g}{imaginary:+.6g}j" if imaginary else f"{real:.6g}"
