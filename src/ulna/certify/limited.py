"""`Limited`: a continuous loop as x' = f(x, s), s = k(x) within limits, in exact formulas."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import sympy as sp

from ulna.certify.errors import CertifyError
from ulna.loop import Loop
from ulna.symbolic.formulas import exact
from ulna.system import Signal, System

SMOOTH = (
    *(sp.sin, sp.cos, sp.tan, sp.asin, sp.acos, sp.atan),
    *(sp.sinh, sp.cosh, sp.tanh, sp.asinh, sp.acosh, sp.atanh, sp.exp, sp.log),
)
"""Functions that prover and checker know."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limited:
    """A loop between its limits.

    Attributes:
        name: of the loop. states: its states. rates: f in the states' symbols and in `limited`.
        limited: a symbol for each limited signal. commands: k, what each would be without limits.
        lower, upper: the limits.
    """

    name: str
    states: tuple[Signal, ...]
    rates: tuple[sp.Expr, ...]
    limited: tuple[sp.Symbol, ...]
    commands: tuple[sp.Expr, ...]
    lower: tuple[sp.Expr, ...]
    upper: tuple[sp.Expr, ...]

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        """Of the states."""
        return tuple(s.symbol for s in self.states)

    @property
    def unlimited(self) -> sp.Matrix:
        """The rates where no limit is met."""
        return sp.Matrix(self.rates).xreplace(dict(zip(self.limited, self.commands, strict=True)))


def limited_loop(loop: Loop, inputs: Mapping[str, Any]) -> Limited:
    """The loop in exact formulas, references and disturbances held.

    Args:
        loop: continuous; of its hardware only the saturation counts.
        inputs: SI values of references and disturbances by name; 0 where left out.

    Raises:
        CertifyError: a loop with a processor or end stops, parameters without a value, an unknown input, formulas that
            are not smooth.
    """
    if loop.sampled:
        raise CertifyError(
            f"a proof for the loop of '{loop.plant.name}'",
            "it runs on a processor, for which there is no theorem here yet.",
            "Leave the period out: the proof is then about the continuous loop within its limits.",
        )
    if loop.hardware is not None and loop.hardware.end_stops:
        raise CertifyError(f"a proof for the loop of '{loop.plant.name}'", "it has end stops.", "Leave them out.")
    system = loop.system
    missing = [p.name for p in system.parameters if p.value is None]
    if missing:
        raise CertifyError(
            f"a proof for '{system.name}'", f"parameters without a value: {', '.join(missing)}.", "Give them values."
        )
    unknown = [name for name in inputs if name not in {s.name for s in system.inputs}]
    if unknown:
        known = ", ".join(s.name for s in system.inputs) or "none"
        raise CertifyError(f"the input '{unknown[0]}'", f"'{system.name}' has no such input.", f"Known: {known}.")
    if any(d.implicit for d in system.definitions):
        raise CertifyError(
            f"a proof for '{system.name}'", "some of its definitions are equations to be solved.", "Solve them by hand."
        )
    held = {s.symbol: exact(inputs.get(s.name, 0)) for s in system.inputs} | dict(system.values)
    return _opened(loop, system, held)


def _opened(loop: Loop, system: System, held: Mapping[sp.Symbol, sp.Expr]) -> Limited:
    """The limited wires taken out of the closed loop; an observer reads the limited signal, as in a simulation."""
    limits = loop.saturation
    shown = dict(zip((s.name for s in system.outputs), system.readouts, strict=True))
    sources: dict[sp.Symbol, sp.Symbol] = {}
    for name in limits:
        wire = next((d for d in system.definitions if d.symbol == shown.get(name)), None)
        if wire is None:
            raise CertifyError(f"the limit of '{name}'", "the closed loop has no wire of this name.")
        symbol = sp.Symbol(f"limited_{name}", real=True)
        sources |= {d.symbol: symbol for d in system.definitions if d.expression == wire.expression}
    meaning, commands = dict(held), {}
    for definition in system.definitions:
        whole = definition.expression.xreplace(meaning)
        if definition.symbol in sources:
            commands.setdefault(sources[definition.symbol], whole)
            whole = sources[definition.symbol]
        meaning[definition.symbol] = whole
    rates = tuple(e.xreplace(meaning) for e in system.rates)
    _check_smooth(system.name, (*rates, *commands.values()))
    return Limited(
        name=system.name,
        states=system.states,
        rates=rates,
        limited=tuple(commands),
        commands=tuple(commands.values()),
        lower=tuple(exact(each.lower) for each in limits.values()),
        upper=tuple(exact(each.upper) for each in limits.values()),
    )


def _check_smooth(name: str, expressions: tuple[sp.Expr, ...]) -> None:
    for expression in expressions:
        for node in sp.preorder_traversal(expression):
            if isinstance(node, sp.Function) and not isinstance(node, SMOOTH):
                raise CertifyError(
                    f"a proof for '{name}'",
                    f"{node.func.__name__} is not smooth: its derivative jumps.",
                    "Write limits of the drive as Hardware(saturation=...).",
                )
            if isinstance(node, sp.Pow) and not node.exp.is_Rational:
                raise CertifyError(f"a proof for '{name}'", f"the power {node} has no fixed rational exponent.")
