"""The program and the facts of a loop without a processor, or of a plant alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ulna.base import SimulationError
from ulna.loop import Loop
from ulna.page.asked import Asked, complete, identity, input_facts, pushed, with_vector
from ulna.page.continuous import continuous_program, pace_of
from ulna.page.facts import limits_of, parameter_facts, parameter_values, signal_facts, stops_of
from ulna.page.program import Program
from ulna.page.start import check_inputs, point_of, reference_at_start, states_at_start
from ulna.page.vector import Begin, continuous_vector
from ulna.system import System

PROMISE = {
    "continuous": "The page steps with a relative local error of 10⁻⁷ (Dormand and Prince, order 5); "
    "limits act at once, end stops at the end of a step.",
    "discrete": "The difference equation is evaluated once a period.",
}


def continuous_script(loop: Loop | None, plant: System, asked: Asked) -> tuple[Program, dict[str, Any]]:
    """The program and the facts."""
    held = pushed(plant, asked.pushes)
    numbered = plant.with_values(asked.parameters) if asked.parameters else plant
    body = None if loop is None else replace(loop, plant=held)
    system, own = (held, plant) if body is None or loop is None else (body.system, loop.system)
    point = point_of(numbered)
    references = [] if loop is None else [s.name for s in loop.references]
    named = _named(own, plant, asked.initial)
    states = {**dict.fromkeys((s.name for s in own.states), 0.0), **({} if loop is None else dict(loop.initial))}
    states |= states_at_start(numbered, named)
    states |= {name: float(value) for name, value in (named or {}).items() if name in states}
    check_inputs(own.name, asked.inputs, [s.name for s in own.inputs])
    inputs = {s.name: reference_at_start(s.name, asked.inputs, point) for s in own.inputs}
    values = parameter_values(own, {n: v for n, v in asked.parameters.items() if n in {p.name for p in own.parameters}})
    begin = Begin(states=states, memory={}, inputs=inputs, parameters=values)
    made = continuous_program(system, body)
    speed, period = pace_of(own, begin.states, begin.inputs, values)
    kind = "discrete" if system.discrete else "continuous"
    facts: dict[str, Any] = {
        **identity(loop or plant, kind, period, plain=system.discrete),
        **_system_rows(system, body, made, begin, asked.pushes, references),
        "integrator": PROMISE[kind],
        "arithmetic": "double",
        "speed": speed,
    }
    complete(made, facts, period)
    vector = lambda: continuous_vector(own, loop, begin, period, asked.check * speed)  # noqa: E731
    with_vector(facts, vector, made, asked.check)
    return made, facts


def _named(system: System, plant: System, given: Any) -> Mapping[str, Any] | None:
    """The initial state by name: a row is that of the plant or of the whole loop."""
    if given is None or isinstance(given, Mapping):
        return given
    row = [float(value) for value in given]
    names = [s.name for s in (system if len(row) == len(system.states) else plant).states]
    if len(row) != len(names):
        hint = f"Give one number for each state: {', '.join(names)}."
        raise SimulationError(f"initial state of '{plant.name}'", f"it has {len(row)} numbers.", hint)
    return dict(zip(names, row, strict=True))


def _system_rows(
    system: System,
    loop: Loop | None,
    made: Program,
    begin: Begin,
    pushes: Sequence[str],
    references: Sequence[str],
) -> dict[str, Any]:
    """Everything about signals and parameters of a system."""
    plant = {s.name for s in system.states} if loop is None else {s.name for s in loop.plant.states}
    shown = {s.name for s in system.outputs} if loop is None else {s.name for s in loop.plant.outputs}
    driven = {} if loop is None or loop.controller is None else {s.name: s for s in loop.wiring.driven}
    states = [signal_facts(s, slot=f"x{k}", value=begin.states[s.name]) for k, s in enumerate(system.states)]
    outputs = [signal_facts(s, slot=f"o{k}") for k, s in enumerate(system.outputs)]
    commands = []
    for each in outputs:
        if each["name"] in driven:
            place = f"c{len(commands)}" if made.constants["limited"] else each["slot"]
            made.slot(place)
            commands.append({**each, "command": place, "limited": each["slot"]})
    made.constants["commands"] = [
        [made.slot(c["limited"]), made.slot(c["command"])] for c in commands if made.constants["limited"]
    ]
    entries = [input_facts(made, s, f"d{k}", begin, pushes) for k, s in enumerate(system.inputs)]
    roles = [("state", states), ("output", outputs), ("input", entries), ("command", commands)]
    signals = [
        {"name": e["name"] + ("_command" if role == "command" else ""), "unit": e["unit"], "text": e["text"],
         "slot": e["command"] if role == "command" else e["slot"], "role": role}
        for role, rows in roles
        for e in rows
    ]  # fmt: skip
    options = [
        {"name": "limits", "text": "commands are limited", "kind": "switch", "value": True, "range": None, "unit": "",
         "scale": 1.0}
    ] if made.constants["limited"] else []  # fmt: skip
    return {
        "states": [each for each in states if each["name"] in plant],
        "outputs": [each for each in outputs if each["name"] in shown],
        "measured": [],
        "estimates": [each for each in outputs if each["name"] not in {*shown, *driven}],
        "memory": [each for each in states if each["name"] not in plant],
        "commands": commands,
        "references": [each for each in entries if each["name"] in references],
        "disturbances": [each for each in entries if each["name"] not in references],
        "parameters": [
            parameter_facts(p, begin.parameters[p.name], owner="plant", slot=f"p{k}")
            for k, p in enumerate(system.parameters)
        ],
        "initial": states,
        "signals": signals,
        "limits": limits_of(loop),
        "stops": stops_of(loop),
        "options": options,
    }
