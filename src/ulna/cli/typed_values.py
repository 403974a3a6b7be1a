"""What a user types as values: numbers with units, lists, names with values, formulas of time. None of it is run."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING

from ulna.base import FormulaError, SimulationError, UlnaError

if TYPE_CHECKING:
    import sympy as sp

    from ulna.system import Parameter, Signal, System


def typed_list(text: str) -> list[str]:
    """The parts between commas that stand in no parentheses, without surrounding spaces."""
    parts, depth = [""], 0
    for sign in text:
        depth += (sign == "(") - (sign == ")")
        if sign == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += sign
    return [part.strip() for part in parts]


def pole_list(text: str) -> list[str]:
    """The poles in a comma-separated text.

    Raises:
        UlnaError: for an empty entry.
    """
    poles = typed_list(text)
    if not all(poles):
        raise UlnaError(f"poles '{text}'", "an entry is empty.", "Separate poles by commas: -9,-10,-11.")
    return poles


def number_list(text: str, asked: str) -> list[float]:
    """The numbers in a comma-separated text, formulas such as pi/2 included.

    Raises:
        UlnaError: for an entry that is not a number.
    """
    return [number(part, f"{asked} '{text}'") for part in typed_list(text)]


def three_numbers(text: str, asked: str) -> tuple[float, float, float]:
    """The numbers in `low:high:count`.

    Raises:
        UlnaError: for another count of them.
    """
    parts = text.split(":")
    if len(parts) != 3:
        raise UlnaError(asked, "expected lower end, upper end and number of points.", "Write 'y=0.002:0.02:10'.")
    low, high, count = (number(part, asked) for part in parts)
    return low, high, count


def number(text: str, asked: str) -> float:
    """The number that a formula without names stands for.

    Raises:
        UlnaError: for anything else.
    """
    from ulna.symbolic.formulas import parse_formula

    return float(parse_formula(text, {}, where=asked))


def quantity(text: str, asked: str, *, unit: str | None = None) -> sp.Expr:
    """The exact SI number in a text such as `4`, `pi/2`, `30deg` or `4 kg`; see `ulna.system.quantity`."""
    from ulna.system import quantity as read

    return read(text, asked, unit=unit)


def unit_in(system: System, item: Signal | Parameter) -> str | None:
    """The unit a value of this item has to fit; None in a plant that carries no units."""
    carries = any(each.unit for each in (*system.states, *system.inputs, *system.outputs, *system.parameters))
    return item.unit if carries else None


def formula_of_time(text: str, asked: str, *, unit: str | None = None) -> float | sp.Expr:
    """An SI number, or a formula in `ulna.sim.TIME` where the text has the name t.

    Raises:
        UlnaError: for other names, a text that is not a formula.
    """
    from ulna.sim import TIME
    from ulna.symbolic.formulas import parse_formula

    try:
        found = parse_formula(text, {TIME.name: TIME}, where=asked)
    except FormulaError:
        # Perhaps a number with a unit; of the two messages the one about the formula says more where t is in it.
        if re.search(r"\bt\b", text):
            raise
        return float(quantity(text, asked, unit=unit))
    return found if found.free_symbols else float(found)


def named_values(entries: Iterable[str], option: str) -> Iterator[tuple[str, str, str]]:
    """(name, value, what an error says was asked) of entries like `m2=4` or `theta=30deg, omega=0`.

    Raises:
        UlnaError: an entry without `=`, a name that is given twice.
    """
    seen: set[str] = set()
    for entry in entries:
        for part in typed_list(entry):
            name, equals, value = (piece.strip() for piece in part.partition("="))
            asked = f"{option} '{part}'"
            if not (name and equals and value):
                raise SimulationError(asked, "expected a name and its value.", f'Write {option} "name=value".')
            if name in seen:
                raise SimulationError(asked, f"{name} is given twice.", "Give it once.")
            seen.add(name)
            yield name, value, asked


def known_name(name: str, known: Sequence[str], asked: str, what: str) -> str:
    """The name, if it is known.

    Raises:
        SimulationError: an unknown one; the nearest are named.
    """
    if name in known:
        return name
    near = get_close_matches(name, known, n=3)
    everything = f"Known: {', '.join(known) or 'none'}."
    raise SimulationError(
        asked,
        f"there is no {what} '{name}'.",
        f"Did you mean {' or '.join(near)}? {everything}" if near else everything,
    )
