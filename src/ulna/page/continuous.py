"""A loop without a processor, or a plant alone, as a program of the page: its rates, its outputs and its limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import sympy as sp

from ulna.loop import Loop
from ulna.page.program import Program
from ulna.program import Kernel, Plain, hoist, in_arithmetic, restricted, to_numpy
from ulna.sim import limited
from ulna.symbolic.compiling import kernel
from ulna.system import System

TOLERANCE = 1e-7
"""Relative local error of a step, of the largest that a state has been."""
MOST_STEPS = 400
"""Of one page step: what needs more is too stiff for it."""


def continuous_program(system: System, loop: Loop | None) -> Program:
    """The program of a system in continuous or discrete time.

    Slots: `x<k>` states, `d<k>` inputs, `p<k>` parameters, `o<k>` outputs; `f<k>` rates at `g<k>`.
    """
    made = Program()
    made.row("x", len(system.states))
    made.row("d", len(system.inputs))
    made.row("p", len(system.parameters))
    # In a row each, before any kernel takes of them what it reads: the reader counts from the first.
    made.row("g", len(system.states))
    made.row("f", len(system.states))
    saturation = {} if loop is None else dict(loop.saturation)
    _add(made, limited(system, saturation) if saturation else system, "")
    if saturation:
        _add(made, system, "_free")
    made.row("o", len(system.outputs))
    for slot in ("time", "limits", "step"):
        made.slot(slot)
    stops = () if loop is None or loop.hardware is None else loop.hardware.end_stops
    names = [s.name for s in system.states]
    made.begin["limits"] = 1.0
    made.constants.update(
        {
            "kind": "discrete" if system.discrete else "continuous",
            "limited": bool(saturation),
            "walls": [
                [names.index(each.position), names.index(each.velocity), each.lower, each.upper, each.restitution]
                for each in stops
            ],
            "tolerance": TOLERANCE,
            "most": MOST_STEPS,
        }
    )
    return made


def _add(made: Program, system: System, variant: str) -> None:
    """Constants, rates at `g` and outputs at `x` as functions."""
    whole = _kernel(system)
    parts = hoist(whole, [f"p{k}" for k in range(len(system.parameters))])
    hoisted = {name: f"plant{variant}_{name}" for name in parts.before.outputs}
    made.add(f"constants{variant}", in_arithmetic(parts.before, Plain()), renamed=hoisted)
    moved = {f"x{k}": f"g{k}" for k in range(len(system.states))}
    for name, stem, renamed in ((f"rates{variant}", "f", moved), (f"shown{variant}", "o", {})):
        some = in_arithmetic(_row(parts.main, stem), Plain())
        made.add(name, some, renamed=hoisted | renamed)


def _row(whole: Kernel, stem: str) -> Kernel:
    return restricted(whole, [name for name in whole.outputs if name.startswith(stem)])


def _kernel(system: System) -> Kernel:
    def named(stem: str, symbols: Sequence[sp.Symbol]) -> dict[sp.Symbol, sp.Symbol]:
        return {symbol: sp.Symbol(f"{stem}{k}", real=True) for k, symbol in enumerate(symbols)}

    held = named("p", system.parameter_symbols)
    names = named("x", system.state_symbols) | named("d", system.input_symbols) | held
    outputs = {f"f{k}": e.xreplace(names) for k, e in enumerate(system.inline(system.rates))}
    outputs |= {f"o{k}": e.xreplace(names) for k, e in enumerate(system.inline(system.readouts))}
    return kernel(f"page of {system.name}", list(names.values()), outputs, held=list(held.values()))


FRAMES = 240
"""Page steps in a second of the wall clock."""
_UNHURRIED = 20.0
"""s that a slowest time constant may have to be shown in real time."""
_HASTY = 0.05
"""s that it must have."""


def pace_of(
    system: System, states: Mapping[str, float], inputs: Mapping[str, float], parameters: Mapping[str, float]
) -> tuple[float, float]:
    """(loop time in a second of the wall clock at which the motion is a pleasure to watch, s of a page step)."""
    if system.period is not None:
        period = float(system.period)
        return max(1.0, 10.0 ** np.ceil(np.log10(2.0 * period))), period
    slowest = _slowest(system, states, inputs, parameters)
    speed = 1.0
    if slowest is not None and not _HASTY <= slowest <= _UNHURRIED:
        speed = float(10.0 ** np.round(np.log10(slowest)))
    return speed, speed / FRAMES


def _slowest(
    system: System, states: Mapping[str, float], inputs: Mapping[str, float], parameters: Mapping[str, float]
) -> float | None:
    """s, the longest time constant of the linearisation at a state, by differences; None where nothing is known."""
    rates = to_numpy(_row(_kernel(system), "f"))
    x = np.array([states[s.name] for s in system.states])
    rest = [*(inputs[s.name] for s in system.inputs), *(parameters[p.name] for p in system.parameters)]
    steps = 1e-6 * np.maximum(1e-3, np.abs(x))
    points = np.concatenate([x[None], x + np.diag(steps)]).T
    with np.errstate(all="ignore"):
        found = np.stack(np.broadcast_arrays(points[0], *rates(*points, *rest))[1:])
        slopes = (found[:, 1:] - found[:, :1]) / steps
    if not np.isfinite(slopes).all():
        return None
    sizes = np.abs(np.linalg.eigvals(slopes))
    sizes = sizes[sizes > 1e-6 * sizes.max()] if sizes.size else sizes
    return float(1.0 / sizes.min()) if sizes.size else None
