"""The catalogue: plants kept as data files, by name."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias

from ulna.base import PlantError
from ulna.system import System, SystemLike, as_system, read_system, system_from_mapping

_FOLDERS = ("data", "textbook")


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """A plant of the catalogue.

    Attributes:
        name: its name in `model()` and on the command line.
        text: what it is; teaches: what it shows; source: where it comes from.
        states, inputs, outputs: how many it has.
        answers: known answers by analysis key, as formula text (empty for most of the practical models).

    Examples:
        >>> next(each.teaches for each in ulna.models() if each.name == "duffing")
        'Both forms at once: law and observer without any approximation.'
    """

    name: str
    text: str
    teaches: str
    source: str
    states: int
    inputs: int
    outputs: int
    answers: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))


@cache
def _files() -> dict[str, Traversable]:
    folders = [files("ulna.plants") / folder for folder in _FOLDERS]
    entries = [entry for place in folders if place.is_dir() for entry in place.iterdir()]
    return {e.name.removesuffix(".toml"): e for e in sorted(entries, key=lambda e: e.name) if e.name.endswith(".toml")}


def _data(name: str) -> dict[str, Any]:
    return tomllib.loads(_files()[name].read_text(encoding="utf-8"), parse_float=Decimal)


def models() -> tuple[Model, ...]:
    """Every plant of the catalogue, in order of name.

    Examples:
        >>> "duffing" in [plant.name for plant in ulna.models()]
        True
    """
    rows = []
    for name in _files():
        data = _data(name)
        entry = data.get("catalogue", {})
        text, source = data.get("text", data.get("name", "")), data.get("source", "")
        answers = MappingProxyType(dict(entry.get("answers", {})))
        sizes = {kind: len(data.get(kind, {})) for kind in ("states", "inputs", "outputs")}
        teaches = entry.get("teaches", "")
        rows.append(Model(name=name, text=text, teaches=teaches, source=source, answers=answers, **sizes))
    return tuple(rows)


def plant_text(name: str) -> str:
    """The plant file of that name as it is written, without what only the catalogue needs.

    Raises:
        PlantError: for an unknown name; near ones are named.
    """
    text = _files()[_known(name)].read_text(encoding="utf-8")
    return text.partition("\n[catalogue]")[0].rstrip() + "\n"


PlantLike: TypeAlias = SystemLike | str | os.PathLike[str]
"""What every verb accepts where a plant is meant."""


def as_plant(given: PlantLike) -> System:
    """The plant that is meant: by its name in the catalogue, by its file, or as in `as_system`.

    A text that ends in .toml or .json, or is the path of a file, is a file; any other is a name.

    Raises:
        PlantError: for an unknown name, a file that cannot be read or has no states, or a value of another kind.
    """
    if not isinstance(given, str | os.PathLike):
        return as_system(given)
    path = Path(given)
    if isinstance(given, os.PathLike) or path.suffix in (".toml", ".json") or path.is_file():
        found = read_system(path)
        if not found.states:
            hint = "Give [states] at least one entry; a static law may be the controller of a loop."
            raise PlantError(f"plant file '{path}'", "it has no states, so nothing in it moves.", hint)
        return found
    return model(given)


@cache
def model(name: str) -> System:
    """The plant of that name.

    Raises:
        PlantError: for an unknown name; near ones are named.

    Examples:
        >>> ulna.model("duffing").rates
        (x2, -a*x1 - b*x1**3 - d*x2 + u)
    """
    plain = _known(name)
    return system_from_mapping(_data(plain), where=plain)


def _known(name: str) -> str:
    plain = name.replace("-", "_")
    if plain not in _files():
        near = get_close_matches(plain, _files(), n=3)
        hint = f"Did you mean {' or '.join(near)}?" if near else "`ulna models` lists them."
        raise PlantError(f"plant '{name}'", "no plant of this name is in the catalogue.", hint)
    return plain
