"""`Rules`: what a continuous run has to obey and to report, put into expressions of its system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import sympy as sp

from ulna.base import SimulationError
from ulna.loop import TIME, EndStop, Saturation
from ulna.sim.continuous.crossing import Crossing
from ulna.sim.continuous.settling import Settling
from ulna.symbolic.formulas import parse_formula
from ulna.symbolic.solving import solve_affine
from ulna.system import System

Reported = Crossing | Settling
"""What a run may be asked to report."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """A saturated input: its name, its limits and the symbol that says at which of them it stands (−1, 0, 1)."""

    name: str
    bounds: Saturation
    mode: sp.Symbol


@dataclass(frozen=True, slots=True, kw_only=True)
class Wall:
    """An end stop, with the places of position and velocity among the states."""

    stop: EndStop
    position: int
    velocity: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rules:
    """What a run obeys and reports.

    Attributes:
        shown: the system with its limits written out (Min, Max), whose outputs a trajectory shows.
        rates: (n,) without abbreviations; limits are decided by the modes of `limits`.
        limits, walls, reported: what there is; not the limits of commands that jump, which `rates` have written out.
        watched: the expressions at whose zeros or levels something happens: the command of each limit, position and
            push of each wall, then one for each of `reported`.
        commands: by the name of each limit before and after it, as functions of states, inputs and parameters.
    """

    shown: System
    rates: tuple[sp.Expr, ...]
    limits: tuple[Limit, ...]
    walls: tuple[Wall, ...]
    reported: tuple[Reported, ...]
    watched: tuple[sp.Expr, ...]
    commands: Mapping[str, tuple[sp.Expr, sp.Expr]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits of a continuous run: saturated signals by name, walls of the plant."""

    saturation: tuple[tuple[str, Saturation], ...] = ()
    end_stops: tuple[EndStop, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.saturation or self.end_stops)


def rules(system: System, given: Limits, reported: tuple[Reported, ...]) -> Rules:
    """The rules that limits and wishes make for a system.

    Raises:
        SimulationError: names that the system does not have; a velocity that does not move its position.
    """
    given_limits = _limits(given.saturation)
    sources = {limit.name: _sources(system, limit.name) for limit in given_limits}
    clipped = _expanded(system, {s: _clipped(limit) for limit in given_limits for s in sources[limit.name]})
    # A command that jumps enters and leaves its limits at once: its jump is held, not where it stands.
    limits = tuple(limit for limit in given_limits if not clipped.commands[sources[limit.name][0]].has(*_JUMPS))
    written = {limit.name: (_decided if limit in limits else _clipped)(limit) for limit in given_limits}
    decided = _expanded(system, {s: expression for name, expression in written.items() for s in sources[name]})
    walls = tuple(_wall(system, decided, stop) for stop in given.end_stops)
    commands = [decided.commands[sources[limit.name][0]] for limit in limits]
    positions = [each for wall in walls for each in _of_wall(system, decided, wall)]
    return Rules(
        shown=replace(system, rates=clipped.rates, readouts=clipped.readouts, definitions=())
        if given_limits
        else system,
        rates=decided.rates,
        limits=limits,
        walls=walls,
        reported=reported,
        watched=(*commands, *positions, *(_watched(system, decided, each) for each in reported)),
        commands={name: (clipped.commands[wires[0]], clipped.meaning[wires[0]]) for name, wires in sources.items()},
    )


def limited(system: System, saturation: Mapping[str, Saturation]) -> System:
    """The system with inputs, or signals between its parts, held within their limits.

    Raises:
        SimulationError: names that the system does not have; limits in an algebraic loop.
    """
    return rules(system, Limits(saturation=tuple(saturation.items())), ()).shown


_JUMPS = (sp.sign, sp.Heaviside, sp.Piecewise, sp.floor, sp.ceiling)
_VALUE = sp.Symbol("limited value", real=True)


def _decided(limit: Limit) -> sp.Expr:
    """The limited value as a polynomial of the mode, in which every mode picks its branch exactly."""
    m, bounds = limit.mode, limit.bounds
    parts = [(1 - m**2) * _VALUE]
    if bounds.upper < sp.oo:
        parts.append(m * (m + 1) / 2 * sp.Float(bounds.upper))
    if bounds.lower > -sp.oo:
        parts.append(m * (m - 1) / 2 * sp.Float(bounds.lower))
    return sp.Add(*parts)


def _clipped(limit: Limit) -> sp.Expr:
    return sp.Min(sp.Max(_VALUE, limit.bounds.lower), limit.bounds.upper)


def _limits(given: tuple[tuple[str, Saturation], ...]) -> tuple[Limit, ...]:
    return tuple(
        Limit(name=name, bounds=bounds, mode=sp.Symbol(f"limit of {name}", real=True)) for name, bounds in given
    )


def _wired(system: System, name: str) -> sp.Symbol | None:
    """The symbol of the wire that an output shows, if it shows one that some rate depends on."""
    readout = next((e for s, e in zip(system.outputs, system.readouts, strict=True) if s.name == name), None)
    wires = {d.symbol for d in system.definitions}
    return readout if isinstance(readout, sp.Symbol) and readout in wires else None


