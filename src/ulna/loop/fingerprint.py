"""`fingerprint`: a hash of all that decides what a loop does; a folder that carries it can be told from another one."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import sympy as sp

from ulna.loop.loop import Loop
from ulna.system import system_to_mapping

LENGTH = 16
"""Hexadecimal digits that are shown."""


def fingerprint(loop: Loop) -> str:
    """The hash of plant, design and hardware; equal for loops that are written alike, digit for digit."""
    parts = loop.parts
    design = None if parts is None else system_to_mapping(parts.system)
    plant = system_to_mapping(loop.plant)
    plant.pop("picture", None)  # how it is drawn decides nothing
    whole = {"plant": plant, "design": design, "hardware": _plain(loop.hardware)}
    text = json.dumps(whole, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:LENGTH]


def _plain(value: Any) -> Any:
    """A value as what JSON has, with the names of its types."""
    if is_dataclass(value) and not isinstance(value, type):
        return {"kind": type(value).__name__, **{f.name: _plain(getattr(value, f.name)) for f in fields(value)}}
    if isinstance(value, Mapping):
        return {str(name): _plain(each) for name, each in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(each) for each in value]
    return sp.srepr(value) if isinstance(value, sp.Basic) else value if isinstance(value, str) else repr(value)
