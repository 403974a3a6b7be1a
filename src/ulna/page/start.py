"""Where a page begins: beside the operating point, references where the plant rests."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ulna.base import SimulationError, UlnaError
from ulna.system import System, equilibrium, given_point

_MOVED = 0.2
"""Of a state without a range: SI, or of its size."""


def states_at_start(plant: System, given: Any) -> dict[str, float]:
    """The plant's states by name: those that are given, else the operating point with the first state moved a little.

    Args:
        plant: every parameter at a number. given: a mapping, a row, or None.

    Raises:
        SimulationError: a row of another length, numbers that are not finite.
    """
    names = [s.name for s in plant.states]
    if given is not None and not isinstance(given, Mapping):
        row = [float(value) for value in given]
        if len(row) != len(names):
            hint = f"Give one number for each state: {', '.join(names)}."
            raise SimulationError(f"initial state of '{plant.name}'", f"it has {len(row)} numbers.", hint)
        given = dict(zip(names, row, strict=True))
    found = point_of(plant)
    start = {name: found.get(name, 0.0) for name in names}
    if given is None and names:
        start[names[0]] = _beside(plant, start[names[0]])
    start |= {name: float(value) for name, value in (given or {}).items() if name in start}
    if not all(map(math.isfinite, start.values())):
        raise SimulationError(f"initial state of '{plant.name}'", "a value is not a finite number.")
    return start


def point_of(plant: System) -> dict[str, float]:
    """States, inputs and outputs by name at the operating point, as far as they are known; of a file's, else zero."""
    names = [s.name for s in (*plant.states, *plant.inputs, *plant.outputs)]
    try:
        found = equilibrium(plant)
        return {name: found[name] for name in names}
    except (UlnaError, TypeError, ValueError):
        return _given(plant)


def _given(plant: System) -> dict[str, float]:
    try:
        return dict(given_point(plant).numbers)
    except UlnaError:
        return {}


def _beside(plant: System, value: float) -> float:
    signal = plant.states[0]
    ends = [None if each is None else float(each) for each in (signal.lower, signal.upper)]
    low, high = ends
    if low is not None and high is not None:
        step = 0.1 * (high - low)
        return value + step if value + step <= high else value - step
    step = _MOVED * max(1.0, abs(value))
    return value + step if high is None or value + step <= high else value - step


def reference_at_start(name: str, given: Mapping[str, float], point: Mapping[str, float]) -> float:
    """The value that a reference begins with: given, else where the plant's output of this name rests."""
    if name in given:
        return float(given[name])
    value = point.get(name.removesuffix("_ref"), 0.0)
    return value if math.isfinite(value) else 0.0


def check_inputs(name: str, given: Mapping[str, Any], known: Sequence[str]) -> None:
    """Refuse names that are neither a reference nor a disturbance, and values that are not numbers.

    Raises:
        SimulationError: naming the first.
    """
    for each, value in given.items():
        if each not in known:
            hint = f"Its references and disturbances: {', '.join(known) or 'none'}."
            raise SimulationError(f"input '{each}' of '{name}'", "there is none of this name.", hint)
        if not isinstance(value, int | float) or not math.isfinite(value):
            hint = "Give one number; in the page it is moved by hand."
            raise SimulationError(f"input '{each}' of '{name}'", f"{value!r} is not a finite number.", hint)
