"""Presets: arms and drives as data, a source for every number, and what is known of their limits."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from typing import Any

import sympy as sp

from ulna.base import PlantError
from ulna.plants.battery import Battery
from ulna.plants.thermal import Heating
from ulna.symbolic.formulas import exact
from ulna.system import Parameter

NEEDED = ("m1", "m2", "b", "N", "km", "kb", "Ra", "La", "Jm", "B", "eta", "g")
"""Parameters that every preset has: arm, load, gear, motor, gravity."""
MAY_VANISH = frozenset({"m1", "m2", "Jm", "B"})
"""Those of them that may be zero; all others must be positive."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What the hardware cannot exceed; None where nothing is known. The sampled loop applies them, no formula does.

    Attributes:
        voltage: largest |u| in V; current_peak, current_continuous: largest |i| in A, briefly and continuously.
        period: sampling period in s; encoder_counts: positions per turn of the joint.
    """

    voltage: sp.Expr | None = None
    current_peak: sp.Expr | None = None
    current_continuous: sp.Expr | None = None
    period: sp.Expr | None = None
    encoder_counts: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Preset:
    """An arm with its drive.

    Attributes:
        parameters: arm (m1, b), load (m2), gear (N, eta), motor (km, kb, Ra, La, Jm), friction (B), gravity (g).
        limits: of drive and loop; battery, heating: what feeds the motor and how it warms, or None.
        sources: where each number of limits, battery and heating comes from, by `section.name`.
    """

    name: str
    text: str
    source: str
    parameters: tuple[Parameter, ...]
    limits: Limits
    battery: Battery | None
    heating: Heating | None
    sources: Mapping[str, str]

    def __post_init__(self) -> None:
        known = {p.name for p in self.parameters}
        missing = [name for name in NEEDED if name not in known]
        if missing:
            raise PlantError(f"preset '{self.name}'", f"parameters are missing: {', '.join(missing)}.")
        for parameter in self.parameters:
            _check(self.name, parameter)

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name.

        Raises:
            PlantError: for an unknown name.
        """
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        known = ", ".join(p.name for p in self.parameters)
        raise PlantError(f"parameter '{name}' of preset '{self.name}'", "there is none.", f"Known: {known}.")

    def value(self, name: str) -> sp.Expr:
        """The exact SI value of a parameter."""
        value = self.parameter(name).si_value
        if value is None:
            raise PlantError(f"parameter '{name}' of preset '{self.name}'", "it has no value.", "Give it one.")
        return value


@cache
def preset(name: str) -> Preset:
    """The preset of that name.

    Raises:
        PlantError: for an unknown name; near ones are named.
    """
    data = _data()
    plain = name.replace("-", "_")
    if plain not in data:
        near = get_close_matches(plain, data, n=2)
        hint = f"Did you mean {' or '.join(near)}?" if near else f"Known: {', '.join(data)}."
        raise PlantError(f"preset '{name}'", "there is no such preset.", hint)
    return preset_from_mapping(plain, data[plain])


def presets() -> tuple[Preset, ...]:
    """All presets, in the order of the data file."""
    return tuple(preset(name) for name in _data())


def preset_from_mapping(name: str, data: Mapping[str, Any]) -> Preset:
    """The preset that a table describes: `[parameters]`, and optionally `[limits]`, `[loop]`, `[battery]`, `[heating]`.

    Raises:
        PlantError: for missing parameters, a number that is not positive, an unknown entry.
    """
    parameters = tuple(
        Parameter(
            name=key,
            value=_number(f"parameter '{key}' of preset '{name}'", entry),
            unit=entry.get("unit", ""),
            text=entry.get("text", ""),
            source=entry.get("source", ""),
        )
        for key, entry in data.get("parameters", {}).items()
    )
    sections = {
        section: {key: _number(f"{section} '{key}' of preset '{name}'", entry) for key, entry in table.items()}
        for section, table in data.items()
        if section in {"limits", "loop", "battery", "heating"}
    }
    limits = {**sections.get("limits", {}), **sections.get("loop", {})}
    if "encoder_counts" in limits:
        limits["encoder_counts"] = int(limits["encoder_counts"])
    try:
        return Preset(
            name=name,
            text=data.get("text", ""),
            source=data.get("source", ""),
            parameters=parameters,
            limits=Limits(**limits),
            battery=Battery(**sections["battery"]) if "battery" in sections else None,
            heating=Heating(**sections["heating"]) if "heating" in sections else None,
            sources={f"{s}.{key}": data[s][key].get("source", "") for s, table in sections.items() for key in table},
        )
    except TypeError as error:
        raise PlantError(f"preset '{name}'", f"an entry is unknown or missing: {error}.") from None


@cache
def _data() -> dict[str, Any]:
    text = (files("ulna.plants") / "hardware" / "presets.toml").read_text(encoding="utf-8")
    return tomllib.loads(text, parse_float=Decimal)


def _number(where: str, entry: Mapping[str, Any]) -> sp.Expr:
    try:
        return exact(entry["value"])
    except (KeyError, TypeError, ValueError):
        raise PlantError(where, f"{entry!r} needs a finite number under 'value'.") from None


def _check(name: str, parameter: Parameter) -> None:
    value = parameter.si_value
    where = f"parameter '{parameter.name}' of preset '{name}'"
    if value is None or parameter.name not in NEEDED:
        return
    if value < 0 or (value == 0 and parameter.name not in MAY_VANISH):
        raise PlantError(where, f"it is {float(value):g}.", "It must be positive.")
    if parameter.name == "eta" and value > 1:
        raise PlantError(where, f"it is {float(value):g}.", "An efficiency is at most 1.")