def _sources(system: System, name: str) -> tuple[sp.Symbol, ...]:
    """The symbols that carry a limited input: itself, or in a closed loop the wires of that signal.

    An observer reads the input through a wire of its own; like a processor, it knows what it limits.
    """
    if name in {s.name for s in system.inputs}:
        return (sp.Symbol(name, real=True),)
    wire = _wired(system, name)
    if wire is None:
        wired = [s.name for s in system.outputs if _wired(system, s.name)]
        known = ", ".join((*(s.name for s in system.inputs), *wired)) or "none"
        raise SimulationError(
            f"saturation of '{name}' in '{system.name}'",
            "this is neither an input nor a signal between its parts.",
            f"What can be limited: {known}.",
        )
    expression = next(d.expression for d in system.definitions if d.symbol == wire)
    return tuple(d.symbol for d in system.definitions if d.symbol == wire or d.expression == expression)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Expanded:
    """A system without abbreviations. meaning: of inputs and definitions; commands: of what is limited, before that."""

    rates: tuple[sp.Expr, ...]
    readouts: tuple[sp.Expr, ...]
    meaning: Mapping[sp.Symbol, sp.Expr]
    commands: Mapping[sp.Symbol, sp.Expr]


def _expanded(system: System, limited: Mapping[sp.Symbol, sp.Expr]) -> _Expanded:
    """The system with some inputs or wires limited."""
    commands: dict[sp.Symbol, sp.Expr] = {s: s for s in system.input_symbols if s in limited}
    meaning = {s: limited[s].xreplace({_VALUE: s}) for s in commands}
    for definition in (d for d in system.definitions if not d.implicit):
        symbol, whole = definition.symbol, definition.expression.xreplace(meaning)
        if symbol in limited:
            commands[symbol] = whole
            whole = limited[symbol].xreplace({_VALUE: whole})
        meaning[symbol] = whole
    if system.unknowns:
        unknowns = [d.symbol for d in system.unknowns]
        equations = [d.expression.xreplace(meaning) for d in system.unknowns]
        if limited.keys() & set(unknowns) or any(_cut_off(e, unknowns) for e in equations):
            names = ", ".join(s.name for s in limited)
            raise SimulationError(
                f"saturation of '{names}' in '{system.name}'",
                "it lies in an algebraic loop, which is solved without limits.",
                "Break that loop with a state, or give a period: a processor limits what it commands.",
            )
        found = solve_affine(equations, unknowns, where=f"'{system.name}'")
        meaning = {symbol: e.xreplace(found) for symbol, e in meaning.items()} | found
        commands = {symbol: e.xreplace(found) for symbol, e in commands.items()}
    return _Expanded(
        rates=tuple(e.xreplace(meaning) for e in system.rates),
        readouts=tuple(e.xreplace(meaning) for e in system.readouts),
        meaning=meaning,
        commands=commands,
    )


def _cut_off(equation: sp.Expr, unknowns: Sequence[sp.Symbol]) -> bool:
    """Whether a limit acts on an unknown."""
    return any(each.has(*unknowns) for each in equation.atoms(sp.Min, sp.Max))


def _wall(system: System, expanded: _Expanded, stop: EndStop) -> Wall:
    names = [s.name for s in system.states]
    asked = f"end stop of '{stop.position}' in '{system.name}'"
    unknown = [name for name in (stop.position, stop.velocity) if name not in names]
    if unknown:
        raise SimulationError(asked, f"it has no state {', '.join(unknown)}.", f"Its states: {', '.join(names)}.")
    wall = Wall(stop=stop, position=names.index(stop.position), velocity=names.index(stop.velocity))
    velocity = system.states[wall.velocity].symbol
    rate = expanded.rates[wall.position]
    if rate.xreplace({velocity: sp.S.Zero}) != 0 or rate.diff(velocity) == 0:
        raise SimulationError(
            asked, f"{stop.position}' = {rate} does not stand still with {stop.velocity} = 0.", "Name its velocity."
        )
    return wall


def _of_wall(system: System, expanded: _Expanded, wall: Wall) -> tuple[sp.Expr, sp.Expr]:
    """Position, and the acceleration with which it is pushed."""
    position, velocity = system.states[wall.position].symbol, system.states[wall.velocity].symbol
    return position, expanded.rates[wall.position].diff(velocity) * expanded.rates[wall.velocity]


def _watched(system: System, expanded: _Expanded, wish: Reported) -> sp.Expr:
    names: dict[str, sp.Expr] = {TIME.name: TIME}
    names |= {s.name: e for s, e in zip(system.outputs, expanded.readouts, strict=True)}
    names |= {d.name: expanded.meaning[d.symbol] for d in system.definitions}
    symbols = (*system.state_symbols, *system.input_symbols, *system.parameter_symbols)
    names |= {s.name: expanded.meaning.get(s, s) for s in symbols}
    if isinstance(wish, Settling):
        shown = {s.name for s in (*system.outputs, *system.states)}
        if wish.output not in shown:
            known = ", ".join(s.name for s in (*system.outputs, *system.states))
            raise SimulationError(f"settling of '{wish.output}'", "there is no such output.", f"Known: {known}.")
        return names[wish.output]
    if isinstance(wish.expression, str):
        return parse_formula(wish.expression, names, where=f"event '{wish.name}'")
    table = {sp.Symbol(name, real=True): meaning for name, meaning in names.items()}
    unknown = sorted(str(s) for s in wish.expression.free_symbols - table.keys())
    if unknown:
        raise SimulationError(
            f"event '{wish.name}' of '{system.name}'",
            f"its expression uses {', '.join(unknown)}.",
            f"Known: {', '.join(names)}; symbols are real: Symbol(name, real=True).",
        )
    return wish.expression.xreplace(table)
