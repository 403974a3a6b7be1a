"""What a law follows: the operating point, a set point, or a smooth reference with its derivatives."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import pairwise

import sympy as sp

from ulna.symbolic.exact import tidy
from ulna.system import Signal, System, equilibrium


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceChain:
    """A reference for one linearising output and its derivatives up to the relative degree.

    Attributes:
        signals: the law's reference inputs, in order of differentiation; empty for a fixed point.
        values: (r + 1,) what z₁ … z_r and the new input v should be.
    """

    signals: tuple[Signal, ...]
    values: tuple[sp.Expr, ...]


class AbstractReference(ABC):
    """A kind of reference; says which inputs the law gets and what the chain z should be."""

    @abstractmethod
    def chain(self, system: System, output: sp.Expr, index: int, order: int) -> ReferenceChain:
        """The reference of the `index`-th linearising output, whose chain has `order` coordinates."""


@dataclass(frozen=True, slots=True)
class Regulate(AbstractReference):
    """Hold the operating point: the origin in the paper's law (30, 32). No reference input.

    Examples:
        >>> law = ulna.state_feedback("duffing", [-1, -2], reference=ulna.Regulate())
        >>> [signal.name for signal in law.system.inputs]
        ['x1', 'x2']
    """

    def chain(self, system: System, output: sp.Expr, index: int, order: int) -> ReferenceChain:
        """The output's value at the operating point and zeros behind it."""
        del index
        held = tidy(output.subs(dict(equilibrium(system).states)))
        return ReferenceChain(signals=(), values=(held, *(sp.Integer(0),) * order))


@dataclass(frozen=True, slots=True)
class SetPoint(AbstractReference):
    """Hold a constant set point, an input of the law named `<output>_ref`.

    Examples:
        >>> law = ulna.state_feedback("duffing", [-1, -2], reference=ulna.SetPoint())
        >>> [signal.name for signal in law.system.inputs]
        ['x1', 'x2', 'y_ref']
    """

    def chain(self, system: System, output: sp.Expr, index: int, order: int) -> ReferenceChain:
        """The set point and zeros behind it."""
        signal, scaled = _referred(system, output, index)
        return ReferenceChain(signals=(signal,), values=(scaled, *(sp.Integer(0),) * order))


@dataclass(frozen=True, slots=True)
class Track(AbstractReference):
    """Follow a smooth reference and its derivatives, inputs `<output>_ref`, `<output>_ref_d1` and so on.

    Examples:
        >>> law = ulna.state_feedback("duffing", [-1, -2], reference=ulna.Track())
        >>> [signal.name for signal in law.system.inputs]
        ['x1', 'x2', 'y_ref', 'y_ref_d1', 'y_ref_d2']
    """

    def chain(self, system: System, output: sp.Expr, index: int, order: int) -> ReferenceChain:
        """The reference and its derivatives, carried through the linearising output by the chain rule."""
        signal, scaled = _referred(system, output, index)
        signals = [signal]
        for k in range(1, order + 1):
            unit = f"{signal.unit}/s^{k}" if k > 1 else f"{signal.unit}/s"
            text = f"derivative {k} of {signal.text}"
            signals.append(Signal(name=f"{signal.name}_d{k}", unit=unit if signal.unit else "", text=text))
        values = [scaled]
        for _ in range(order):
            last = values[-1]
            values.append(sum((last.diff(a.symbol) * b.symbol for a, b in pairwise(signals)), sp.Integer(0)))
        return ReferenceChain(signals=tuple(signals), values=tuple(values))


def _referred(system: System, output: sp.Expr, index: int) -> tuple[Signal, sp.Expr]:
    """The reference signal, and the linearising output it stands for.

    Where the linearising output is a function of one measured state alone the user's reference is for that
    measurement (0.051 θ follows a reference for θ); otherwise it is for the linearising output itself.
    """
    measured = dict(zip(system.inline(system.readouts), system.outputs, strict=True))
    states = output.free_symbols & set(system.state_symbols)
    for state in states if len(states) == 1 else ():
        if state in measured:
            signal = measured[state]
            name = f"{signal.name}_ref"
            reference = Signal(name=name, unit=signal.unit, text=f"reference of {signal.text or signal.name}")
            return reference, output.xreplace({state: reference.symbol})
    suffix = str(index + 1) if index else ""
    name = f"z{index + 1}_ref"
    return Signal(name=name, text=f"reference of linearising output {suffix or '1'}"), sp.Symbol(name, real=True)
