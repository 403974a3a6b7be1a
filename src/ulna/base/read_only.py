"""Read-only mappings in values are pickled and copied as what they hold: Python itself refuses to."""

from __future__ import annotations

import copyreg
from collections.abc import Callable
from types import MappingProxyType
from typing import Any


def _read_only(parts: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    return MappingProxyType(parts)


def _reduced(mapping: MappingProxyType[Any, Any]) -> tuple[Callable[..., Any], tuple[dict[Any, Any]]]:
    return _read_only, (dict(mapping),)


copyreg.pickle(MappingProxyType, _reduced)
