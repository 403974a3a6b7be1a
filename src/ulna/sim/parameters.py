"""Values of a system's parameters for a run."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ulna.base import SimulationError
from ulna.sim.cache import IdentityCache
from ulna.symbolic.compiling import rounded
from ulna.system import System

_DEFAULTS, _ROWS = IdentityCache(64), IdentityCache(64)


def default_values(system: System) -> dict[str, float | None]:
    """The SI value of each parameter, None where it has none; remembered by the identity of the system."""
    return dict(_DEFAULTS.get(system, None, lambda: _rounded_values(system)))


def default_row(system: System) -> np.ndarray | None:
    """(1, p) the SI values in the system's order, to be read only; None where a parameter has none."""
    return _ROWS.get(system, None, lambda: _row(default_values(system)))


def _row(values: Mapping[str, float | None]) -> np.ndarray | None:
    known = [value for value in values.values() if value is not None]
    return np.array([known]) if len(known) == len(values) else None


def _rounded_values(system: System) -> dict[str, float | None]:
    return {p.name: None if (v := p.si_value) is None else rounded(v, system.name) for p in system.parameters}


def parameter_values(
    defaults: Mapping[str, float | None], given: Mapping[str, float] | None, system: str
) -> dict[str, float]:
    """The SI value of every parameter of the system of this name.

    Raises:
        SimulationError: a name that is no parameter, a value that is not finite, parameters left without a value.
    """
    values = dict(defaults)
    for name, value in (given or {}).items():
        if name not in values:
            known = ", ".join(values) or "none"
            raise SimulationError(
                f"parameter '{name}' of '{system}'", "there is no such parameter.", f"Known: {known}."
            )
        number = float(value)
        if not math.isfinite(number):
            raise SimulationError(f"parameter '{name}' of '{system}'", f"its value is {number}.")
        values[name] = number
    missing = [name for name, value in values.items() if value is None]
    if missing:
        raise SimulationError(
            f"simulation of '{system}'",
            f"parameters without a value: {', '.join(missing)}.",
            f"Give them: parameters={{'{missing[0]}': ...}}.",
        )
    return {name: value for name, value in values.items() if value is not None}
