"""Plants as TOML or JSON files: `read_system` and `write_system`."""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any

from ulna.base import PlantError, text_of_file, whole_file
from ulna.system.holder import SystemLike
from ulna.system.schema import system_from_mapping, system_to_mapping
from ulna.system.system import System

LARGEST_FILE = 20_000_000
"""Bytes of a plant file."""
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def read_system(path: str | os.PathLike[str]) -> System:
    """The plant in a TOML file (or JSON, by its ending `.json`).

    Raises:
        PlantError: for a missing file, a syntax error (its line is shown), an unknown key or a missing equation.
        FormulaError, UnitError: for what a formula or a unit gets wrong.

    Examples:
        >>> ulna.write_system(ulna.model("duffing"), "duffing.toml")
        >>> ulna.read_system("duffing.toml").state_symbols
        (x1, x2)
    """
    place = Path(path)
    try:
        text = text_of_file(place, most=LARGEST_FILE)
    except ValueError as error:
        raise PlantError(f"plant file '{place}'", f"{error}.", "Check the path.") from None
    data = _read(text, place)
    if not isinstance(data, dict):
        raise PlantError(f"plant file '{place}'", "expected a JSON object at the top.")
    return system_from_mapping(data, where=str(place))


def write_system(system: SystemLike, path: str | os.PathLike[str], *, comment: str = "") -> None:
    """Write a plant file that reads back to the same system; the file appears whole or not at all.

    Numbers are exact: decimals, and fractions only where no short decimal is. JSON has no place for a comment.

    Examples:
        >>> ulna.write_system(ulna.model("duffing"), "duffing.toml")
        >>> ulna.read_system("duffing.toml").name
        'Duffing oscillator with force'
    """
    place = Path(path)
    data = system_to_mapping(system)
    text = json.dumps(data, indent=2) + "\n" if place.suffix == ".json" else _commented(comment) + _toml_text(data)
    try:
        with whole_file(place) as file:
            file.write(text.encode())
    except OSError as error:
        raise PlantError(f"plant file '{place}'", f"it cannot be written ({error.strerror or error}).") from None


def _read(text: str, place: Path) -> Any:
    asked, kind = f"plant file '{place}'", "JSON" if place.suffix == ".json" else "TOML"
    try:
        return (json.loads if kind == "JSON" else tomllib.loads)(text, parse_float=Decimal)
    except RecursionError:
        raise PlantError(asked, "its tables or lists are nested too deeply.") from None
    except ValueError as error:  # what both raise for syntax, and Python for integers of thousands of digits
        number = re.search(r"at line (\d+)", str(error))
        lines = text.splitlines()[int(number[1]) - 1 :] if number else []
        shown = f" Line {number[1]}: {lines[0].strip()[:100]}" if number and lines else ""
        hint = (
            'Names with other letters than A to Z stand in quotes: "θ" = …' if shown and not lines[0].isascii() else ""
        )
        raise PlantError(asked, f"it is not valid {kind}: {str(error).partition(';')[0]}.{shown}", hint) from None


def _commented(text: str) -> str:
    return "".join(f"# {line}\n" for line in text.splitlines())


def _toml_text(data: Mapping[str, Any]) -> str:
    lines = []
    for key, value in data.items():
        if isinstance(value, Mapping):
            lines += ["", f"[{key}]"]
            lines += [_toml_line(name, entry) for name, entry in value.items()]
        else:
            lines.append(_toml_line(key, value))
    return "\n".join(lines) + "\n"


def _toml_line(key: str, value: Any) -> str:
    return f"{key if _BARE.fullmatch(key) else _toml_value(key)} = {_toml_value(value)}"


def _toml_value(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"{{ {', '.join(_toml_line(key, inner) for key, inner in value.items())} }}" if value else "{}"
    if isinstance(value, list):
        return "[" + ", ".join(_toml_value(inner) for inner in value) + "]"
    # JSON's string escapes are TOML's basic-string escapes.
    return str(value) if isinstance(value, int) else json.dumps(value, ensure_ascii=False)
