"""The models of a loop, of its controller, and of a plant."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ulna.base import UlnaError
from ulna.deploy.errors import DeployError
from ulna.deploy.firmware import ELAPSED, Firmware, Port, firmware
from ulna.deploy.fmu.part import Model, Variable
from ulna.deploy.names import c_name
from ulna.loop import Loop, Pwm, Steps, applied, fingerprint
from ulna.program import Assembly, Kernel, Scalar, tangents, to_python
from ulna.sim import FixedSteps
from ulna.system import Signal, System, starting_point, system_kernel

MOST_STEPS = 4096
"""Of a plant in a period, where the user does not say how many."""


def controller_model(loop: Loop, initial: Mapping[str, float]) -> Model:
    """The processor's step by itself: measured values and references in, commands and estimates out."""
    made = firmware(loop, initial=initial)
    variables = [Variable(name=p.signal.name, signal=p.signal, slot=p.slot, causality="input") for p in _inputs(made)]
    variables += [
        Variable(
            name=p.signal.name, signal=p.signal, slot=p.slot, causality="output", start=made.initial.get(p.slot, 0.0)
        )
        for p in (*made.commands, *made.estimates)
    ]
    fault = Signal(name="fault", text="1 where something was wrong at the last sample")
    variables.append(Variable(name="fault", signal=fault, slot="code", causality="output", flag=True))
    shown = {v.slot for v in variables}
    variables += [
        Variable(name=name, signal=Signal(name=name), slot=slot, causality="local", start=made.initial[slot])
        for slot, name in made.memory.items()
        if slot not in shown
    ]
    return Model(
        name=f"controller of {loop.plant.name}",
        identifier=made.name,
        fingerprint=made.fingerprint,
        text="the processor's step of a loop, once a period",
        variables=_named(variables),
        begin=None,
        sample=(made.kernel,),
        motion=(),
        shown=(),
        numbers={"missed": 0.0, "elapsed": made.hardware.period or 0.0},
        period=made.hardware.period or 0.0,
        sampled=True,
        dense=False,
    )


def _inputs(made: Firmware) -> tuple[Port, ...]:
    told = [port.signal.name for port in made.inputs if port.slot.startswith("believed")]
    if told:
        raise DeployError(
            f"the controller of '{made.loop.plant.name}' as an FMU",
            f"it reads what the amplifier of {told[0]} applied, and the amplifier is part of the loop.",
            "Export the loop.",
        )
    return tuple(port for port in made.inputs if port is not ELAPSED)


def loop_model(loop: Loop, initial: Mapping[str, float], steps: int | None) -> Model:
    """The whole loop: references and disturbances in; the plant's outputs, commands and estimates out."""
    made = firmware(loop, initial={name: value for name, value in initial.items() if name not in _states(loop.plant)})
    hardware = made.hardware
    if hardware.jitter or hardware.missed:
        raise DeployError(
            f"the loop of '{loop.plant.name}' as an FMU",
            "its clock is random (Jitter, MissedSamples).",
            "Leave it out.",
        )
    loop, fitted, wiring = made.loop, made.loop.fit({}), made.loop.wiring
    count = steps or _steps_needed(loop.plant, fitted.period)
    flow = loop.flow_by(Steps(number=count), ramps=False)
    point = starting_point(loop.plant).numbers
    variables = [_input(s, f"r{k}") for k, s in enumerate(wiring.references)]
    variables += [_input(s, f"d{k}") for k, s in enumerate(wiring.disturbances)]
    variables += [_output(s, f"o{k}") for k, s in enumerate(loop.plant.outputs)]
    variables += [_output(s, f"e{k}") for k, s in enumerate(wiring.estimates)]
    held = {s.name: initial.get(s.name, 0.0) for s in wiring.driven}
    for k, s in enumerate(wiring.driven):
        ages = tuple(f"h{k}_{j}" for j in range(fitted.whole_delay + 2))
        further = (f"c{k}", f"believed{k}", f"ua{k}", *ages)
        variables.append(
            Variable(name=s.name, signal=s, slot=f"ub{k}", causality="output", start=held[s.name], further=further)
        )
        variables.append(_output(Signal(name=f"{s.name}_limited", unit=s.unit, text="command"), f"h{k}_0"))
    variables += [
        Variable(name=p.name, signal=Signal(name=p.name, unit=p.unit, text=p.text), slot=f"p{k}", causality="parameter",
                 start=_value(loop.plant, p.name, p.si_value))
        for k, p in enumerate(loop.plant.parameters)
    ]  # fmt: skip
    variables += [
        Variable(
            name=s.name, signal=s, slot=f"x{k}", causality="local", start=float(initial.get(s.name, point[s.name]))
        )
        for k, s in enumerate(loop.plant.states)
    ]
    variables += [
        Variable(name=s.name, signal=s, slot=f"z{k}", causality="local", start=made.initial.get(f"z{k}", 0.0))
        for k, s in enumerate(wiring.memory)
    ]
    return Model(
        name=f"loop of {loop.plant.name}",
        identifier=made.name,
        fingerprint=made.fingerprint,
        text="plant, hardware and controller; without the noise of sensors",
        variables=_named(variables),
        begin=_constants(flow.constants),
        sample=(flow.outputs, *loop.step.stages, applied(fitted)),
        motion=flow.motion,
        shown=(flow.outputs,),
        numbers={**flow.numbers, **loop.step.numbers, "missed": 0.0, "elapsed": fitted.period},
        period=fitted.period,
        sampled=True,
        dense=not fitted.split and not any(isinstance(d, Pwm) and d.pulsed for d in fitted.drives),
    )


