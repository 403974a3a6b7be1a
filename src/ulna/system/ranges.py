"""The range that a plant declares for a signal or a parameter, and the values that are given for it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import sympy as sp

from ulna.system.signal import Parameter, Signal, to_si

STAY_INSIDE = "Choose a value in it, or widen the range in the plant file."
"""What to try where one value lies outside."""

_ROUNDING = 1e-12
"""Of the larger end: π/6 and 30° in radians may differ in the last place."""


def declared_range(item: Signal | Parameter) -> tuple[float, float] | None:
    """(lower, upper) in SI, a side without a bound infinite; None where no range is declared."""
    if item.lower is None and item.upper is None:
        return None
    unit = item.unit if isinstance(item, Parameter) else ""  # signals are SI already
    lower = -math.inf if item.lower is None else float(to_si(item.lower, unit))
    upper = math.inf if item.upper is None else float(to_si(item.upper, unit))
    return lower, upper


def out_of_range(item: Signal | Parameter, values: Any) -> str:
    """What lies outside the declared range, `T = 1000 K, its range is [250, 500] K.`; empty where nothing does.

    The ends belong to the range. A range is about what is given (parameters, initial values, constant inputs); a motion
    may leave it.

    Args:
        item: the signal or parameter. values: SI, one or many in any shape; of several the farthest one is told.
    """
    sides = declared_range(item)
    if sides is None:
        return ""
    lower, upper = sides
    edge = _ROUNDING * max(abs(side) for side in sides if math.isfinite(side))
    numbers = np.asarray(values, dtype=float).ravel()
    beyond = np.maximum(lower - numbers, numbers - upper)
    if not numbers.size or not (beyond > edge).any():
        return ""
    farthest = float(numbers[int(np.nanargmax(beyond))])
    scale = float(to_si(sp.Integer(1), item.unit)) if isinstance(item, Parameter) else 1.0
    shown = " ".join(filter(None, (f"{farthest / scale:.10g}", item.unit)))
    ends = " ".join(filter(None, (f"[{_end(item.lower, '-')}, {_end(item.upper, '')}]", item.unit)))
    return f"{item.name} = {shown}, its range is {ends}."


def _end(side: Any, sign: str) -> str:
    return f"{sign}inf" if side is None else f"{float(side):g}"
