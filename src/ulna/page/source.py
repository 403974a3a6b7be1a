"""`SetPointSource`: what stands between a hand and the set points of a loop, once a sample."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import sympy as sp

from ulna.base import SimulationError
from ulna.loop import Loop
from ulna.page.facts import signal_facts
from ulna.page.program import Program
from ulna.program import Plain, in_arithmetic
from ulna.symbolic.compiling import kernel
from ulna.system import System

OPTION = "source"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SetPointSource:
    """A system in discrete time that moves set points from what a hand holds: muscles, a joystick with a filter.

    In the page it runs once a sample before the controller, by a kernel as all else. It is switched on when a hand
    takes hold of it, off when a set point is moved by hand; derivatives of set points are then zero.

    Attributes:
        system: of the loop's period, without parameters. Outputs named like a reference of the loop move it; the others
            can be drawn.
        text: what the switch says.
        held: by input that a hand holds, between 0 and 1, the key that holds it while it is down.
        noise: inputs that get white normal numbers of deviation one.
        starts: by memory of the system the reference whose present value it takes when it is switched on.
        muscles: two outputs between 0 and 1 that swell a muscle in the picture of an arm, which lifts first; or none.
    """

    system: System
    text: str
    held: Mapping[str, str]
    noise: tuple[str, ...] = ()
    starts: Mapping[str, str] = field(default_factory=dict)
    muscles: tuple[str, ...] = ()


def add_source(made: Program, facts: dict[str, Any], source: SetPointSource, loop: Loop) -> None:
    """Put a source into the program and the facts of a loop with a processor.

    Raises:
        SimulationError: another period than the loop's, an output that moves nothing.
    """
    system, period = source.system, loop.fit({}).period
    asked = f"source '{system.name}' of set points"
    if system.period is None or abs(float(system.period) - period) > 1e-9 * period:
        raise SimulationError(asked, f"it has {system.time_text}, the loop {period:g} s.", "Give both the same period.")
    given = {each["name"]: each["given"] for each in facts["references"]}
    moved = [s.name for s in system.outputs if s.name in given]
    if not moved:
        known = ", ".join(given) or "none"
        raise SimulationError(asked, "none of its outputs is a reference of the loop.", f"References: {known}.")
    slots = {s.name: f"sx{k}" for k, s in enumerate(system.states)}
    slots |= {s.name: f"sn{k}" if s.name in source.noise else f"sh{k}" for k, s in enumerate(system.inputs)}
    outputs = {s.name: f"so{k}" for k, s in enumerate(system.outputs)} | {name: given[name] for name in moved}
    _add_kernel(made, system, slots, outputs)
    held = [
        {**signal_facts(s), "given": slots[s.name], "slot": slots[s.name], "value": 0.0, "key": source.held[s.name]}
        for s in system.inputs
        if s.name in source.held
    ]
    unused = {s.name for s in system.outputs if "_ref" in s.name}
    drawn = [signal_facts(s, slot=outputs[s.name]) for s in system.outputs if s.name not in {*given, *unused}]
    facts["held"], facts["drawn"], facts["muscles"] = held, drawn, list(source.muscles)
    facts["signals"] += [
        {"name": each["name"], "slot": each["slot"], "unit": each["unit"], "text": each["text"], "role": "source"}
        for each in (*held, *drawn)
    ]
    facts["options"].append(_switch(source.text))
    for each in (*held, *drawn):
        made.slot(each["slot"])
    made.constants["source"] = {
        "noises": [made.slot(slots[name]) for name in source.noise],
        "memory": [made.slot(slots[s.name]) for s in system.states],
        "starts": [[made.slot(slots[name]), made.slot(given[reference])] for name, reference in source.starts.items()],
        "moved": [made.slot(given[name]) for name in moved],
    }  # fmt: skip


def _add_kernel(made: Program, system: System, slots: Mapping[str, str], outputs: Mapping[str, str]) -> None:
    entries: Sequence[sp.Symbol] = (*system.state_symbols, *system.input_symbols)
    after = {f"after {s.name}": rate for s, rate in zip(system.states, system.rates, strict=True)}
    shown = {f"shown {s.name}": each for s, each in zip(system.outputs, system.readouts, strict=True)}
    definitions = {d.symbol: d.expression for d in system.definitions}
    found = kernel("source", list(entries), after | shown, definitions=definitions)
    renamed = dict(slots) | {f"after {name}": slots[name] for name in (s.name for s in system.states)}
    renamed |= {f"shown {name}": slot for name, slot in outputs.items()}
    made.add("lead", in_arithmetic(found, Plain()), renamed=renamed)


def _switch(text: str) -> dict[str, Any]:
    return {"name": OPTION, "text": text, "kind": "switch", "value": True, "range": None, "unit": "", "scale": 1.0}
