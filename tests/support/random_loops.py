"""Random loops: plants and controllers of one to eight states, hardware of every kind that ships."""

from __future__ import annotations

from typing import Any

import numpy as np

from ulna.loop import (
    Deadline,
    Euler,
    Guard,
    Hardware,
    Hold,
    Loop,
    MissedSamples,
    Quantiser,
    ReferenceRange,
    Report,
    RungeKutta4,
    SafeOutput,
    Saturation,
    SlewLimit,
)
from ulna.program import AbstractArithmetic, Fused, Plain
from ulna.system import system_from_mapping

FORMS = (
    *(
        "{c}*{a}",
        "{c}*{a}*{b}",
        "{c}*sin({a})",
        "{c}*cos({a})*{b}",
        "{c}*tanh({a})",
        "{c}*abs({a})",
        "{c}*exp(-{a}**2)",
    ),
    *("{c}*{a}/(1 + {b}**2)", "{c}*sqrt(1 + {a}**2)", "{c}*max({a}, {b})", "{c}*atan({a})", "{c}"),
)


def random_loop(seed: int, arithmetic: AbstractArithmetic | None = None) -> Loop:
    """A loop that a seed stands for: one to three inputs, measured outputs and references.

    The seed stands for hypothesis' choices: many loops are compiled at once, which one example a call is not.
    """
    random = np.random.default_rng(seed)
    inputs = [f"u{k}" for k in range(random.integers(1, 4))]
    outputs = [f"y{k}" for k in range(random.integers(1, 4))]
    references = [f"ref{k}" for k in range(random.integers(0, 3))]
    states = [f"x{k}" for k in range(random.integers(1, 9))]
    memory = [f"z{k}" for k in range(random.integers(1, 9))]
    plant = {
        "name": f"random plant {seed}",
        "states": {x: f"{_sum(random, [*states, *inputs])} - {x}" for x in states},
        "inputs": {u: {} for u in inputs},
        "outputs": {y: _sum(random, states) for y in outputs},
    }
    heard = [*memory, *outputs, *references]
    controller = {
        "name": f"random controller {seed}",
        "states": {z: f"{_sum(random, heard)} - {z}" for z in memory},
        "inputs": {name: {} for name in (*outputs, *references)},
        "outputs": {u: _sum(random, heard) for u in inputs},
    }
    hardware = _hardware(random, inputs, outputs, references, arithmetic)
    return Loop(plant=system_from_mapping(plant), controller=system_from_mapping(controller), hardware=hardware)


def _sum(random: np.random.Generator, names: list[str]) -> str:
    """Two to four terms."""
    terms = []
    for _ in range(random.integers(2, 5)):
        a, b = random.choice(names, 2)
        terms.append(random.choice(FORMS).format(c=f"{random.uniform(0.1, 3.0):.3f}", a=a, b=b))
    return " + ".join(terms)


def _hardware(
    random: np.random.Generator,
    inputs: list[str],
    outputs: list[str],
    references: list[str],
    arithmetic: AbstractArithmetic | None,
) -> Hardware:
    def one_of(*choices: Any) -> Any:
        return choices[random.integers(len(choices))]

    period = one_of(1e-3, 1e-2, 0.0625)
    reaction = one_of(Hold(), SafeOutput(0.25), Report())
    named: dict[str, Any] = {}
    if references:
        held = one_of(False, True)
        named["references"] = one_of(None, {references[0]: ReferenceRange(lower=-0.5, upper=0.75, held=held)})
    if one_of(False, True):
        named["deadline"] = Deadline(lateness=0.2 * period, missed=one_of(None, 2), reaction=reaction)
        named["clock"] = one_of(None, MissedSamples(probability=0.1))
    return Hardware(
        period=period,
        delay=period * one_of(0.0, 0.4, 1.0, 1.4, 3.0),
        sensors=one_of(
            None, Quantiser.encoder(bits=10), {outputs[0]: Quantiser.converter(bits=12, lower=-4.0, upper=4.0)}
        ),
        saturation=one_of(None, Saturation(lower=-2.0, upper=3.0), {inputs[-1]: Saturation(lower=-1.0, upper=1.0)}),
        slew=one_of(None, SlewLimit(rate=40.0)),
        discretisation=one_of(Euler(), RungeKutta4()),
        guard=one_of(None, Guard(reaction=one_of(Hold(), SafeOutput(-0.5))), Guard(largest=50.0)),
        arithmetic=arithmetic or one_of(Plain(), Fused()),
        **named,
    )
