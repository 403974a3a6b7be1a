"""The mapping behind plant files: `system_from_mapping` and back (schema: docs/plant-file.md)."""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping
from dataclasses import replace
from decimal import Decimal
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Any

import sympy as sp

from ulna.base import PlantError, UnitError, coherent, unit
from ulna.symbolic.formulas import exact, exact_text, parse_formula
from ulna.system.dimensions import check_dimensions
from ulna.system.holder import SystemLike, as_system
from ulna.system.number_with_unit import quantity
from ulna.system.picture import picture_of, picture_to_mapping
from ulna.system.signal import Definition, Parameter, Signal
from ulna.system.system import System

_SECTIONS = (
    "parameters",
    "correlation",
    "definitions",
    "states",
    "inputs",
    "outputs",
    "operating_point",
    "picture",
)
_TOP = (
    "format",
    "name",
    "text",
    "source",
    "time",
    "period",
    "dimensions",
    "catalogue",
)  # the last is read by the catalogue alone
_LONGEST = 100
"""Letters of a name: it stands in tables, figures and the names of files."""
_USES = ("measured", "controlled")
"""What an output is for: true where left out."""
_SIGNAL_KEYS = {"unit", "text", "range"}
_KEYS: Mapping[str, set[str]] = {
    "parameters": _SIGNAL_KEYS | {"value", "source", "std"},
    "states": _SIGNAL_KEYS | {"equation"},
    "definitions": {"zero", "unit"},
    "inputs": _SIGNAL_KEYS,
    "outputs": _SIGNAL_KEYS | {"equation", *_USES},
}


def system_from_mapping(data: Mapping[str, Any], *, where: str = "plant") -> System:
    """The system that a plant file's mapping describes.

    Examples:
        >>> v = {"unit": "m/s", "equation": "F/m"}
        >>> data = {"name": "cart", "parameters": {"m": {"value": 2, "unit": "kg"}}, "inputs": {"F": {"unit": "N"}}}
        >>> ulna.system_from_mapping({**data, "states": {"v": v}}).rates
        (F/m,)
    """
    _check_shape(data, where)
    if not data.get("states") and not data.get("outputs"):
        hint = "Give [states] at least one entry, or [outputs] for a static law."
        raise PlantError(where, "it has neither states nor outputs.", hint)
    parameters = tuple(_parameter(name, entry, where) for name, entry in data.get("parameters", {}).items())
    states = _signals(data, "states", where)
    inputs = _signals(data, "inputs", where)
    outputs = _signals(data, "outputs", where)
    names = {item.name: item.symbol for item in (*parameters, *states, *inputs)}
    _check_unique(data, where)
    definitions = _definitions(data.get("definitions", {}), names, where)
    names |= {d.name: d.symbol for d in definitions}
    units = {signal.name: signal.unit or None for signal in (*states, *inputs, *outputs)}
    system = System(
        name=_words(data, "name", where) or Path(where).stem,
        period=_period(data, where),
        text=_words(data, "text", where),
        source=_words(data, "source", where),
        states=states,
        rates=_equations(data, "states", names, where),
        inputs=inputs,
        outputs=outputs,
        readouts=_equations(data, "outputs", names, where),
        parameters=parameters,
        correlations=_correlations(data, where),
        definitions=definitions,
        operating_point=tuple(
            (name, _at_point(value, units.get(name), f"operating point of '{name}' in {where}"))
            for name, value in data.get("operating_point", {}).items()
        ),
        picture=picture_of(data.get("picture"), states=states, parameters=parameters, where=where),
    )
    if data.get("dimensions", "checked") != "unchecked":
        check_dimensions(system)
    system.with_values()  # a parameter value that breaks the plant is told now, not in the middle of a design
    return system


