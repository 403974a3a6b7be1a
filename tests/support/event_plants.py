"""Plants for events of continuous runs, and what is read off them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import sympy as sp

from ulna.sim import Continuous, EndStop, EventKind, Trajectory
from ulna.system import Definition, Parameter, Signal, System

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


def loop_of(command: sp.Expr) -> System:
    """A double integrator with its input wired to a command, as `close_loop` does."""
    plant = system({"x": v, "v": x})
    wire = Definition(name="plant_u", expression=command)
    return replace(
        plant,
        rates=(v, wire.symbol),
        definitions=(wire,),
        outputs=(*plant.outputs, Signal(name="u")),
        readouts=(*plant.readouts, wire.symbol),
    )


def stop(**given: float) -> Continuous:
    return Continuous(end_stops=(EndStop(position="x", velocity="v", **given),))


def times(run: Trajectory, kind: EventKind) -> list[float]:
    return [event.time for event in run.events if event.kind is kind]


BALL = system({"x": v, "v": -sp.Rational(98, 10)})
FREE = system({"x": v, "v": u}, inputs="u")
SPRING = system({"x": v, "v": -x})
