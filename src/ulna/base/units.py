"""Unit text at the border: its exact SI factor and dimension. A table holds what plants, motors and logs are in."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import accumulate

from ulna.base.errors import UnitError

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


_DERIVED = {
    "Hz": "1/s",
    "N": "kg*m/s^2",
    "Nm": "N*m",
    "Pa": "N/m^2",
    "J": "N*m",
    "W": "J/s",
    "Wh": "3600 J",
    "C": "A*s",
    "Ah": "3600 C",
    "V": "W/A",
    "F": "C/V",
    "ohm": "V/A",
    "Ω": "V/A",
    "S": "A/V",
    "Wb": "V*s",
    "T": "Wb/m^2",
    "H": "Wb/A",
    "l": "0.001 m^3",
    "bar": "100000 Pa",
    "rad": "1",
}
"""Units that take prefixes, as the base units do: a number, where it is not one, and the unit it counts."""

_WITHOUT_PREFIX = {
    "°": "deg",
    "degree": "deg",
    "degrees": "deg",
    "rev": "360 deg",
    "rpm": "6 deg/s",
    "min": "60 s",
    "h": "3600 s",
    "day": "86400 s",
    "%": "0.01 1",
    "t": "1000 kg",
    "in": "0.0254 m",
    "ft": "0.3048 m",
    "lb": "0.45359237 kg",
    "lbf": "4.4482216152605 N",
}
_BASE: dict[str, tuple[Fraction, int, str]] = {
    "1": (Fraction(1), 0, ""),
    "deg": (Fraction(1), 1, ""),
    "g": (Fraction(1, 1000), 0, "mass"),
    "m": (Fraction(1), 0, "length"),
    "s": (Fraction(1), 0, "time"),
    "A": (Fraction(1), 0, "current"),
    "K": (Fraction(1), 0, "temperature"),
    "mol": (Fraction(1), 0, "substance"),
    "cd": (Fraction(1), 0, "luminosity"),
}
"""Factor to SI, degrees and quantity."""

_WORDS = {
    "ampere": "A", "amp": "A", "farad": "F", "gram": "g", "henry": "H", "hertz": "Hz", "hour": "h", "hr": "h",
    "joule": "J", "kelvin": "K", "kilogram": "kg", "kilo": "kg", "liter": "l", "litre": "l", "meter": "m", "metre": "m",
    "minute": "min", "newton": "N", "ohm": "ohm", "pascal": "Pa", "radian": "rad", "sec": "s", "second": "s",
    "volt": "V", "watt": "W", "inch": "in", "foot": "ft", "feet": "ft", "pound": "lb", "percent": "%", "rads": "rad",
    "sek": "s",
}  # fmt: skip
"""What people write out, for hints only."""

_PREFIXES = {"n": -9, "µ": -6, "u": -6, "m": -3, "c": -2, "d": -1, "k": 3, "M": 6, "G": 9}
_TOKEN = re.compile(
    r"\s*(?:(?P<sign>[*·/()])|(?P<name>[A-Za-zµΩ°%]+|1)(?:(?:\^|\*\*)(?P<power>-?\d)|(?P<raised>[²³]))?)"
)
_WRONG = re.compile(r"^[*/)]|[*/(]$|[*/(][*/)]|\)\(|^$")


@cache
def unit(text: str) -> Unit:
    """Read a unit such as `"N*m/A"`, `"V/(rad/s)"`, `"kg m^2"` or `"mH"`; the empty text and `"1"` are dimensionless.

    Raises:
        UnitError: for an unknown unit or text that is no unit.
    """
    if not text.strip():
        return _made(text)
    tokens, place = [], 0
    while token := _TOKEN.match(text, place):
        tokens.append(token)
        place = token.end()
    shape = "".join(token["sign"] or "n" for token in tokens).replace("·", "*")
    depth = list(accumulate((sign == "(") - (sign == ")") for sign in shape))
    if text[place:].strip() or len(text) > 60 or _WRONG.search(shape) or depth[-1] or min(depth) < 0:
        raise UnitError(
            f"unit '{text[:60]}'",
            "this is not the text of a unit.",
            "Write products, quotients and whole powers: 'N*m/A', 'kg*m^2'.",
        )
    found, signs, sign = _made(text), [1], 1
    for token in tokens:
        match token["sign"]:
            case None:
                power = int(token["power"] or {"²": 2, "³": 3}.get(token["raised"], 1))
                found = _times(found, _named(token["name"], text), sign * power)
            case "(":
                signs.append(sign)
            case ")":
                signs.pop()
        sign = -signs[-1] if token["sign"] == "/" else signs[-1]
    return found


_COHERENT = (
    "m", "m/s", "m/s^2", "kg", "s", "Hz", "A", "K", "mol", "cd", "N", "N*m", "Pa", "W", "V", "ohm", "H", "F", "C", "Wb",
    "T", "S", "m^2", "m^3", "m^3/s", "kg*m^2", "mol/m^3",
)  # fmt: skip
_ANGULAR = ("rad", "rad/s", "rad/s^2")


def coherent(text: str) -> str:
    """The SI unit without a factor for what a unit measures: `Pa` for `bar`, `rad/s` for `rpm`, `m/s` for `km/h`."""
    asked = unit(text)
    for known in _ANGULAR if asked.degrees else _COHERENT:
        if unit(known).dimension == asked.dimension:
            return known
    return "1" if not asked.dimension else f"SI of {dimension_text(asked.dimension)}"


def _made(text: str, factor: Fraction = Fraction(1), degrees: int = 0, dimension: Dimension | None = None) -> Unit:
    return Unit(text=text, factor=factor, degrees=degrees, dimension=dimension or {})


def _times(first: Unit, second: Unit, power: int) -> Unit:
    """first · second^power, as the first is written."""
    dimension = dict(first.dimension)
    for quantity, exponent in second.dimension.items():
        dimension[quantity] = dimension.get(quantity, Fraction(0)) + power * exponent
    return _made(
        first.text,
        first.factor * second.factor**power,
        first.degrees + power * second.degrees,
        {quantity: exponent for quantity, exponent in dimension.items() if exponent},
    )


def _named(name: str, text: str) -> Unit:
    """A unit by its symbol, with or without a prefix."""
    if name in ("degC", "degF", "°C", "°F"):
        raise UnitError(f"unit '{text}'", "its zero is not absolute zero.", "Write the temperature in K.")
    found = _without_prefix(name)
    if found is None and name[0] in _PREFIXES and name[1:] not in (*_WITHOUT_PREFIX, "deg", "1"):
        found = _without_prefix(name[1:])
        found = found and _times(_made(name, Fraction(10) ** _PREFIXES[name[0]]), found, 1)
    if found is None:
        known = "SI symbols with prefixes are known (mH, N*m, rad/s), and deg, rpm, min, h, l, in, lb."
        meant = _meant(name)
        hint = f"Did you mean {' or '.join(repr(symbol) for symbol in meant)}? {known}" if meant else known
        raise UnitError(f"unit '{text}'", f"'{name}' is unknown.", hint)
    return found


def _meant(name: str) -> list[str]:
    """The symbols that somebody who wrote this may have meant: of a word in full, or in other letters of case."""
    folded = name.casefold()
    word = _WORDS.get(folded) or _WORDS.get(folded.removesuffix("s"))
    if word:
        return [word]
    symbols = [*_BASE, *_DERIVED, *_WITHOUT_PREFIX]
    prefixed = [prefix + symbol for prefix in _PREFIXES for symbol in [*_BASE, *_DERIVED]]
    return [symbol for symbol in symbols if symbol.casefold() == folded] or [
        symbol for symbol in prefixed if symbol.casefold() == folded
    ]


def _without_prefix(name: str) -> Unit | None:
    if name in _BASE:
        factor, degrees, quantity = _BASE[name]
        return _made(name, factor, degrees, {quantity: Fraction(1)} if quantity else {})
    meaning = _DERIVED.get(name) or _WITHOUT_PREFIX.get(name)
    if meaning is None:
        return None
    number, blank, counted = meaning.partition(" ")
    return _times(_made(name, Fraction(number)), unit(counted), 1) if blank else unit(meaning)


def dimension_text(dimension: Dimension) -> str:
    """A dimension for people: `"length/time^2"`, `"1"` when dimensionless."""
    above = [_power(name, power) for name, power in sorted(dimension.items()) if power > 0]
    below = [_power(name, -power) for name, power in sorted(dimension.items()) if power < 0]
    head = "*".join(above) or "1"
    return head + "".join(f"/{part}" for part in below)


def _power(name: str, power: Fraction) -> str:
    return name if power == 1 else f"{name}^{power}"