def system_to_mapping(system: SystemLike) -> dict[str, Any]:
    """The mapping that `system_from_mapping` reads back to the same system."""
    system = as_system(system)
    data: dict[str, Any] = {"format": 1, "name": system.name}
    data |= {key: value for key in ("text", "source") if (value := getattr(system, key))}
    data |= {"time": "discrete", "period": _text(system.period)} if system.period is not None else {}
    data |= {} if _dimensions_fit(system) else {"dimensions": "unchecked"}
    sections: dict[str, dict[str, Any]] = {
        "parameters": {
            p.name: _entry(p)
            | {key: _text(value) for key, value in (("value", p.value), ("std", p.std)) if value is not None}
            | _some(source=p.source)
            for p in system.parameters
        },
        "correlation": _correlation_rows(system),
        "definitions": {
            d.name: {"zero": exact_text(d.expression)} | _some(unit=d.unit) if d.implicit else exact_text(d.expression)
            for d in system.definitions
        },
        "states": {
            s.name: _entry(s) | {"equation": exact_text(r)} for s, r in zip(system.states, system.rates, strict=True)
        },
        "inputs": {s.name: _entry(s) for s in system.inputs},
        "outputs": {
            s.name: _entry(s) | {"equation": exact_text(r)} | {use: False for use in _USES if not getattr(s, use)}
            for s, r in zip(system.outputs, system.readouts, strict=True)
        },
        "operating_point": {name: _text(value) for name, value in system.operating_point},
        "picture": {} if system.picture is None else picture_to_mapping(system.picture),
    }
    return data | {key: rows for key, rows in sections.items() if rows}


def _dimensions_fit(system: System) -> bool:
    """Whether its formulas still have dimensions: numbers put in for parameters have taken theirs along."""
    try:
        check_dimensions(system)
    except UnitError:
        return False
    return True


def _check_shape(data: Mapping[str, Any], where: str) -> None:
    if data.get("format", 1) != 1:
        raise PlantError(where, f"format {_shown(data['format'])} is unknown.", "This version reads format = 1.")
    if data.get("dimensions", "checked") not in ("checked", "unchecked"):
        raise PlantError(where, f"dimensions = {_shown(data['dimensions'])}.", 'Write "checked" or "unchecked".')
    for key in data:
        if key not in _SECTIONS and key not in _TOP:
            raise PlantError(where, f"unknown key '{key}'.", f"Known: {', '.join((*_TOP, *_SECTIONS))}.")
    for section in _SECTIONS:
        if not isinstance(data.get(section, {}), Mapping):
            raise PlantError(
                f"[{section}] in {where}", "expected a table.", f"Write [{section}] and one line per entry."
            )
    for section, keys in _KEYS.items():
        for name, entry in data.get(section, {}).items():
            if len(name) > _LONGEST:
                raise PlantError(f"{section} '{name[:20]}…' in {where}", f"its name has {len(name)} characters.")
            if section == "inputs" and not isinstance(entry, Mapping):
                found = f"expected a table, found {_shown(entry)}."
                raise PlantError(f"{section} '{name}' in {where}", found, f'Write {name} = {{ unit = "V" }}, say.')
            for key in entry if isinstance(entry, Mapping) else ():
                if key not in keys:
                    known = ", ".join(sorted(keys))
                    raise PlantError(f"{section} '{name}' in {where}", f"unknown key '{key}'.", f"Known: {known}.")


def _period(data: Mapping[str, Any], where: str) -> sp.Expr | None:
    """Seconds from one value of the states to the next; None in continuous time."""
    if data.get("time", "continuous") not in ("continuous", "discrete"):
        raise PlantError(where, f"time = {_shown(data['time'])}.", 'Write "continuous" or "discrete".')
    discrete = data.get("time") == "discrete"
    if discrete and "period" not in data:
        raise PlantError(where, 'time = "discrete" without a period.', "Add period = 0.001, seconds.")
    if not discrete and "period" in data:
        raise PlantError(where, "a period in continuous time.", 'Add time = "discrete", or leave the period out.')
    return _number(data["period"], f"period of {where}") if discrete else None


def _check_unique(data: Mapping[str, Any], where: str) -> None:
    seen: dict[str, str] = {}
    for section in ("parameters", "definitions", "states", "inputs"):
        for name in data.get(section, {}):
            if name in seen:
                raise PlantError(
                    f"name '{name}' in {where}", f"it is declared in [{seen[name]}] and in [{section}].", "Rename one."
                )
            seen[name] = section


