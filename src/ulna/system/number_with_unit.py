"""Numbers with units as people write them: `4 kg`, `30deg`, `pi/2`."""

from __future__ import annotations

import math
import re

import sympy as sp

from ulna.base import SimulationError, UnitError, dimension_text
from ulna.base import unit as unit_of
from ulna.symbolic.formulas import parse_formula
from ulna.system.signal import to_si

_UNIT = r"(?P<unit>(?:[^\W\d]|[°%])[^\s()]*)"
_WITH_UNIT = (
    # Atomic, so that 4e-3 is never 4 of the unit e-3.
    re.compile(rf"\s*(?P<number>(?>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?))\s*{_UNIT}\s*"),
    re.compile(rf"(?P<number>.*[\w)])\s+{_UNIT}\s*"),
)


def quantity(text: str, asked: str, *, unit: str | None = None) -> sp.Expr:
    """The exact SI number in a text such as `4`, `pi/2`, `30deg` or `4 kg`; without a unit it is SI.

    Args:
        text: the number, with or without unit.
        asked: how an error names it.
        unit: of what it is a value of; None where that carries none.

    Raises:
        UlnaError: for a text that is no number, a unit that is unknown or of another dimension.
    """
    match = next((found for pattern in _WITH_UNIT if (found := pattern.fullmatch(text))), None)
    if match is None or match["unit"] == "pi":
        value = parse_formula(text, {}, where=asked)
    else:
        value = to_si(parse_formula(match["number"], {}, where=asked), _checked_unit(match["unit"], unit, asked))
    if not math.isfinite(float(value)):
        raise SimulationError(asked, f"its value is {float(value)}.", "Give a finite number.")
    return value


def _checked_unit(written: str, wanted: str | None, asked: str) -> str:
    try:
        found = unit_of(written)
    except UnitError as error:
        raise UnitError(asked, f"the {error.asked}: {error.found}", error.hint) from None
    if wanted is not None and found.dimension != unit_of(wanted).dimension:
        expected, is_there = (dimension_text(each) for each in (unit_of(wanted).dimension, found.dimension))
        raise UnitError(
            asked,
            f"'{written}' measures {is_there}, expected "
            f"{'a pure number or an angle' if expected == '1' else expected}.",
            f"Write it in {wanted}." if wanted else "Leave the unit out.",
        )
    return written
