"""What both kinds of loops share on their way into a page: what is asked, who they are, pushes, inputs, checks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import sympy as sp

from ulna.base import SimulationError, UlnaError
from ulna.loop import Loop, fingerprint
from ulna.page.facts import signal_facts
from ulna.page.program import Program
from ulna.page.vector import Begin
from ulna.system import Signal, System

PUSH = "push_"
"""Begins the name of an input that is added to the rate of a state: a hand on it."""
BOUND = 1e12
"""Of the norm of the plant's state, as in `FixedSteps`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """What `loop_script` is asked for.

    Attributes:
        parameters: SI, every one of the plant's. initial: a row, a mapping or None. inputs: SI by name.
        pushes: states that a hand may move. check: s of the recorded run. source: what moves set points, if anything.
    """

    parameters: Mapping[str, float]
    initial: Any
    inputs: Mapping[str, float]
    pushes: tuple[str, ...]
    check: float
    source: Any = None


def pushed(plant: System, states: Sequence[str]) -> System:
    """The plant with an input `push_<state>` added to the rate of each of these states.

    Raises:
        SimulationError: a name that is not a state.
    """
    known = [s.name for s in plant.states]
    unknown = [name for name in states if name not in known]
    if unknown:
        raise SimulationError(
            f"pushes of '{plant.name}'", f"it has no state '{unknown[0]}'.", f"Its states: {', '.join(known)}."
        )
    units = {s.name: f"{s.unit}/s" if s.unit else "" for s in plant.states}
    added = {name: Signal(name=f"{PUSH}{name}", unit=units[name], text=f"a hand on {name}") for name in states}
    rates = tuple(
        sp.Add(rate, added[name].symbol, evaluate=False) if name in added else rate
        for name, rate in zip(known, plant.rates, strict=True)
    )
    return replace(plant, inputs=(*plant.inputs, *added.values()), rates=rates) if added else plant


def input_facts(made: Program, signal: Signal, slot: str, begin: Begin, pushes: Sequence[str] = ()) -> dict[str, Any]:
    """A reference or disturbance: the slot `given` is written at any time, `slot` is what a sample took of it."""
    made.slot(slot)
    made.slot(f"given_{slot}")
    more = {"push": signal.name.removeprefix(PUSH)} if signal.name in {f"{PUSH}{name}" for name in pushes} else {}
    value = begin.inputs.get(signal.name, 0.0)
    return signal_facts(signal, slot=slot, given=f"given_{slot}", value=value, **more)


def identity(loop: Loop | System, kind: str, period: float, *, plain: bool) -> dict[str, Any]:
    """Who the loop is, and whether its run is the processor's own to the last bit."""
    plant = loop.plant if isinstance(loop, Loop) else loop
    made = loop if isinstance(loop, Loop) else Loop(plant=loop)
    return {
        "name": plant.name,
        "text": plant.text,
        "kind": kind,
        "period": period,
        "hash": fingerprint(made),
        "plain": plain,
    }


def complete(made: Program, facts: Mapping[str, Any], period: float) -> None:
    """Slots and numbers that every engine needs."""
    for slot in ("samples", "outcome", "ended", "seed", "bound_square", "period", "steps", "least_steps", "whole_delay",
                 "option_drive", *(f"option_{each['name']}" for each in facts["options"])):  # fmt: skip
        made.slot(slot)
    for each in facts["initial"]:
        for key in ("slot", "wanted"):
            if key in each:
                made.slot(each[key])
    made.begin.update({"bound_square": BOUND**2, "period": period})
    entries = [*facts["references"], *facts["disturbances"]]
    made.constants.update(
        {
            "states": len([s for s in made.places if s[0] == "x" and s[1:].isdigit()]),
            "entries": [[made.slot(each["slot"]), made.slot(each["given"])] for each in entries],
        }
    )


def with_vector(facts: dict[str, Any], record: Callable[[], dict[str, Any]], made: Program, seconds: float) -> None:
    """The recorded run, or why there is none."""
    facts["vector"], facts["unchecked"] = None, ""
    if not seconds > 0:
        return
    try:
        vector = record()
    except UlnaError as error:
        facts["unchecked"] = str(error)
        return
    begin = [[each["given"], each["value"]] for each in (*facts["references"], *facts["disturbances"])]
    rows = (*facts["parameters"], *facts["initial"])
    begin += [[each["slot"], each["value"]] for each in rows if each.get("slot") in made.places]
    # The recorded run has its set points held.
    options = [(each["name"], each["value"] and each["name"] != "source") for each in facts["options"]]
    begin += [[f"option_{name}", float(value)] for name, value in options] + [["seed", 1.0]]
    held = [each.get("value", 0.0) for each in facts["commands"]]
    facts["vector"] = {**vector, "begin": begin + vector["begin"], "held": held}
