"""Refusal of initial values, inputs and parameters outside the ranges that the plant declares."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ulna.base import SimulationError
from ulna.loop import Loop
from ulna.sim.cache import IdentityCache
from ulna.sim.inputs import Constant, Held, Input, Interpolated
from ulna.system import STAY_INSIDE, Parameter, Signal, System, declared_range, out_of_range

_RANGED = IdentityCache(64)


def check_ranges(
    system: System,
    loop: Loop | None,
    states: np.ndarray,
    inputs: Mapping[str, Input | np.ndarray],
    parameters: Mapping[str, Any],
) -> None:
    """Refuse what is given outside its range; of inputs constants and samples, not formulas of time.

    Args:
        system: whose states are given. loop: the loop, if it is one: only its plant's states are looked at.
        states: (n,) or (N, n). inputs, parameters: by name.

    Raises:
        SimulationError: naming the value, its range and the argument of `simulate`.
    """
    ranged = _RANGED.get(system, None, lambda: _ranged(system))
    if not ranged:
        return
    plant = len(system.states if loop is None else loop.plant.states)
    for what, place, item in ranged:
        given: Any = None
        if what == "initial":
            given = states[..., place] if place < plant else None
        elif what == "inputs":
            given = _values(inputs.get(item.name))
        else:
            given = parameters.get(item.name)
        if given is None:
            continue
        if found := out_of_range(item, given):
            raise SimulationError(f"{what}={{'{item.name}': ...}} of '{system.name}'", found, STAY_INSIDE)


def _ranged(system: System) -> list[tuple[str, int, Signal | Parameter]]:
    """(argument of `simulate`, place, signal or parameter) of all that have a range."""
    parts = (("initial", system.states), ("inputs", system.inputs), ("parameters", system.parameters))
    return [(what, k, item) for what, items in parts for k, item in enumerate(items) if declared_range(item)]


def _values(given: Input | np.ndarray | None) -> Any:
    if isinstance(given, Constant):
        return given.value
    if isinstance(given, Held | Interpolated):
        return given.values
    return given if isinstance(given, np.ndarray) else None
