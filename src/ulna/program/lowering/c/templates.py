"""How C99 writes each operation."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from ulna.program.instructions import Operation
from ulna.program.precision import Precision

_FUNCTIONS = {
    **dict.fromkeys(("sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan"), 1),
    **dict.fromkeys(("sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "floor"), 1),
    "pow": 2,
    "atan2": 2,
    "fma": 3,
}

_SIGNS = {
    Operation.ADD: "{0} + {1}",
    Operation.SUB: "{0} - {1}",
    Operation.MUL: "{0} * {1}",
    Operation.DIV: "{0} / {1}",
    Operation.NEG: "-{0}",
    Operation.SIGN: "(({0} > ZERO) ? ONE : (({0} < ZERO) ? -ONE : {0}))",
    # A NaN is handed on, whichever operand it sits in; `fmin` would hide it.
    Operation.MIN: "((({0} < {1}) || ({0} != {0})) ? {0} : {1})",
    Operation.MAX: "((({0} > {1}) || ({0} != {0})) ? {0} : {1})",
    Operation.LESS: "(({0} < {1}) ? ONE : ZERO)",
    Operation.LESS_EQUAL: "(({0} <= {1}) ? ONE : ZERO)",
    Operation.EQUAL: "(({0} == {1}) ? ONE : ZERO)",
    Operation.AND: "((({0} != ZERO) && ({1} != ZERO)) ? ONE : ZERO)",
    Operation.OR: "((({0} != ZERO) || ({1} != ZERO)) ? ONE : ZERO)",
    Operation.NOT: "(({0} == ZERO) ? ONE : ZERO)",
    Operation.SELECT: "(({0} != ZERO) ? {1} : {2})",
    Operation.FLIP: "((odd({1}) != 0) ? -{0} : {0})",
}


def templates(precision: Precision) -> Mapping[Operation, str]:
    """How C99 writes each operation on numbers of a precision; functions are those of `math.h`."""
    suffix = "f" if precision is Precision.SINGLE else ""
    calls = {
        Operation(name): f"{name}{suffix}({', '.join(f'{{{k}}}' for k in range(count))})"
        for name, count in _FUNCTIONS.items()
    }
    calls[Operation.ABS] = f"fabs{suffix}({{0}})"
    signs = {
        operation: text.replace("ONE", f"1.0{suffix}").replace("ZERO", f"0.0{suffix}")
        for operation, text in _SIGNS.items()
    }
    return MappingProxyType({**signs, **calls})
