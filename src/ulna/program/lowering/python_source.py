"""A `Kernel` as plain Python source: one line an operation, `math` only, ready for CPython and for Numba."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from ulna.program.instructions import Instruction, Operation
from ulna.program.kernel import Kernel
from ulna.program.lowering.fused import flipped_scalar, fused_scalar
from ulna.program.lowering.statements import Language, checked_function_name

INDENT = "    "

TEMPLATES: Mapping[Operation, str] = MappingProxyType(
    {
        Operation.ADD: "{0} + {1}",
        Operation.SUB: "{0} - {1}",
        Operation.MUL: "{0} * {1}",
        Operation.DIV: "{0} / {1}",
        Operation.NEG: "-{0}",
        Operation.POW: "math.pow({0}, {1})",
        Operation.SQRT: "math.sqrt({0})",
        Operation.EXP: "math.exp({0})",
        Operation.LOG: "math.log({0})",
        Operation.SIN: "math.sin({0})",
        Operation.COS: "math.cos({0})",
        Operation.TAN: "math.tan({0})",
        Operation.ASIN: "math.asin({0})",
        Operation.ACOS: "math.acos({0})",
        Operation.ATAN: "math.atan({0})",
        Operation.ATAN2: "math.atan2({0}, {1})",
        Operation.SINH: "math.sinh({0})",
        Operation.COSH: "math.cosh({0})",
        Operation.TANH: "math.tanh({0})",
        Operation.ASINH: "math.asinh({0})",
        Operation.ACOSH: "math.acosh({0})",
        Operation.ATANH: "math.atanh({0})",
        Operation.ABS: "abs({0})",
        Operation.SIGN: "(1.0 if {0} > 0.0 else (-1.0 if {0} < 0.0 else {0}))",
        # From 2**52 on every double is whole; `//` keeps NaN and is the same in CPython and Numba.
        Operation.FLOOR: "({0} // 1.0 if abs({0}) < 4503599627370496.0 else {0})",
        Operation.MIN: "({0} if {0} < {1} or {0} != {0} else {1})",
        Operation.MAX: "({0} if {0} > {1} or {0} != {0} else {1})",
        Operation.LESS: "(1.0 if {0} < {1} else 0.0)",
        Operation.LESS_EQUAL: "(1.0 if {0} <= {1} else 0.0)",
        Operation.EQUAL: "(1.0 if {0} == {1} else 0.0)",
        Operation.AND: "(1.0 if {0} != 0.0 and {1} != 0.0 else 0.0)",
        Operation.OR: "(1.0 if {0} != 0.0 or {1} != 0.0 else 0.0)",
        Operation.NOT: "(1.0 if {0} == 0.0 else 0.0)",
        Operation.SELECT: "({1} if {0} != 0.0 else {2})",
        Operation.FMA: "fused({0}, {1}, {2})",
        Operation.FLIP: "flipped({0}, {1})",
    }
)
"""How Python writes each operation."""

# Operations of `math` and `/` that raise where IEEE arithmetic has an infinity or a NaN.
_PARTIAL: Mapping[Operation, tuple[Callable[..., float], Callable[..., Any]]] = {
    Operation.DIV: (lambda a, b: a / b, np.divide),
    Operation.POW: (math.pow, np.power),
    Operation.SQRT: (math.sqrt, np.sqrt),
    Operation.EXP: (math.exp, np.exp),
    Operation.LOG: (math.log, np.log),
    Operation.SIN: (math.sin, np.sin),
    Operation.COS: (math.cos, np.cos),
    Operation.TAN: (math.tan, np.tan),
    Operation.ASIN: (math.asin, np.arcsin),
    Operation.ACOS: (math.acos, np.arccos),
    Operation.SINH: (math.sinh, np.sinh),
    Operation.COSH: (math.cosh, np.cosh),
    Operation.ACOSH: (math.acosh, np.arccosh),
    Operation.ATANH: (math.atanh, np.arctanh),
}

_NAMES: Mapping[str, Any] = {"math": math, "fused": fused_scalar, "flipped": flipped_scalar}


def to_python_source(kernel: Kernel, *, function_name: str | None = None) -> str:
    """The source of `def name(inputs...): ... return (outputs...)`, every number a float.

    Compiled by Numba it needs `error_model="numpy"` and no `fastmath`; executed by CPython it raises
    `ZeroDivisionError`, `ValueError` or `OverflowError` where IEEE arithmetic has an infinity or a NaN
    (`to_python` has not). The source needs `import math`, with FMA and FLIP also functions `fused` and `flipped`.
    """
    return written_out(kernel, checked_function_name(function_name) if function_name else "kernel", TEMPLATES)


def to_python(kernel: Kernel) -> Callable[..., tuple[float, ...]]:
    """A Python function of the scalar inputs, in order, that returns the outputs as a tuple of floats.

    Infinities and NaN come out where IEEE arithmetic has them. Bit-equal to the source of `to_python_source`.
    """
    fast = executed(to_python_source(kernel), dict(_NAMES))
    total: list[Callable[..., tuple[float, ...]]] = []

    def evaluate(*values: float) -> tuple[float, ...]:
        try:
            return fast(*values)
        except (ZeroDivisionError, ValueError, OverflowError):
            if not total:
                total.append(_total(kernel))
            return total[0](*values)

    return evaluate


def written_out(kernel: Kernel, function_name: str, templates: Mapping[Operation, str]) -> str:
    """One assignment an instruction in the order of the list; constants are written where they are used."""
    pairs, results = replace(PYTHON, templates=templates).statements(kernel, kernel.identifiers)
    lines = [f"def {function_name}({', '.join(kernel.identifiers)}):"]
    lines += [f"{INDENT}{name} = {text}" for name, text in pairs]
    values = "".join(f"{each}, " for each in results)
    return "\n".join([*lines, f"{INDENT}return ({values.rstrip()})"]) + "\n"


def literal(instruction: Instruction) -> str:
    """A constant such that reading it back gives the same double."""
    value = instruction.value
    if math.isnan(value):
        return "math.nan"
    if math.isinf(value):
        return "math.inf" if value > 0 else "(-math.inf)"
    return repr(value) if math.copysign(1.0, value) > 0 else f"({value!r})"


PYTHON = Language(name="Python", templates=TEMPLATES, literal=literal, choice="({1} if {0} else {2})")
"""For CPython and for Numba; see `to_python_source`."""


def executed(source: str, namespace: dict[str, Any], name: str = "kernel") -> Callable[..., tuple[Any, ...]]:
    """The function that generated source defines. The source comes from a `Kernel`, never from a user's text."""
    exec(compile(source, f"<ulna kernel {name}>", "exec"), namespace)  # noqa: S102 - see the docstring
    return namespace[name]


def _total(kernel: Kernel) -> Callable[..., tuple[float, ...]]:
    namespace = dict(_NAMES)
    templates = dict(TEMPLATES)
    for operation, (partial, ieee) in _PARTIAL.items():
        name = f"total_{operation.value}"
        namespace[name] = _completed(partial, ieee)
        templates[operation] = (
            f"{name}({{0}}, {{1}})" if operation in (Operation.DIV, Operation.POW) else f"{name}({{0}})"
        )
    return executed(written_out(kernel, "kernel", templates), namespace)


def _completed(partial: Callable[..., float], ieee: Callable[..., Any]) -> Callable[..., float]:
    def complete(*values: float) -> float:
        try:
            return partial(*values)
        except (ZeroDivisionError, ValueError, OverflowError):
            with np.errstate(all="ignore"):
                return float(ieee(*(np.float64(value) for value in values)))

    return complete
