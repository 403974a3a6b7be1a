"""Settings of a campaign as JSON text and back. What is stored is what is run, here and on every worker.

Values are frozen dataclasses of ulna, numbers, texts, formulas and arrays. Nothing in the text is ever executed: it
names classes from a fixed table, and formulas go through the formula parser.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from functools import cache, lru_cache
from typing import Any

import numpy as np
import sympy as sp

import ulna.campaign.plans
import ulna.loop
import ulna.sim
import ulna.system
from ulna.base import UlnaError
from ulna.campaign.errors import CampaignError
from ulna.campaign.runs.experiment import Experiment
from ulna.campaign.runs.measures import Measures, Window
from ulna.loop import Loop
from ulna.program import Fused, Plain, Precision
from ulna.symbolic.exact import SampledZero, is_zero
from ulna.symbolic.formulas import formula, parse_formula

TYPE = "type"


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
    except (UlnaError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError) as error:
        raise CampaignError("settings of a campaign", f"they cannot be read ({error}).") from None


@lru_cache(maxsize=4)
def experiment_of(settings: str) -> Experiment:
    """The experiment of a text of settings, read once per process.

    Compiled loops are found by the identity of the loop, so that equal ones of several campaigns must be one object.

    Raises:
        CampaignError: for a text of anything else.
    """
    found = from_text(settings)
    if not isinstance(found, Experiment):
        raise CampaignError("settings of a campaign", "they describe something else.")
    return replace(found, loop=_shared(json.dumps(json.loads(settings)["loop"])))


@lru_cache(maxsize=16)
def _shared(text: str) -> Any:
    return from_text(text)


@cache
def _known_types() -> Mapping[str, type]:
    """The classes that may stand in settings, by name."""
    fronts = (ulna.loop, ulna.sim, ulna.system, ulna.campaign.plans)
    offered = [value for front in fronts for value in vars(front).values() if isinstance(value, type)]
    return {
        each.__name__: each for each in (*offered, Fused, Plain, Experiment, Measures, Window) if is_dataclass(each)
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
            shown = {"plant": value.plant, "controller": value.parts, "hardware": value.hardware}
            return {TYPE: "Loop", **{name: _encoded(each) for name, each in shown.items()}}
    name = type(value).__name__
    if _known_types().get(name) is not type(value):
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
    kind = _known_types()[data[TYPE]]
    return kind(**{key: _decoded(value) for key, value in data.items() if key != TYPE})
