"""Plants as TOML or JSON files: `read_system` and `write_system`."""

from __future__ import annotations

import json
import os
import tempfile
import tomllib
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any

from ulna.base import PlantError
from ulna.system.holder import SystemLike
from ulna.system.schema import system_from_mapping, system_to_mapping
from ulna.system.system import System


def read_system(path: str | os.PathLike[str]) -> System:
    """The plant in a TOML file (or JSON, by its ending `.json`).

    Raises:
        PlantError: for a missing file, a syntax error (its line is shown), an unknown key or a missing equation.
        FormulaError, UnitError: for what a formula or a unit gets wrong.
    """
    place = Path(path)
    try:
        text = place.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else "not a UTF-8 text"
        raise PlantError(f"plant file '{place}'", f"it cannot be read ({reason}).", "Check the path.") from None
    if place.suffix == ".json":
        return system_from_mapping(_json(text, place), where=str(place))
    return system_from_mapping(_toml(text, place), where=str(place))


def write_system(system: SystemLike, path: str | os.PathLike[str]) -> None:
    """Write a plant file that reads back to the same system; the file appears whole or not at all."""
    place = Path(path)
    data = system_to_mapping(system)
    text = json.dumps(data, indent=2) + "\n" if place.suffix == ".json" else _toml_text(data)
    try:
        handle, temporary = tempfile.mkstemp(dir=place.parent, prefix=f".{place.name}.")
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.write(text)
        Path(temporary).replace(place)
    except OSError as error:
        raise PlantError(f"plant file '{place}'", f"it cannot be written ({error.strerror}).") from None


def _toml(text: str, place: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(text, parse_float=Decimal)
    except tomllib.TOMLDecodeError as error:
        shown = ""
        for word in str(error).replace(")", " ").replace(",", " ").split("line ")[1:2]:
            number = int(word.split()[0])
            lines = text.splitlines()
            shown = f" Line {number}: {lines[number - 1].strip()}" if 0 < number <= len(lines) else ""
        raise PlantError(f"plant file '{place}'", f"it is not valid TOML: {error}.{shown}") from None


def _json(text: str, place: Path) -> dict[str, Any]:
    try:
        data = json.loads(text, parse_float=Decimal)
    except json.JSONDecodeError as error:
        raise PlantError(f"plant file '{place}'", f"it is not valid JSON: {error}.") from None
    if not isinstance(data, dict):
        raise PlantError(f"plant file '{place}'", "a JSON object is due at the top.")
    return data


def _toml_text(data: Mapping[str, Any]) -> str:
    lines = []
    for key, value in data.items():
        if isinstance(value, Mapping):
            lines += ["", f"[{key}]"]
            lines += [f"{name} = {_toml_value(entry)}" for name, entry in value.items()]
        else:
            lines.append(f"{key} = {_toml_value(value)}")
    return "\n".join(lines) + "\n"


def _toml_value(value: Any) -> str:
    if isinstance(value, Mapping):
        return (
            "{ " + ", ".join(f"{key} = {_toml_value(inner)}" for key, inner in value.items()) + " }" if value else "{}"
        )
    if isinstance(value, list):
        return "[" + ", ".join(_toml_value(inner) for inner in value) + "]"
    # JSON's string escapes are TOML's basic-string escapes.
    return str(value) if isinstance(value, int) else json.dumps(value, ensure_ascii=False)
