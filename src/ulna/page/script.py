"""`loop_script`: a loop as JavaScript with the facts that a page needs of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from ulna.base import SimulationError
from ulna.loop import Loop
from ulna.page.asked import Asked
from ulna.page.continuous_script import continuous_script
from ulna.page.facts import parameter_values
from ulna.page.sampled_script import sampled_script
from ulna.page.source import SetPointSource
from ulna.system import as_system

ENGINE = ("random", "sampled", "flowing", "loop", "check", "replay", "clock")
"""Files of the engine, in order."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoopScript:
    """A loop as a page runs it.

    Attributes:
        script: an expression of JavaScript, an object of functions over one row of numbers; no text of a user is in it.
        facts: names, units, ranges, start values and a recorded run, as JSON has them.
    """

    script: str
    facts: dict[str, Any]

    def __repr__(self) -> str:
        kind, states = self.facts["kind"], len(self.facts["states"])
        return f"LoopScript of '{self.facts['name']}': {kind}, {states} states, {len(self.script) // 1000} kB"


def runtime_script() -> str:
    """The engine that every page has once: it defines `ulnaLoop`, `ulnaReplay` and `ulnaClock`."""
    folder = files("ulna.page") / "engine"
    body = "\n".join((folder / f"{name}.js").read_text(encoding="utf-8") for name in ENGINE)
    names = "ulnaLoop, ulnaReplay, ulnaClock"
    return f'(() => {{\n"use strict";\n{body}\nObject.assign(globalThis, {{ {names} }});\n}})();\n'


def loop_script(
    loop: Any,
    *,
    initial: Any = None,
    parameters: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] | None = None,
    pushes: Sequence[str] = (),
    check: float = 2.0,
    source: SetPointSource | None = None,
) -> LoopScript:
    """A loop as JavaScript that computes, to the last bit, what `simulate` computes of it under `Plain()` arithmetic.

    A loop without a processor, and a plant alone, moves by adaptive steps with a relative local error of 1e-7.

    Args:
        loop: a `Loop`, a `System`, or what has one as its `.system`.
        initial: states in SI, in order or by name, and by name states and estimates of the controller; the operating
            point with the first state moved a little if left out.
        parameters: SI values of the plant's parameters; needed of those that have none.
        inputs: SI numbers that references and disturbances begin with.
        pushes: states of the plant to whose rate the page may add something: `push_<state>`, a hand on it.
        check: s of a run of `simulate` that the page compares itself with; 0 for none.
        source: what moves the set points of a loop with a processor, where a hand holds it.

    Raises:
        PlantError: parameters without a value.
        SimulationError: names and numbers that fit nothing, nothing that moves, a source of a loop without processor.
    """
    given = loop if isinstance(loop, Loop) else None
    system = loop.plant if isinstance(loop, Loop) else as_system(loop)
    if not system.states:
        raise SimulationError(f"a page of '{system.name}'", "it has no states, so nothing in it moves.")
    asked = Asked(
        parameters=parameter_values(system, parameters),
        initial=initial,
        inputs=dict(inputs or {}),
        pushes=tuple(pushes),
        check=check,
        source=source,
    )
    if given is not None and given.sampled:
        made, facts = sampled_script(given, asked)
    elif source is not None:
        found = "there is no processor, which asks it once a sample."
        raise SimulationError(f"a page of '{system.name}' with a source", found, "Give the loop Hardware(period=...).")
    else:
        made, facts = continuous_script(given, system, asked)
    return LoopScript(script=made.text, facts=facts)
