"""Arithmetic as Python's operators, for libraries whose numbers carry them."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from ulna.program.instructions import Operation

OPERATORS: Mapping[Operation, Callable[..., Any]] = MappingProxyType(
    {
        Operation.ADD: operator.add,
        Operation.SUB: operator.sub,
        Operation.MUL: operator.mul,
        Operation.DIV: operator.truediv,
        Operation.NEG: operator.neg,
        Operation.POW: operator.pow,
    }
)
"""+, −, ×, ÷, sign and power."""
