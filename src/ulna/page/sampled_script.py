"""The program and the facts of a loop with a processor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ulna.loop import Loop
from ulna.page.asked import Asked, complete, identity, input_facts, pushed, with_vector
from ulna.page.facts import limits_of, parameter_facts, sampled_options, sampled_signals, signal_facts, stops_of
from ulna.page.program import Program
from ulna.page.sampled import plain, sampled_program
from ulna.page.source import add_source
from ulna.page.start import check_inputs, point_of, reference_at_start, states_at_start
from ulna.page.vector import Begin, sampled_vector
from ulna.program import Plain
from ulna.sim import begun
from ulna.symbolic.compiling import rounded

PROMISE = "The plant takes the same Runge-Kutta steps between samples as simulate."


def sampled_script(loop: Loop, asked: Asked) -> tuple[Program, dict[str, Any]]:
    """The program and the facts."""
    numbered = loop.plant.with_values(asked.parameters) if asked.parameters else loop.plant
    point = point_of(numbered)
    own = plain(loop)
    names = [s.name for s in own.plant.states]
    states = states_at_start(numbered, asked.initial)
    further = asked.initial if isinstance(asked.initial, Mapping) else {}
    memory = {**own.initial, **{name: float(v) for name, v in further.items() if name not in names}}
    known = [s.name for s in (*own.references, *own.disturbances)]
    check_inputs(own.plant.name, asked.inputs, known)
    inputs = {s.name: reference_at_start(s.name, asked.inputs, point) for s in own.references}
    inputs |= {s.name: float(asked.inputs.get(s.name, 0.0)) for s in own.disturbances}
    begin = Begin(states=states, memory=memory, inputs=inputs, parameters=asked.parameters)
    held = replace(own, plant=pushed(own.plant, asked.pushes))
    made = sampled_program(held)
    hardware = own.fit({}).hardware
    facts: dict[str, Any] = {
        **identity(loop, "sampled", own.fit({}).period, plain=isinstance(_arithmetic(loop), Plain)),
        **_rows(held, made, begin, asked.pushes),
        "options": sampled_options(made, held),
        "integrator": PROMISE,
        "arithmetic": hardware.arithmetic.precision.value,
        "speed": _speed_of(own.fit({}).period),
    }
    if asked.source is not None:
        add_source(made, facts, asked.source, own)
    complete(made, facts, own.fit({}).period)
    made.begin.update(
        {"whole_delay": float(own.fit({}).whole_delay), "steps": 1.0, "least_steps": 1.0, "option_drive": 1.0}
    )
    with_vector(facts, lambda: sampled_vector(own, made.places, begin, asked.check), made, asked.check)
    if facts["vector"]:
        made.begin.update({"steps": float(facts["vector"]["steps"]), "least_steps": float(facts["vector"]["steps"])})
    return made, facts


def _arithmetic(loop: Loop) -> Any:
    return None if loop.hardware is None else loop.hardware.arithmetic


def _rows(loop: Loop, made: Program, begin: Begin, pushes: Sequence[str]) -> dict[str, Any]:
    """Everything about signals and parameters of a loop with a processor."""
    wiring = loop.wiring
    memory = {name: float(value[0]) for name, value in begun(loop, begin.memory).items()}
    initial = [signal_facts(s, slot=f"x{k}", value=begin.states[s.name]) for k, s in enumerate(loop.plant.states)]
    initial += [signal_facts(s, slot=f"z{k}", value=memory.get(s.name, 0.0)) for k, s in enumerate(wiring.memory)]
    by_name = {each["name"]: each for each in initial[len(loop.plant.states) :]}
    for k, s in enumerate(() if wiring.injected is None else wiring.injected.system.outputs):
        each = by_name.setdefault(s.name, signal_facts(s, value=begin.memory.get(s.name, 0.0)))
        each["wanted"] = f"w{k}"
        if "slot" not in each:
            initial.append(each)
    commands = [
        signal_facts(s, command=f"c{k}", limited=f"h{k}_0", slot=f"ub{k}", value=memory.get(s.name, 0.0))
        for k, s in enumerate(wiring.driven)
    ]
    initial += [signal_facts(s, held=k, value=memory.get(s.name, 0.0)) for k, s in enumerate(wiring.driven)]
    parameters = [
        parameter_facts(p, begin.parameters[p.name], owner="plant", slot=f"plant_p{k}")
        for k, p in enumerate(loop.plant.parameters)
    ]
    return {
        "states": [signal_facts(s, slot=f"x{k}") for k, s in enumerate(loop.plant.states)],
        "outputs": [signal_facts(s, slot=f"o{k}") for k, s in enumerate(loop.plant.outputs)],
        "measured": [signal_facts(s, slot=f"yn{k}") for k, s in enumerate(wiring.measured)],
        "estimates": [signal_facts(s, slot=f"e{k}") for k, s in enumerate(wiring.estimates)],
        "memory": [signal_facts(s, slot=f"z{k}") for k, s in enumerate(wiring.memory)],
        "commands": commands,
        "references": [input_facts(made, s, f"r{k}", begin) for k, s in enumerate(wiring.references)],
        "disturbances": [input_facts(made, s, f"d{k}", begin, pushes) for k, s in enumerate(wiring.disturbances)],
        "parameters": parameters + _controller_parameters(loop, made),
        "initial": initial,
        "signals": sampled_signals(loop),
        "limits": limits_of(loop),
        "stops": stops_of(loop),
    }


def _controller_parameters(loop: Loop, made: Program) -> list[dict[str, Any]]:
    """Those that coefficients alone depend on: of an exactly held estimator the matrices are computed before."""
    if "phi_0_0" in made.begin or loop.parts is None:
        return []
    owned = {p.name: p for p in loop.parts.system.parameters}
    found = []
    for k, (name, value) in enumerate(loop.wiring.parameters):
        if name in owned and value is not None:
            made.slot(f"q{k}")
            found.append(parameter_facts(owned[name], rounded(value, name), owner="controller", slot=f"q{k}"))
    return found


def _speed_of(period: float) -> float:
    """Loop time in a second of the wall clock: slow processors are shown faster."""
    speed = 1.0
    while speed * 0.5 < period:
        speed *= 10.0
    return speed
