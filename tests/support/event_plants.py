"""Plants for events of continuous runs, and what is read off them."""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sp

from ulna.loop import EndStop, Hardware, Loop
from ulna.sim import EventKind, Trajectory
from ulna.system import Parameter, Signal, System

x, v, u, k = sp.symbols("x v u k", real=True)
GRID = np.linspace(0.0, 5.0, 101)


def system(rates: dict[str, object], *, inputs: str = "", **parameters: object) -> System:
    """A system whose states are its outputs."""
    states = tuple(Signal(name=name) for name in rates)
    return System(
        name="plant",
        states=states,
        rates=tuple(map(sp.sympify, rates.values())),
        inputs=tuple(Signal(name=name, unit="V") for name in inputs.split()),
        outputs=states,
        readouts=tuple(signal.symbol for signal in states),
        parameters=tuple(Parameter(name=n, value=sp.Rational(str(value))) for n, value in parameters.items()),
    )


def loop_of(command: sp.Expr, **hardware: Any) -> Loop:
    """A double integrator with its input driven by a command that reads the states."""
    signals = (Signal(name="x"), Signal(name="v"))
    law = System(
        name="law", states=(), rates=(), inputs=signals, outputs=(Signal(name="u", unit="V"),), readouts=(command,)
    )
    plant = system({"x": v, "v": u}, inputs="u")
    return Loop(plant=plant, controller=law, hardware=Hardware(**hardware) if hardware else None)


def limited(plant: System, **hardware: Any) -> Loop:
    """The plant alone with limits."""
    return Loop(plant=plant, hardware=Hardware(**hardware))


def stopped(plant: System, **given: float) -> Loop:
    """The plant between walls of x."""
    return limited(plant, end_stops=(EndStop(position="x", velocity="v", **given),))


def times(run: Trajectory, kind: EventKind) -> list[float]:
    return [event.time for event in run.events if event.kind is kind]


BALL = system({"x": v, "v": -sp.Rational(98, 10)})
FREE = system({"x": v, "v": u}, inputs="u")
SPRING = system({"x": v, "v": -x})
