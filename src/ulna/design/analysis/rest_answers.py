"""Where a plant rests with its inputs held, every point with its poles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ulna.base import PlantError
from ulna.design.analysis.answer import Answer, not_applicable
from ulna.system import Equilibrium, System, equilibria, equilibrium, linearise

_SECONDS = 1.5
"""s of search in boxes."""
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
        inputs = {u.name: here[u.name] if system.values else here.inputs[u.symbol] for u in system.inputs}
        found = equilibria(system, within, inputs=inputs, seconds=_SECONDS)
        at = {s.name: here[s.name] for s in system.states}
    except PlantError as error:
        return {key: not_applicable(key, str(error))}
    nearest = sorted(found, key=lambda p: sum(abs(p[name] - value) for name, value in at.items()))
    evidence = {"within": dict(found.within), "inputs": inputs} | ({"free": found.free} if found.free else {})
    verdict = replace(found.complete, evidence={**found.complete.evidence, **evidence})
    return {key: Answer(verdict=verdict, value=[_told(point) for point in nearest])}


def _told(point: Equilibrium) -> dict[str, object]:
    """States, poles as text and whether they tell stability; None where a pole is on the imaginary axis or none is."""
    A = linearise(point).A.xreplace(point.system.values)
    if not all(entry.is_number and entry.is_finite and entry.is_real for entry in A):
        return {"states": point.numbers, "poles": None, "stable": None}
    poles = linearise(point).eigenvalues
    slowest = max(p.real for p in poles)
    open_question = abs(slowest) <= _ZERO * max(1.0, *(abs(p) for p in poles))
    stable = None if open_question else slowest < 0
    return {"states": point.numbers, "poles": [_pole(p) for p in poles], "stable": stable}


def _pole(value: complex) -> str:
    return f"{value.real:.6g}" if abs(value.imag) <= _ZERO * abs(value) else f"{value.real:.6g}{value.imag:+.6g}j"