def plant_model(plant: System, initial: Mapping[str, float], step: float) -> Model:
    """The plant by itself: Runge-Kutta steps of at most `step` seconds with inputs held over a communication step."""
    missing = [p.name for p in plant.parameters if p.si_value is None]
    if missing:
        raise DeployError(
            f"'{plant.name}' as an FMU", f"parameters without a value: {', '.join(missing)}.", "Use with_values()."
        )
    found = system_kernel(plant)
    point = dict(found.point)
    names = {name: f"x{k}" for k, name in enumerate(found.states)} | {n: f"u{k}" for k, n in enumerate(found.inputs)}

    def shown(w: Assembly, x: list[Scalar]) -> dict[str, Scalar]:
        known = {name: x[k] for k, name in enumerate(found.states)}
        return w.call(found.kernel, known | {name: w.input(names[name]) for name in found.inputs})

    w = Assembly("outputs")
    functions = shown(w, w.inputs("x", len(found.states)))
    outputs = w.finished({f"o{k}": functions[name] for k, name in enumerate(found.functions)})
    w = Assembly("motion")
    x, h = w.inputs("x", len(found.states)), w.input("span")
    rows: list[list[Scalar]] = []
    for part in (None, 0.5, 0.5, 1.0):
        at = x if part is None else [(part * h).fused(k, a) for k, a in zip(rows[-1], x, strict=True)]
        rates = shown(w, at)
        rows.append([rates[name] for name in found.rates])
    moved = [
        (h / 6.0).fused(x[k].like(2.0).fused(b + c, a + d), x[k])
        for k, (a, b, c, d) in enumerate(zip(*rows, strict=True))
    ]
    motion = w.finished({f"x{k}": value for k, value in enumerate(moved)})
    variables = [_input(s, names[s.name], float(initial.get(s.name, point[s.name]))) for s in plant.inputs]
    variables += [_output(s, f"o{k}") for k, s in enumerate(plant.outputs)]
    variables += [
        Variable(
            name=s.name, signal=s, slot=f"x{k}", causality="local", start=float(initial.get(s.name, point[s.name]))
        )
        for k, s in enumerate(plant.states)
    ]
    return Model(
        name=plant.name,
        identifier=c_name(plant.name).lower(),
        fingerprint=fingerprint(Loop(plant=plant)),
        text="Runge-Kutta steps with inputs held over a communication step",
        variables=_named(variables),
        begin=None,
        sample=(),
        motion=(motion,),
        shown=(outputs,),
        numbers={},
        period=step,
        sampled=False,
        dense=True,
    )


def _states(plant: System) -> set[str]:
    return {s.name for s in plant.states}


def _value(plant: System, name: str, value: Any) -> float:
    if value is None:
        raise DeployError(
            f"the loop of '{plant.name}' as an FMU", f"parameter {name} has no value.", "Use plant.with_values()."
        )
    return float(value)


def _input(signal: Signal, slot: str, start: float = 0.0) -> Variable:
    return Variable(name=signal.name, signal=signal, slot=slot, causality="input", start=start)


def _output(signal: Signal, slot: str) -> Variable:
    return Variable(name=signal.name, signal=signal, slot=slot, causality="output")


def _named(variables: list[Variable]) -> tuple[Variable, ...]:
    """A name once: what comes first has it; the importer calls the time `time`."""
    found: dict[str, Variable] = {}
    for each in variables:
        if each.name != "time":
            found.setdefault(each.name, each)
    return tuple(found.values())


def _constants(constants: Kernel) -> Kernel:
    """What the plant's parameters amount to, under the names of the flow."""
    w = Assembly("begin")
    values = w.call(constants)
    return w.finished({f"plant_{name}": value for name, value in values.items()})


def _steps_needed(plant: System, period: float) -> int:
    """A power of two: as many steps as a run near the operating point takes."""
    try:
        found = system_kernel(plant)
        point = dict(found.point)
        slopes = tangents(found.kernel, found.states, piecewise=True)
        values = dict(zip(slopes.outputs, to_python(slopes)(*(float(point[n]) for n in slopes.inputs)), strict=True))
        matrix = np.array([[values[f"{rate}/{name}"] for name in found.states] for rate in found.rates])
        fastest = float(np.abs(np.linalg.eigvals(matrix)).max(initial=0.0))
    except (UlnaError, ArithmeticError, ValueError, np.linalg.LinAlgError):
        return 1
    needed = period * fastest / FixedSteps().within
    return min(MOST_STEPS, 2 ** max(0, math.ceil(math.log2(needed)))) if needed > 1.0 else 1
