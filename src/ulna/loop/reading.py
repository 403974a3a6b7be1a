"""What a controller's input reads of the plant, by name."""

from __future__ import annotations

from dataclasses import dataclass, replace

import sympy as sp

from ulna.system import Signal, System


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """One measured signal.

    Attributes:
        signal: how it is called. expression: of it, in the plant's symbols. state: whether it is a state.
    """

    signal: Signal
    expression: sp.Expr
    state: bool


def reading(plant: System, name: str, *, states_first: bool) -> Reading | None:
    """The plant's output or state that feeds an input of this name; None where neither has it.

    Args:
        plant: what is measured.
        name: of the input; `<output>_measured` means the output, where a state of another meaning has its name.
        states_first: a law on measured states means a state, where an output of another meaning has its name.
    """
    outputs = {s.name: (s, e) for s, e in zip(plant.outputs, plant.inline(plant.readouts), strict=True)}
    states = {s.name: s for s in plant.states}
    given = name if name in outputs else name.removesuffix("_measured")
    hidden = states_first and name in states and name in outputs and outputs[name][1] != states[name].symbol
    if given in outputs and not hidden:
        signal, expression = outputs[given]
        return Reading(signal=signal, expression=expression, state=False)
    if name not in states:
        return None
    shown = replace(states[name], name=f"{name}_state") if name in outputs else states[name]
    return Reading(signal=shown, expression=states[name].symbol, state=True)
