"""Plants with dry friction made smooth, so that slopes along their motion exist: v/√(v² + w²), w small, for sign(v).

Not tanh(v/w): far from zero that is 1 to the last digit, so that a step of a series does not see what it steps over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import sympy as sp

from ulna.base import UlnaError
from ulna.identification.records import Experiment
from ulna.program import to_numpy
from ulna.sim import simulate
from ulna.symbolic.compiling import kernel
from ulna.symbolic.formulas import exact
from ulna.system import System, starting_point

COARSE, FINE = 50.0, 20000.0
"""Root mean squares of what a sign is of over the width of its smooth form: in a first search, and in the last one."""


def signs_of(plant: System) -> tuple[sp.Expr, ...]:
    """What the signs in the rates are of, each once."""
    rates = plant.inline(plant.rates)
    return tuple(sorted({each.args[0] for rate in rates for each in rate.atoms(sp.sign)}, key=str))


def widths_of(plant: System, arguments: Sequence[sp.Expr], runs: Sequence[Experiment]) -> dict[sp.Expr, float]:
    """The root mean square of each argument of a sign along the first record, parameters as they are; else 1."""
    run, point = runs[0], starting_point(plant).numbers
    try:
        first = {s.name: point[s.name] for s in plant.states}
        path = simulate(plant, first, run.times, inputs=dict(run.inputs), throw=False)
        symbols = [*plant.state_symbols, *plant.input_symbols, *plant.parameter_symbols]
        evaluate = to_numpy(kernel("signs", symbols, {str(k): e for k, e in enumerate(arguments)}))
        values = [float(p.si_value) for p in plant.parameters if p.si_value is not None]
        columns = [path[s.name] for s in (*plant.states, *plant.inputs)]
        sizes = [float(np.sqrt(np.nanmean(np.square(each)))) for each in evaluate(*columns, *values)]
    except UlnaError:
        sizes = [1.0] * len(arguments)
    return {e: size if np.isfinite(size) and size > 0.0 else 1.0 for e, size in zip(arguments, sizes, strict=True)}


def smoothed(plant: System, widths: dict[sp.Expr, float], share: float) -> System:
    """The plant with e/√(e² + w²) for every sign(e), w the width over a share."""
    forms = {sp.sign(e): e / sp.sqrt(e**2 + exact(float(f"{size / share:.3g}")) ** 2) for e, size in widths.items()}
    rates = tuple(rate.xreplace(forms) for rate in plant.inline(plant.rates))
    return replace(plant, rates=rates)


def told(widths: dict[sp.Expr, float]) -> str:
    """What was done, for the notes of a fit."""
    each = (f"e/sqrt(e^2 + w^2) with e = {e}, w = {size / FINE:.3g}" for e, size in widths.items())
    return f"fitted with a smooth form of the sign: {', '.join(each)}"
