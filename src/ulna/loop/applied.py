"""What a drive makes of a command: the mean of its pulses, the pulses, or what its supply allows."""

from __future__ import annotations

import sympy as sp

from ulna.base import SimulationError
from ulna.loop.drive import Amplifier, Pwm
from ulna.loop.fitted import Fitted
from ulna.loop.wiring import numbered
from ulna.program import Assembly, Kernel, Scalar
from ulna.symbolic.compiling import kernel
from ulna.symbolic.formulas import parse_formula
from ulna.system import System


def applied(loop: Fitted) -> Kernel:
    """The kernel from `early<k>` and `late<k>` to `ua<k>` and `ub<k>`, what the plant's input k gets.

    Before and after the delay's fraction of a period; of a measuring amplifier also what the controller believes.
    """
    w = Assembly("applied")
    outputs: dict[str, Scalar] = {}
    for k, drive in enumerate(loop.drives):
        for given, name in (("early", "ua"), ("late", "ub")):
            if name == "ua" and not loop.split:
                continue
            value = w.input(f"{given}{k}")
            if isinstance(drive, Amplifier):
                value = _cut(loop, w, k, drive, value)
            elif drive is not None and not drive.pulsed:
                height, part = pulse(w, k, value)
                value = height * part
            outputs[f"{name}{k}"] = value
        if isinstance(drive, Amplifier):
            late = outputs[f"ub{k}"]
            outputs[f"cut{k}"] = late.equals(w.input(f"late{k}")).negated()
            if drive.measured:
                mean = late + w.input("fraction") * (outputs[f"ua{k}"] - late) if loop.split else late
                outputs[f"believed{k}"] = mean
    return loop.finished(w.finished(outputs))


def pulse(w: Assembly, k: int, value: Scalar) -> tuple[Scalar, Scalar]:
    """(height, part of the period) of a pulse of the bridge at input k."""
    supply = w.input(f"supply{k}")
    asked = abs(value) / supply
    duty = asked.at_most(1.0).where(asked, 1.0)
    height = supply * (1.0 - w.input(f"sag{k}") * duty)
    short = duty - w.input(f"dead{k}")
    part = short.more(0.0).where(short, 0.0)
    return value.at_least(0.0).where(height, -height), part


def _cut(loop: Fitted, w: Assembly, k: int, drive: Amplifier, value: Scalar) -> Scalar:
    bounds = w.call(loop.written(_bounds(loop.wiring.plant, k, drive)))
    value = value.at_most(bounds["upper"]).where(value, bounds["upper"])
    return value.at_least(bounds["lower"]).where(value, bounds["lower"])


def _bounds(plant: System, k: int, drive: Amplifier) -> Kernel:
    """`lower` and `upper` of x, the plant's parameters (`plant_p<k>`) and the amplifier's own numbers."""
    table: dict[str, sp.Expr] = dict(zip((s.name for s in plant.states), numbered("x", len(plant.states)), strict=True))
    held = [sp.Symbol(f"plant_p{j}", real=True) for j in range(len(plant.parameters))]
    table |= {p.name: symbol for p, symbol in zip(plant.parameters, held, strict=True)}
    table |= {name: sp.Symbol(f"drive{k}_{name}", real=True) for name in drive.numbers}
    found = {}
    for side, given in (("lower", drive.lower), ("upper", drive.upper)):
        where = f"Amplifier({side}=...)"
        if isinstance(given, str):
            found[side] = parse_formula(given, table, where=where)
            continue
        meaning = {sp.Symbol(name, real=True): symbol for name, symbol in table.items()}
        unknown = sorted(str(s) for s in given.free_symbols - meaning.keys())
        if unknown:
            raise SimulationError(where, f"it uses {', '.join(unknown)}.", f"Known: {', '.join(table)}.")
        found[side] = given.xreplace(meaning)
    return kernel("amplifier", sorted(set(table.values()), key=str), found)


def bridges(loop: Fitted) -> list[Pwm | None]:
    """The bridge of each driven input whose pulses the plant gets."""
    return [drive if isinstance(drive, Pwm) and drive.pulsed else None for drive in loop.drives]
