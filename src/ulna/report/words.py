"""Values as people read them in a line of text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import sympy as sp

from ulna.report.results import plain
from ulna.symbolic.formulas import decimal_text, excerpt, is_longer

_PARTS = 2_000
"""Parts of an expression that is written out at all."""


def value_text(value: Any, *, exact: bool = False) -> str:
    """A value as text: vectors and one-row matrices without brackets, mappings as equations, numbers as decimals.

    Args:
        value: numbers, expressions, matrices, lists and mappings of them.
        exact: fractions in place of decimals of six digits.
    """
    return _joined(_texts(value, exact))


def verbatim(text: str) -> str:
    """The text for a document, where dollar signs stand for themselves and begin no formula."""
    return text.replace("$", r"\$")


def _texts(value: Any, exact: bool) -> Any:
    if isinstance(value, sp.MatrixBase):
        return [[_texts(entry, exact) for entry in row] for row in value.tolist()]
    if isinstance(value, sp.Basic):
        return excerpt(value, _PARTS) if exact or is_longer(value, _PARTS) else decimal_text(value)
    if isinstance(value, bool | int | str) or value is None:
        return value
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, complex):
        return f"{value.real:.6g}{value.imag:+.6g}j"
    if isinstance(value, Mapping):
        return {str(key): _texts(part, exact) for key, part in value.items()}
    if isinstance(value, Sequence):
        return [_texts(part, exact) for part in value]
    return plain(value, parts=_PARTS)


def _joined(shape: Any) -> str:
    if shape is None:
        return "–"
    if isinstance(shape, dict):
        return "; ".join(f"{key} = {_joined(part)}" for key, part in shape.items() if part not in ({}, []))
    if isinstance(shape, list):
        parts = [part[0] if isinstance(part, list) and len(part) == 1 else part for part in shape]
        return ", ".join(f"({_joined(part)})" if isinstance(part, list | dict) else _word(part) for part in parts)
    return _word(shape)


def _word(value: Any) -> str:
    return {"True": "yes", "False": "no", "None": "–"}.get(str(value), str(value))
