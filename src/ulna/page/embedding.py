"""Data inside a page: text that a user gave stays text, whatever it is."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

_HARMLESS = {ord(sign): f"\\u{ord(sign):04x}" for sign in "<>&\u2028\u2029"}


def json_text(value: Any) -> str:
    """JSON that may stand inside a `<script>` element: nothing in it ends the element or begins a comment.

    Numbers that JSON lacks become null.
    """
    return json.dumps(_finite(value), ensure_ascii=False, allow_nan=False, separators=(",", ":")).translate(_HARMLESS)


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(name): _finite(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return value
