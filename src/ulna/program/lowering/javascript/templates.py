"""How JavaScript writes each operation."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from ulna.program.instructions import Operation

_FUNCTIONS = (
    *("sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh"),
    *("atanh", "abs", "floor"),
)

TEMPLATES: Mapping[Operation, str] = MappingProxyType(
    {
        **{Operation(name): f"Math.{name}({{0}})" for name in _FUNCTIONS},
        Operation.POW: "Math.pow({0}, {1})",
        Operation.ATAN2: "Math.atan2({0}, {1})",
        Operation.ADD: "{0} + {1}",
        Operation.SUB: "{0} - {1}",
        Operation.MUL: "{0} * {1}",
        Operation.DIV: "{0} / {1}",
        Operation.NEG: "-{0}",
        Operation.SIGN: "({0} > 0 ? 1 : ({0} < 0 ? -1 : {0}))",
        Operation.MIN: "({0} < {1} || {0} !== {0} ? {0} : {1})",
        Operation.MAX: "({0} > {1} || {0} !== {0} ? {0} : {1})",
        Operation.LESS: "({0} < {1} ? 1 : 0)",
        Operation.LESS_EQUAL: "({0} <= {1} ? 1 : 0)",
        Operation.EQUAL: "({0} === {1} ? 1 : 0)",
        Operation.AND: "({0} !== 0 && {1} !== 0 ? 1 : 0)",
        Operation.OR: "({0} !== 0 || {1} !== 0 ? 1 : 0)",
        Operation.NOT: "({0} === 0 ? 1 : 0)",
        Operation.SELECT: "({0} !== 0 ? {1} : {2})",
    }
)
"""FMA and FLIP are missing: JavaScript cannot round a product and a sum together."""