def _signals(data: Mapping[str, Any], section: str, where: str) -> tuple[Signal, ...]:
    signals = []
    for name, entry in data.get(section, {}).items():
        row = entry if isinstance(entry, Mapping) else {}
        asked = f"{section} '{name}' in {where}"
        text = _unit(row, asked)
        if not unit(text).coherent:
            raise PlantError(
                asked,
                f"its unit '{text}' is not a coherent SI unit.",
                f"States, inputs and outputs are in SI: write '{coherent(text)}'. Parameters may have any unit.",
            )
        lower, upper = _range(row, asked)
        signal = Signal(name=name, unit=text, text=_words(row, "text", asked), lower=lower, upper=upper)
        signals.append(replace(signal, **{use: _flag(row, use, asked) for use in _USES if use in row}))
    return tuple(signals)


def _flag(row: Mapping[str, Any], key: str, asked: str) -> bool:
    if not isinstance(row[key], bool):
        raise PlantError(asked, f"{key} = {_shown(row[key])}.", f"Write {key} = true or {key} = false.")
    return row[key]


def _parameter(name: str, entry: Any, where: str) -> Parameter:
    asked = f"parameter '{name}' in {where}"
    row = entry if isinstance(entry, Mapping) else {"value": entry}
    value = _number(row["value"], asked) if "value" in row else None
    lower, upper = _range(row, asked)
    if value is not None and ((lower is not None and value < lower) or (upper is not None and value > upper)):
        raise PlantError(asked, f"its value {value} lies outside its range [{lower}, {upper}].")
    text = _unit(row, asked)
    std = _number(row["std"], f"std of {asked}") if "std" in row else None
    if std is not None and not (std > 0 and value is not None):
        hint = "Give the standard deviation of the value, in its unit: std = 0.02."
        raise PlantError(asked, f"std = {std} {'is not positive' if value is not None else 'without a value'}.", hint)
    return Parameter(
        name=name,
        value=value,
        std=std,
        unit=text,
        text=_words(row, "text", asked),
        lower=lower,
        upper=upper,
        source=_words(row, "source", asked),
    )


def _correlations(data: Mapping[str, Any], where: str) -> tuple[tuple[str, str, sp.Expr], ...]:
    """Pairs of parameters with the correlation of their values, each pair once."""
    rows: dict[tuple[str, str], sp.Expr] = {}
    uncertain = [n for n, each in data.get("parameters", {}).items() if isinstance(each, Mapping) and "std" in each]
    for first, entries in data.get("correlation", {}).items():
        asked = f"[correlation] of '{first}' in {where}"
        if not isinstance(entries, Mapping):
            raise PlantError(asked, f"expected a table, found {_shown(entries)}.", "Write m2 = { Ra = 0.3 }, say.")
        for second, value in entries.items():
            for name in (first, second):
                if name not in uncertain:
                    known = ", ".join(uncertain) or "none"
                    raise PlantError(asked, f"'{name}' is no parameter with a std.", f"Parameters with one: {known}.")
            number = _number(value, f"{asked} with '{second}'")
            if first == second or not -1 <= number <= 1 or (first, second) in rows or (second, first) in rows:
                found = f"{_shown(value)} with '{second}': expected each pair once, a correlation from -1 to 1."
                raise PlantError(asked, found)
            rows[first, second] = number
    return tuple((first, second, number) for (first, second), number in rows.items())


def _correlation_rows(system: System) -> dict[str, dict[str, Any]]:
    uncertain = {p.name for p in system.parameters if p.std is not None}
    rows: dict[str, dict[str, Any]] = {}
    for first, second, number in system.correlations:
        if {first, second} <= uncertain:
            rows.setdefault(first, {})[second] = _text(number)
    return rows


def _range(row: Mapping[str, Any], asked: str) -> tuple[sp.Expr | None, sp.Expr | None]:
    if "range" not in row:
        return None, None
    pair = row["range"]
    if not isinstance(pair, list | tuple) or len(pair) != 2:
        raise PlantError(asked, f"range = {_shown(pair)} is not a pair.", "Write range = [lower, upper].")
    lower, upper = (_number(end, f"range of {asked}") for end in pair)
    if lower >= upper:
        raise PlantError(asked, f"its range [{lower}, {upper}] is empty.", "Write range = [lower, upper].")
    return lower, upper


