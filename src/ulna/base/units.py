"""Unit text at the border: its SI factor and its dimension (Pint does the work, imported on first use)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any

from ulna.base.errors import UnitError

# Pint evaluates powers while it reads: what may reach it is names, small integer powers, products and quotients.
_UNIT_TEXT = re.compile(r"[A-Za-zµΩ°%²³0-9_^*/().\s·-]*")
_NOT_MEANT = re.compile(r"//|\d{2,}|\d\s*\*\*|\^\s*\d+\s*\^")

Dimension = Mapping[str, Fraction]
"""Exponents of the SI base quantities, zero ones left out; an angle has dimension one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """A unit as written, with its exact factor to SI: `factor * (π/180) ** degrees`."""

    text: str
    factor: Fraction
    degrees: int
    dimension: Dimension

    @property
    def coherent(self) -> bool:
        """Whether a number in this unit already is the SI number."""
        return self.factor == 1 and self.degrees == 0


@cache
def _registry() -> Any:  # Pint's own types know floats only
    from pint import UnitRegistry

    registry: Any = UnitRegistry
    return registry(non_int_type=Fraction)


@cache
def unit(text: str) -> Unit:
    """Read a unit such as `"N*m/A"`, `"rad/s"` or `"mH"`; the empty text and `"1"` are dimensionless.

    Raises:
        UnitError: for an unknown unit or text that is no unit.
    """
    if text.strip() in ("", "1"):
        return Unit(text=text, factor=Fraction(1), degrees=0, dimension={})
    asked = f"unit '{text}'"
    if len(text) > 60 or not _UNIT_TEXT.fullmatch(text) or _NOT_MEANT.search(text):
        raise UnitError(asked, "this is not the text of a unit.", "Write products and quotients such as 'N*m/A'.")
    try:
        parsed: Any = _registry().Unit(text.replace("·", "*"))
        degrees = int(dict(parsed._units).get("degree", 0))
        without = parsed / _registry().Unit("degree") ** degrees if degrees else parsed
        quantity: Any = _registry().Quantity(Fraction(1), without).to_base_units()
    except Exception as error:  # noqa: BLE001  (Pint raises a wide family, all of them mean the same to the user)
        raise UnitError(
            asked, f"it cannot be read ({error}).", "SI units with prefixes are known: mH, N*m, rad/s."
        ) from None
    if {"degree_Celsius", "degree_Fahrenheit"} & set(parsed._units):
        raise UnitError(asked, "its zero is not that of SI.", "Write the temperature in K.")
    # The registry's base of mass is the gram's thousandfold already (kg); of angle the radian, dimension one.
    dimension = {
        name.strip("[]"): Fraction(power).limit_denominator(12)
        for name, power in dict(parsed.dimensionality).items()
        if power != 0
    }
    return Unit(text=text, factor=Fraction(quantity.magnitude), degrees=degrees, dimension=dimension)


def dimension_text(dimension: Dimension) -> str:
    """A dimension for people: `"length/time^2"`, `"1"` when dimensionless."""
    above = [_power(name, power) for name, power in sorted(dimension.items()) if power > 0]
    below = [_power(name, -power) for name, power in sorted(dimension.items()) if power < 0]
    head = "*".join(above) or "1"
    return head + "".join(f"/{part}" for part in below)


def _power(name: str, power: Fraction) -> str:
    return name if power == 1 else f"{name}^{power}"
