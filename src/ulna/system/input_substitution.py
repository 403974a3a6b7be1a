"""Plants that a function of an input drives: that function becomes the input, and a law for it is turned back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from ulna.base import NotAffineError, PlantError
from ulna.symbolic.formulas import formula
from ulna.symbolic.solving import solutions
from ulna.system.holder import SystemLike, as_system
from ulna.system.signal import Signal
from ulna.system.system import System

_SECONDS = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class InputSubstitution:
    """A plant with v = φ(u) in place of an input u that enters through φ alone.

    Attributes:
        given: the plant as it was; system: the same with the new inputs, each with the range that follows.
        meaning: φ(u) by new input; commands: u as an expression in the new input, by old input.

    Examples:
        >>> data = {"name": "p", "inputs": {"u": {}}, "states": {"x": {"equation": "exp(u) - x"}}}
        >>> changed = ulna.substitute_input(ulna.system_from_mapping(data))
        >>> changed.meaning, changed.commands
        ({exp_u: exp(u)}, {u: log(exp_u)})
    """

    given: System
    system: System
    meaning: Mapping[sp.Symbol, sp.Expr]
    commands: Mapping[sp.Symbol, sp.Expr]

    def undo(self, law: SystemLike) -> System:
        """The law that commands the given plant's inputs, from one that commands the new ones.

        Raises:
            PlantError: where the law does not command a new input.
        """
        found = as_system(law)
        wanted = {s.name: e for s, e in zip(found.outputs, found.readouts, strict=True)}
        missing = [v.name for v in self.system.inputs if v.name not in wanted]
        if missing:
            raise PlantError(f"commands of '{found.name}'", f"it has no output {', '.join(missing)}.")
        by = {v.symbol: wanted[v.name] for v in self.system.inputs}
        readouts = tuple(self.commands.get(u.symbol, u.symbol).xreplace(by) for u in self.given.inputs)
        return replace(
            found, outputs=tuple(replace(u, lower=None, upper=None) for u in self.given.inputs), readouts=readouts
        )


def substitute_input(system: SystemLike) -> InputSubstitution:
    """The plant in v = φ(u) for every input u that enters through one function φ(u) of it alone, u = φ⁻¹(v) undone.

    φ may be an even or odd power, n·|n|, a square root, sin, tan, exp and their like; the branch of the inverse is the
    one on the input's declared range: n = √v for v = n² with range [0, 2000], δ = arctan(v) for v = tan δ, |δ| < π/2.

    Raises:
        NotAffineError: where an input enters in no such way, or its range leaves the branch open.

    Examples:
        >>> data = {"name": "p", "inputs": {"u": {}}, "states": {"x": {"equation": "exp(u) - x"}}}
        >>> ulna.substitute_input(ulna.system_from_mapping(data)).system.rates
        (exp_u - x,)
    """
    given = as_system(system)
    rates = list(given.inline(given.rates))
    meaning, commands, inputs = dict[sp.Symbol, sp.Expr](), dict[sp.Symbol, sp.Expr](), list[Signal]()
    for signal in given.inputs:
        if all(not r.diff(signal.symbol).has(signal.symbol) for r in rates):
            inputs.append(signal)
            continue
        phi = _through(given, rates, signal)
        v = Signal(name=_free_name(given, signal, phi), text=f"{formula(phi)} of {signal.name}")
        back = _inverse(given, signal, phi, v.symbol)
        lower, upper = _image(phi, signal)
        inputs.append(replace(v, lower=lower, upper=upper))
        rates = [_marked(r, phi, v.symbol) for r in rates]
        meaning[v.symbol], commands[signal.symbol] = phi, back
    point = tuple(_moved(name, value, meaning) for name, value in given.operating_point)
    changed = replace(
        given,
        rates=tuple(rates),
        inputs=tuple(inputs),
        definitions=(),
        operating_point=point,
        readouts=tuple(given.inline(given.readouts)),
    )
    return InputSubstitution(given=given, system=changed, meaning=meaning, commands=commands)


def _moved(name: str, value: sp.Expr, meaning: Mapping[sp.Symbol, sp.Expr]) -> tuple[str, sp.Expr]:
    """An entry of the operating point: of an input that was replaced the value of what replaces it."""
    u = sp.Symbol(name, real=True)
    return next(((v.name, phi.subs(u, value)) for v, phi in meaning.items() if phi.has(u)), (name, value))


def _through(system: System, rates: list[sp.Expr], signal: Signal) -> sp.Expr:
    """The one function of the input through which it enters, linearly."""
    u = signal.symbol
    found = {a for r in rates for a in r.atoms(sp.Pow, sp.Function) if a.has(u) and a.free_symbols == {u}}
    found |= {u * sp.Abs(u) for r in rates if r.has(sp.Abs(u))}
    for phi in sorted(found, key=sp.count_ops):
        mark = sp.Dummy(real=True)
        marked = [_marked(r, phi, mark) for r in rates]
        if all(not r.has(u) and not r.diff(mark).has(mark, *system.input_symbols) for r in marked):
            return phi
    raise _open(
        system,
        signal,
        "enters through more than one function of it, or of it and the states together, or multiplied by another input",
    )


def _marked(rate: sp.Expr, phi: sp.Expr, mark: sp.Symbol) -> sp.Expr:
    """The rate with a symbol for the function, which may be part of a product: n·|n|."""
    return sp.expand(rate).subs(phi, mark) if phi.is_Mul else rate.xreplace({phi: mark})


def _inverse(system: System, signal: Signal, phi: sp.Expr, v: sp.Symbol) -> sp.Expr:
    """The solution of φ(u) = v that gives back every u in the range; tried at points of it."""
    u, (low, high) = signal.symbol, _range(signal, phi)
    places = [sp.Rational(str(round(low + (high - low) * t, 6))) for t in (0.03, 0.2, 0.5, 0.8, 0.97)]
    candidates = {
        sp.sin: sp.asin(v),
        sp.tan: sp.atan(v),
        sp.cos: sp.acos(v),
        sp.exp: sp.log(v),
        sp.tanh: sp.atanh(v),
        sp.sinh: sp.asinh(v),
    }
    if phi == u * sp.Abs(u):
        return sp.sign(v) * sp.sqrt(sp.Abs(v))
    known = [candidates[phi.func]] if phi.func in candidates and phi.args[0] == u else _solved(phi - v, u)
    for solution in known:
        values = [solution.subs(v, phi.subs(u, place)) for place in places]
        if all(
            abs(complex(sp.N(value - place))) < 1e-9 * (1 + abs(float(place)))
            for value, place in zip(values, places, strict=True)
        ):
            return solution
    raise _open(system, signal, f"enters through {formula(phi)}, which its range does not make one to one")


def _solved(equation: sp.Expr, u: sp.Symbol) -> list[sp.Expr]:
    return [found[u] for found in solutions([equation], [u], seconds=_SECONDS) if u in found]


def _range(signal: Signal, phi: sp.Expr) -> tuple[float, float]:
    """Where the input is: its declared range; without one a turn's quarter about zero for angles, else both signs."""
    usual = (-1.5, 1.5) if phi.has(sp.sin, sp.tan) else (0.01, 3.1) if phi.has(sp.cos) else (-3.0, 3.0)
    sides = (signal.lower, signal.upper)
    lower, upper = (None if side is None else float(side) for side in sides)
    low = lower if lower is not None else usual[0] if upper is None else upper - 3
    high = upper if upper is not None else usual[1] if lower is None else low + 3
    return low, high


def _image(phi: sp.Expr, signal: Signal) -> tuple[sp.Expr | None, sp.Expr | None]:
    """The range of φ(u) where φ goes one way on the declared range."""
    if signal.lower is None or signal.upper is None:
        return None, None
    ends = [phi.subs(signal.symbol, side) for side in (signal.lower, signal.upper)]
    if not all(e.is_finite and e.is_real for e in ends):
        return None, None
    first, last = sorted(ends, key=lambda e: float(np.float64(sp.N(e))))
    return first, last


def _free_name(system: System, signal: Signal, phi: sp.Expr) -> str:
    taken = {x.name for x in (*system.states, *system.inputs, *system.parameters, *system.definitions, *system.outputs)}
    squares = (signal.symbol**2, signal.symbol * sp.Abs(signal.symbol))
    name = f"{signal.name}_squared" if phi in squares else f"{type(phi).__name__.lower()}_{signal.name}"
    while name in taken:
        name += "_"
    return name


def _open(system: System, signal: Signal, found: str) -> NotAffineError:
    return NotAffineError(
        f"a new input in place of '{signal.name}' of '{system.name}'",
        f"the input {signal.name} {found}.",
        "Declare its range in the plant file, or make it a state and its derivative the new input.",
    )
