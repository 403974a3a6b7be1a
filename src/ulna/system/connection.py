"""`connect`: systems in, one system out. Wires become definitions: the result compiles like any other system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import sympy as sp

from ulna.base import PlantError, UnitError, dimension_text, unit
from ulna.system.holder import SystemLike, as_system
from ulna.system.rings import in_order
from ulna.system.signal import Definition, Parameter, Signal, from_si, to_si
from ulna.system.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class _Part:
    """One system with the names its quantities have in the whole."""

    key: str
    system: System
    renamed: Mapping[sp.Symbol, sp.Symbol]

    def own(self, expression: sp.Expr) -> sp.Expr:
        return expression.xreplace(dict(self.renamed))


@dataclass(frozen=True, slots=True, kw_only=True)
class _End:
    """An end of a wire: what messages call it, its signal, and its value in the whole."""

    label: str
    signal: Signal
    value: sp.Expr

    def as_seen_by(self, taker: _End) -> sp.Expr:
        """The value in the unit of the input that takes it."""
        here, there = self.signal.unit, taker.signal.unit
        if not (here and there) or here == there:
            return self.value
        dimensions = unit(here).dimension, unit(there).dimension
        if dimensions[0] != dimensions[1]:
            raise UnitError(
                f"wire from '{self.label}' to '{taker.label}'",
                f"'{self.label}' is in {here} ({dimension_text(dimensions[0])}), "
                f"'{taker.label}' in {there} ({dimension_text(dimensions[1])}).",
                "Wire signals of one dimension, or put a part with the right factor between them.",
            )
        return from_si(to_si(self.value, here), there)


def connect(
    parts: Mapping[str, SystemLike],
    wires: Mapping[str, str],
    *,
    outputs: Sequence[str],
    name: str,
    text: str = "",
) -> System:
    """One system from parts whose inputs are wired to outputs.

    Args:
        parts: systems by the key used in wires.
        wires: `"part.input": "part.output"`, or `"part.input": "name"` for an external input of the whole; inputs
            left out become external under their own name.
        outputs: `"part.output"` or `"part.input"` (the wired signal) names that the whole shows.
        name: the whole's name.

    An algebraic loop of wires is solved where it is linear in its signals: b = −2a + r, a = b/4.

    Parts in discrete time share one period; a part without states and period fits all.

    A name that two parts share gets its part's key as a prefix, except a parameter that both hold alike. A wire
    between units of one dimension converts (degrees to rad); a signal without a unit fits every other.

    Raises:
        PlantError: for an unknown end of a wire; for an algebraic loop that is not linear in its signals or has a
            gain of 1 (it is named).
        UnitError: for a wire between units of different dimensions.

    Examples:
        >>> spring = ulna.model("duffing")
        >>> pair = ulna.connect({"a": spring, "b": spring}, {"b.u": "a.y"}, outputs=["b.y"], name="pair")
        >>> [state.name for state in pair.states]
        ['a_x1', 'a_x2', 'b_x1', 'b_x2']
    """
    placed = _place({key: as_system(part) for key, part in parts.items()})
    sources = {f"{key}.{o.name}": (key, i) for key, part in placed.items() for i, o in enumerate(part.system.outputs)}
    externals: dict[str, _End] = {}
    wired: dict[tuple[str, str], tuple[str, int]] = {}
    for key, part in placed.items():
        for signal in part.system.inputs:
            end = wires.get(f"{key}.{signal.name}", signal.name)
            if end in sources:
                wired[key, signal.name] = sources[end]
            elif "." in end:
                raise PlantError(
                    f"wire '{key}.{signal.name}'", f"there is no output '{end}'.", f"Known: {', '.join(sources)}."
                )
            else:
                externals[end] = _outer_end(externals.get(end), end, f"{key}.{signal.name}", signal, part)
    for end in wires:
        key, _, signal_name = end.partition(".")
        if key not in placed or signal_name not in {s.name for s in placed[key].system.inputs}:
            raise PlantError(f"wire '{end}'", "there is no such input.", f"Parts: {', '.join(parts)}.")
    period = _period(placed)
    definitions, meaning = _wire(placed, wires, wired, externals)
    shown = [_shown(placed, meaning, label) for label in outputs]
    return System(
        name=name,
        text=text,
        period=period,
        states=tuple(replace(s, name=p.renamed[s.symbol].name) for p in placed.values() for s in p.system.states),
        rates=tuple(p.own(r) for p in placed.values() for r in p.system.rates),
        inputs=tuple(end.signal for end in externals.values()),
        outputs=tuple(s for s, _ in shown),
        readouts=tuple(e for _, e in shown),
        parameters=_parameters(placed),
        definitions=definitions,
        operating_point=_points(placed),
    )


def _outer_end(known: _End | None, name: str, label: str, signal: Signal, part: _Part) -> _End:
    """An external input: as the part has it that keeps its name, else as the first with a unit."""
    value = sp.Symbol(name, real=True)
    if known is not None and not (signal.unit and (part.renamed[signal.symbol] == value or not known.signal.unit)):
        return known
    return _End(label=f"{name} ({label})", signal=replace(signal, name=name), value=value)


def _place(parts: Mapping[str, System]) -> dict[str, _Part]:
    """Every part with names unique in the whole: of rivals for a name a single state keeps it."""
    owners: dict[str, list[object]] = {}
    states: dict[str, int] = {}
    for system in parts.values():
        for item in (*system.states, *system.inputs, *system.definitions, *system.parameters):
            owners.setdefault(item.name, []).append(item)
        for state in system.states:
            states[state.name] = states.get(state.name, 0) + 1
    placed = {}
    for key, system in parts.items():
        renamed = {}
        for item in (*system.states, *system.inputs, *system.definitions, *system.parameters):
            rivals = owners[item.name]
            plain = len(rivals) == 1 or _same_parameter(item, rivals)
            plain = plain or (item in system.states and states[item.name] == 1)
            renamed[item.symbol] = item.symbol if plain else sp.Symbol(f"{key}_{item.name}", real=True)
        placed[key] = _Part(key=key, system=system, renamed=renamed)
    return placed


def _same_parameter(item: object, rivals: list[object]) -> bool:
    return isinstance(item, Parameter) and all(
        isinstance(r, Parameter) and r.value == item.value and r.unit == item.unit for r in rivals
    )


def _wire(
    placed: Mapping[str, _Part],
    wires: Mapping[str, str],
    wired: Mapping[tuple[str, str], tuple[str, int]],
    externals: Mapping[str, _End],
) -> tuple[tuple[Definition, ...], dict[tuple[str, str], sp.Symbol]]:
    """Definitions of all parts and wires in an order in which each uses only earlier ones, implicit ones last."""
    pending: dict[sp.Symbol, sp.Expr] = {}
    implicit: list[Definition] = []
    meaning: dict[tuple[str, str], sp.Symbol] = {}
    wired_labels: dict[sp.Symbol, str] = {}
    units: dict[sp.Symbol, str] = {}
    for key, part in placed.items():
        for definition in part.system.definitions:
            if definition.implicit:
                name = part.renamed[definition.symbol].name
                implicit.append(replace(definition, name=name, expression=part.own(definition.expression)))
            else:
                pending[part.renamed[definition.symbol]] = part.own(definition.expression)
        for signal in part.system.inputs:
            here = part.renamed[signal.symbol]
            meaning[key, signal.name] = here
            wired_labels[here], units[here] = f"{key}.{signal.name}", signal.unit
            if (key, signal.name) in wired:
                source_key, index = wired[key, signal.name]
                source, readout = placed[source_key].system.outputs[index], placed[source_key].system.readouts[index]
                end = _End(label=f"{source_key}.{source.name}", signal=source, value=placed[source_key].own(readout))
            else:
                end = externals[wires.get(f"{key}.{signal.name}", signal.name)]
            value = end.as_seen_by(_End(label=f"{key}.{signal.name}", signal=signal, value=here))
            if value != here:
                pending[here] = value
    values = {symbol: value for part in placed.values() for symbol, value in _values(part)}
    return (*in_order(pending, wired_labels, units, values), *implicit), meaning


def _values(part: _Part) -> list[tuple[sp.Symbol, sp.Expr]]:
    return [(part.renamed[symbol], value) for symbol, value in part.system.values.items()]


def _period(placed: Mapping[str, _Part]) -> sp.Expr | None:
    """The period that all parts share; None in continuous time."""
    periods = {key: part.system.period for key, part in placed.items() if part.system.states or part.system.discrete}
    if len(set(periods.values())) > 1:
        found = "; ".join(f"{key}: {placed[key].system.time_text}" for key in periods)
        hint = "Give all parts one period; a Loop runs a discrete controller on a continuous plant."
        raise PlantError("connection", f"time passes differently in its parts ({found}).", hint)
    return next(iter(periods.values()), None)


def _shown(
    placed: Mapping[str, _Part],
    meaning: Mapping[tuple[str, str], sp.Symbol],
    label: str,
) -> tuple[Signal, sp.Expr]:
    key, _, signal_name = label.partition(".")
    if key in placed:
        part = placed[key]
        for signal, readout in zip(part.system.outputs, part.system.readouts, strict=True):
            if signal.name == signal_name:
                return signal, part.own(readout)
        for signal in part.system.inputs:
            if signal.name == signal_name:
                return signal, meaning[key, signal_name]
    raise PlantError(f"output '{label}'", "there is no such signal.", f"Parts: {', '.join(placed)}.")


def _parameters(placed: Mapping[str, _Part]) -> tuple[Parameter, ...]:
    found: dict[str, Parameter] = {}
    for part in placed.values():
        for parameter in part.system.parameters:
            new = part.renamed[parameter.symbol].name
            found.setdefault(new, replace(parameter, name=new))
    return tuple(found.values())


def _points(placed: Mapping[str, _Part]) -> tuple[tuple[str, sp.Expr], ...]:
    """The parts' operating points, of their states: what wired inputs are follows from them."""
    points: dict[str, sp.Expr] = {}
    for part in placed.values():
        states = {s.name for s in part.system.states}
        for name, value in part.system.operating_point:
            if name in states:
                points[part.renamed[sp.Symbol(name, real=True)].name] = value
    return tuple(points.items())
