"""Parameters that no record of these outputs tells by themselves, found before the search and said by what is told."""

from __future__ import annotations

import numpy as np

from ulna.base import UlnaError
from ulna.identification.fitting.problem import Problem
from ulna.identification.fitting.solve import triangle
from ulna.identification.structural import Extent, Identifiability, identifiability

DEPENDENT = 1e-7
"""Slopes at the start that depend on each other but for this share ask for a look at the model."""
SHOWN = 3


def hidden_parameters(problem: Problem, point: np.ndarray) -> dict[str, str]:
    """Why parameters cannot be known from these outputs, by name: "only b*c is told"; empty where all of them can.

    The model is looked at only where slopes at the start depend on each other: that costs nothing.

    Args:
        problem: what is to be solved. point: (Q,) where the search begins.
    """
    slopes = problem.rows(point).slopes
    sizes = np.linalg.norm(slopes, axis=0)
    values = np.linalg.svd(triangle(slopes / np.where(sizes > 0.0, sizes, 1.0)), compute_uv=False)
    tied = any(each.followers for each in problem.free)
    if values[-1] > DEPENDENT * values[0] or tied or problem.system.discrete:
        return {}
    try:
        found = identifiability(
            problem.system, [each.name for each in problem.free], known_start=tuple(problem.initial)
        )
    except UlnaError:
        return {}
    return {name: _reason(found, name) for name, each in found.parameters.items() if each.extent is Extent.NOT}


def _reason(found: Identifiability, name: str) -> str:
    told = [c.expression for c in found.combinations if name in {s.name for s in c.expression.free_symbols}]
    if not told:
        return "it changes no measured output"
    shown = ", ".join(str(each) for each in told[:SHOWN])
    return f"the model determines only {shown}{' and more' if len(told) > SHOWN else ''}"