def _words(row: Mapping[str, Any], key: str, asked: str) -> str:
    """The text under a key; empty where there is none."""
    text = row.get(key, "")
    if not isinstance(text, str):
        raise PlantError(asked, f"{key} = {_shown(text)} is not a text.", f'Write {key} = "…".')
    if any(unicodedata.category(sign) in ("Cc", "Cs") and sign not in "\n\t" for sign in text):
        raise PlantError(asked, f"{key} holds a control character: {_shown(text)}.", "Write printable characters only.")
    return text


def _unit(row: Mapping[str, Any], asked: str) -> str:
    """The text of a unit that is known."""
    text = _words(row, "unit", asked)
    try:
        unit(text)
    except UnitError as error:
        raise UnitError(f"{error.asked} of {asked}", error.found, error.hint) from None
    return text


def _shown(value: object) -> str:
    """A value of a file as a message shows it."""
    try:
        text = str(value) if isinstance(value, int | Decimal) else repr(value)
    except ValueError:  # Python prints no integer of thousands of digits
        return "an integer of thousands of digits"
    return text if len(text) <= 70 else f"{text[:69]}…"


def _number(value: Any, asked: str) -> sp.Expr:
    if isinstance(value, str):
        return parse_formula(value, {}, where=asked)
    try:
        return exact(value)
    except (ValueError, TypeError):
        raise PlantError(asked, f"{_shown(value)} is not a finite number.", "Give a number such as 0.1.") from None


def _at_point(value: Any, unit_text: str | None, asked: str) -> sp.Expr:
    return quantity(value, asked, unit=unit_text) if isinstance(value, str) else _number(value, asked)


def _equations(data: Mapping[str, Any], section: str, names: Mapping[str, sp.Expr], where: str) -> tuple[sp.Expr, ...]:
    found = []
    for name, entry in data.get(section, {}).items():
        asked = f"equation of {section[:-1]} '{name}' in {where}"
        text = entry.get("equation") if isinstance(entry, Mapping) else entry
        if text is None:
            raise PlantError(asked, "it is missing.", 'Add equation = "…".')
        found.append(_formula(text, names, asked))
    return tuple(found)


def _formula(text: Any, names: Mapping[str, sp.Expr], asked: str) -> sp.Expr:
    """A formula, or a number in its place."""
    return parse_formula(text, names, where=asked) if isinstance(text, str) else _number(text, asked)


def _definitions(rows: Mapping[str, Any], names: Mapping[str, sp.Expr], where: str) -> tuple[Definition, ...]:
    """Definitions in an order in which each uses only earlier ones."""
    symbols = {name: sp.Symbol(name, real=True) for name in rows}
    known = {**names, **symbols}
    formulas = {}
    units: dict[str, str] = {}
    for name, entry in rows.items():
        asked = f"definition '{name}' in {where}"
        text = entry
        if isinstance(entry, Mapping):
            text, units[name] = entry.get("zero"), _unit(entry, asked)
            if text is None:
                raise PlantError(asked, "a table without `zero`.", 'Write { zero = "what it makes zero", unit = "…" }.')
        formulas[name] = _formula(text, known, asked)
    # An implicit one is found after all others, which may use it: it waits for nobody and nobody for it.
    explicit = [name for name in formulas if name not in units]
    needs = {name: [s.name for s in formulas[name].free_symbols if s.name in explicit] for name in explicit}
    try:
        order = list(TopologicalSorter(needs).static_order())
    except CycleError as error:
        loop = " → ".join(reversed(error.args[1]))
        raise PlantError(f"definitions in {where}", f"they are cyclic: {loop}.", "Break the circle.") from None
    implicit = (Definition(name=name, expression=formulas[name], implicit=True, unit=units[name]) for name in units)
    return (*(Definition(name=name, expression=formulas[name]) for name in order), *implicit)


def _entry(item: Signal | Parameter) -> dict[str, Any]:
    bounded = item.lower is not None and item.upper is not None
    return _some(unit=item.unit, text=item.text) | (
        {"range": [_text(item.lower), _text(item.upper)]} if bounded else {}
    )


def _some(**fields: str) -> dict[str, str]:
    return {key: value for key, value in fields.items() if value}


def _text(value: sp.Expr | None) -> Any:
    """A number as an integer or a decimal where it is one, else as exact text."""
    if value is None:
        return ""
    if value.is_Integer:
        return int(value)
    return float(value) if value.is_Rational and exact(float(value)) == value else exact_text(value)
