"""Results as JSON: the same bytes for the same results, no dates, no places."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from enum import Enum
from typing import Any

import numpy as np
import sympy as sp

from ulna.base import UlnaError
from ulna.symbolic.formulas import excerpt

Plain = None | bool | int | float | str | list["Plain"] | dict[str, "Plain"]
"""What JSON can hold."""


def results_text(results: Mapping[str, Any]) -> str:
    """Return the results as JSON text, keys in the order given, a line break at the end.

    Expressions become text, exact numbers too (`"100/51"`), complex numbers `{"re": …, "im": …}`, arrays nested lists,
    dataclasses and verdicts mappings of their fields.

    Raises:
        UlnaError: a value without meaning in JSON (NaN, infinity, an object of unknown kind), named by its place.
    """
    return json.dumps(plain(results), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


LONGEST = 20_000
"""Parts of an expression above which only its length is told."""


def plain(value: object, *, place: str = "results", parts: int = LONGEST) -> Any:
    """Return the value as plain JSON data; see `results_text`. An expression of more parts only says so.

    Raises:
        UlnaError: as `results_text`.
    """
    if isinstance(value, Enum):
        return plain(value.value, place=place, parts=parts)
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, sp.MatrixBase):
        matrix: Any = value
        return [[excerpt(entry, parts) for entry in row] for row in matrix.tolist()]
    if isinstance(value, sp.Basic):
        return excerpt(value, parts)
    if isinstance(value, np.generic | np.ndarray):
        entries: np.ndarray = np.asarray(value)
        return plain(entries.tolist(), place=place)
    if isinstance(value, float):
        return _finite(value, place)
    if isinstance(value, complex):
        return {"re": _finite(value.real, place), "im": _finite(value.imag, place)}
    return _plain_parts(value, place, parts)


def _plain_parts(value: object, place: str, parts: int) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
        return plain(fields, place=place, parts=parts)
    if isinstance(value, Mapping):
        return {str(key): plain(entry, place=f"{place}.{key}", parts=parts) for key, entry in value.items()}
    if isinstance(value, AbstractSet):
        return sorted((plain(entry, place=place, parts=parts) for entry in value), key=str)
    if isinstance(value, Sequence):
        return [plain(entry, place=f"{place}[{index}]", parts=parts) for index, entry in enumerate(value)]
    raise UlnaError("results as JSON", f"{place} has the type {type(value).__name__}, which JSON cannot hold.")


def _finite(number: float, place: str) -> float:
    if not math.isfinite(number):
        raise UlnaError("results as JSON", f"{place} is {number}, which JSON cannot hold.")
    return number
