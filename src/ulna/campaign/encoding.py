"""Settings of a campaign as JSON text and back. What is stored is what is run, here and on every worker.

Values are frozen dataclasses of ulna, numbers, texts, formulas and arrays. Nothing in the text is ever executed: it
names classes from a fixed table, and formulas go through the formula parser.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np
import sympy as sp

from ulna.base import UlnaError
from ulna.campaign.errors import CampaignError
from ulna.loop import Loop
from ulna.program import Precision
from ulna.symbolic.exact.zero import SampledZero, is_zero
from ulna.symbolic.formulas.parse import parse_formula
from ulna.symbolic.formulas.text import formula

TYPE = "type"

# The last ones import this module: they are looked up when they are needed.
_HOMES = (
    "ulna.sim",
    "ulna.loop",
    "ulna.system",
    "ulna.program.arithmetic",
    "ulna.campaign.probability",
    "ulna.campaign.grid",
    "ulna.campaign.sampling",
    "ulna.campaign.measures",
    "ulna.campaign.experiment",
)


def to_text(value: Any) -> str:
    """The value as JSON text; equal settings give equal text.

    Raises:
        CampaignError: something that cannot be stored.
    """
    return json.dumps(_encoded(value), ensure_ascii=False, allow_nan=False, separators=(",", ":"))


def from_text(text: str) -> Any:
    """The value of a text that `to_text` wrote.

    Raises:
        CampaignError: for any other text.
    """
    try:
        return _decoded(json.loads(text))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise CampaignError("settings of a campaign", f"they cannot be read ({error}).") from None
    except UlnaError as error:
        raise CampaignError("settings of a campaign", f"they cannot be read ({error}).") from None


@cache
def known_types() -> Mapping[str, type]:
    """The classes that may stand in settings, by name."""
    return {
        name: value
        for home in _HOMES
        for name, value in vars(import_module(home)).items()
        if isinstance(value, type) and is_dataclass(value) and value.__module__.startswith("ulna.")
    }


def _encoded(value: Any) -> Any:
    match value:
        case Precision():
            return {TYPE: "Precision", "value": value.value}
        case None | bool() | str():
            return value
        case float():
            # JSON knows no infinity.
            return float(value) if math.isfinite(value) else {TYPE: "float", "value": repr(float(value))}
        case int():
            return int(value)
        case np.ndarray():
            return {TYPE: "array", "values": [_encoded(v) for v in value.tolist()]}
        case np.generic():
            return _encoded(value.item())
        case sp.MatrixBase():
            return {TYPE: "matrix", "rows": [[_encoded(e) for e in value.row(k)] for k in range(value.rows)]}
        case sp.Expr():
            symbols = sorted(s.name for s in value.free_symbols if isinstance(s, sp.Symbol))
            written = {TYPE: "formula", "text": formula(value), "symbols": symbols}
            _check_meaning(value, written)
            return written
    return _composed(value)


def _composed(value: Any) -> Any:
    match value:
        case Mapping():
            return {TYPE: "map", "entries": [[str(k), _encoded(v)] for k, v in value.items()]}
        case list() | tuple():
            return [_encoded(v) for v in value]
        case Loop():
            # A law or compensator is stored as the systems that it is made of.
            parts = value.parts
            controller = parts.system if parts is not None and parts.law is parts.system else parts
            shown = {"plant": value.plant, "controller": controller, "hardware": value.hardware}
            return {TYPE: "Loop", **{name: _encoded(each) for name, each in shown.items()}}
    name = type(value).__name__
    if known_types().get(name) is not type(value):
        raise CampaignError(
            f"a {name} in the settings of a campaign",
            "it cannot be stored.",
            "Use ulna's own plans, distributions, inputs, hardware and engines.",
        )
    return {TYPE: name, **{f.name: _encoded(getattr(value, f.name)) for f in fields(value) if f.init}}


def _check_meaning(value: sp.Expr, written: dict[str, Any]) -> None:
    """The parser may order a formula otherwise, never change it: a loop with another formula would be run."""
    try:
        read = _decoded(written)
    except UlnaError as error:
        raise CampaignError(f"the formula {written['text']}", f"it cannot be stored ({error.found})") from None
    if read != value and is_zero(read - value, test=SampledZero(seconds=0.0)).fails:
        raise CampaignError(f"the formula {written['text']}", "it does not read back as it was written.")


def _decoded(data: Any) -> Any:
    if isinstance(data, list):
        return tuple(_decoded(entry) for entry in data)
    if not isinstance(data, dict):
        return data
    match data[TYPE]:
        case "float":
            return float(data["value"])
        case "array":
            return np.array([_decoded(v) for v in data["values"]], dtype=float)
        case "matrix":
            return sp.ImmutableDenseMatrix([[_decoded(e) for e in row] for row in data["rows"]])
        case "formula":
            symbols = {name: sp.Symbol(name, real=True) for name in data["symbols"]}
            return parse_formula(data["text"], symbols, where="settings of a campaign")
        case "Precision":
            return Precision(data["value"])
        case "map":
            return {key: _decoded(value) for key, value in data["entries"]}
    kind = known_types()[data[TYPE]]
    return kind(**{key: _decoded(value) for key, value in data.items() if key != TYPE})
