"""`Limited`: a continuous loop as x' = f(x, s), s = k(x) within limits, in exact formulas."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
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

    The wires and `raw` are the loop as it stands: substituted into each other, a singular law and the plant's factor
    would cancel. `rates` and `commands` are the same substituted.

    Attributes:
        name: of the loop. states: its states.
        wires: what runs between its parts, in order: symbol, and formula in states and earlier wires. The symbol of a
            limited wire stands for the limited value wherever it is used.
        raw: (n,) rates in states and wires.
        rates: f in the states and the limited wires.
        limited: symbols of the limited wires. commands: k, what each would be without limits, in the states.
        lower, upper: the limits.
        parameters: symbols that keep no value, of a claim over parameters.
    """

    name: str
    states: tuple[Signal, ...]
    wires: tuple[tuple[sp.Symbol, sp.Expr], ...]
    raw: tuple[sp.Expr, ...]
    rates: tuple[sp.Expr, ...]
    limited: tuple[sp.Symbol, ...]
    commands: tuple[sp.Expr, ...]
    lower: tuple[sp.Expr, ...]
    upper: tuple[sp.Expr, ...]
    parameters: tuple[sp.Symbol, ...] = ()

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        """Of the states."""
        return tuple(s.symbol for s in self.states)


def limited_loop(loop: Loop, inputs: Mapping[str, Any], kept: Sequence[str] = ()) -> Limited:
    """The loop in exact formulas, references and disturbances held.

    Args:
        loop: continuous; of its hardware only the saturation counts.
        inputs: SI values of references and disturbances by name; 0 where left out.
        kept: names of parameters that keep no value.

    Raises:
        CertifyError: a loop with a processor or end stops, parameters without a value, an unknown input, formulas that
            are not smooth.
    """
    if loop.sampled:
        raise CertifyError(
            f"a proof for the loop of '{loop.plant.name}'",
            "it runs on a processor, and the claim is about a continuous loop.",
            "Claim UltimateBound(), or leave the period out.",
        )
    if loop.hardware is not None and loop.hardware.end_stops:
        raise CertifyError(f"a proof for the loop of '{loop.plant.name}'", "it has end stops.", "Leave them out.")
    if loop.controller is None and loop.saturation:
        raise CertifyError(
            f"limits of '{loop.plant.name}'", "no controller commands what they limit.", "Give a controller."
        )
    system = loop.system
    if system.discrete:
        raise CertifyError(
            f"a proof for the loop of '{loop.plant.name}'",
            "it is a system of difference equations, for which there is no theorem here yet.",
            "Ask `analyse` for its eigenvalues: with all |λ| < 1 its equilibrium is stable.",
        )
    _check_kept(system, kept)
    missing = [p.name for p in system.parameters if p.value is None and p.name not in kept]
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
            f"a proof for '{system.name}'", "some of its definitions are implicit equations.", "Solve them by hand."
        )
    values = {symbol: value for symbol, value in system.values.items() if symbol.name not in kept}
    held = {s.symbol: exact(inputs.get(s.name, 0)) for s in system.inputs} | values
    return _opened(loop, system, held, tuple(p.symbol for p in system.parameters if p.name in kept))


def _check_kept(system: System, kept: Sequence[str]) -> None:
    known = [p.name for p in system.parameters]
    for name in kept:
        if name not in known:
            raise CertifyError(
                f"the parameter '{name}' of the claim",
                f"the loop has no such parameter. Known: {', '.join(known) or 'none, all are numbers'}.",
                "Take a name that is known." if known else "Build the loop from the plant before `with_values()`.",
            )


def _opened(
    loop: Loop, system: System, held: Mapping[sp.Symbol, sp.Expr], parameters: tuple[sp.Symbol, ...]
) -> Limited:
    """The limited wires taken out of the closed loop; an observer reads the limited signal, as in a simulation."""
    limits = loop.saturation
    shown = dict(zip((s.name for s in system.outputs), system.readouts, strict=True))
    formulas = {d.symbol: d.expression for d in system.definitions}
    # An observer reads the input through a wire of its own, of the same formula.
    sources: dict[sp.Symbol, sp.Symbol] = {}
    for name in limits:
        wire = shown.get(name)
        if wire not in formulas:
            raise CertifyError(f"the limit of '{name}'", "the closed loop has no signal of this name.")
        sources |= dict.fromkeys((s for s, e in formulas.items() if e == formulas[wire]), wire)
    wires: list[tuple[sp.Symbol, sp.Expr]] = []
    for symbol, formula in formulas.items():
        source = sources.get(symbol, symbol)
        # The limited wire comes where the first of its copies stands.
        if all(source != known for known, _ in wires):
            wires.append((source, formula.xreplace(held)))
        if symbol != source:
            wires.append((symbol, source))
    meaning, commands = {}, {}
    for symbol, formula in wires:
        whole = formula.xreplace(meaning)
        if sources.get(symbol) == symbol:
            commands[symbol] = whole
            whole = symbol
        meaning[symbol] = whole
    if any(e.has(*commands) for e in commands.values()):
        raise CertifyError(f"a proof for '{system.name}'", "one limited signal depends on another one.")
    raw = tuple(e.xreplace(held) for e in system.rates)
    check_smooth(system.name, (*raw, *(formula for _, formula in wires)))
    by_name = {shown[name]: limit for name, limit in limits.items()}
    return Limited(
        name=system.name,
        states=system.states,
        wires=tuple(wires),
        raw=raw,
        rates=tuple(e.xreplace(meaning) for e in raw),
        limited=tuple(commands),
        commands=tuple(commands.values()),
        lower=tuple(_bound(by_name[symbol].lower) for symbol in commands),
        upper=tuple(_bound(by_name[symbol].upper) for symbol in commands),
        parameters=parameters,
    )


def _bound(limit: float) -> sp.Expr:
    """The limit, exact; for none at all one that no box here reaches, so that the proof is the same."""
    return exact(limit) if math.isfinite(limit) else sp.Integer(10) ** 300 * (1 if limit > 0 else -1)


def check_smooth(name: str, expressions: tuple[sp.Expr, ...]) -> None:
    """Refuse formulas with kinks, jumps or powers that vary.

    Raises:
        CertifyError: naming the first of them.
    """
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
