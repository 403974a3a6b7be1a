"""A `Kernel` as heyoka expressions: what the Taylor integrator compiles."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import heyoka as hy

from ulna.base import SimulationError
from ulna.program.instructions import Operation
from ulna.program.kernel import Kernel
from ulna.program.lowering.operators import OPERATORS

# Its warnings and errors go to standard output, amid what a program prints; outcomes tell of them.
hy.set_logger_level_critical()


def _minimum(a: Any, b: Any) -> Any:
    # Neither a < b nor b <= a: one is NaN, and so is their sum. A limiter must not hide it.
    return hy.select(hy.lt(a, b), a, hy.select(hy.lte(b, a), b, a + b))


def _maximum(a: Any, b: Any) -> Any:
    return hy.select(hy.gt(a, b), a, hy.select(hy.gte(b, a), b, a + b))


def _sign(a: Any) -> Any:
    return hy.select(hy.gt(a, 0.0), 1.0, hy.select(hy.lt(a, 0.0), -1.0, a))


_FUNCTIONS: Mapping[Operation, Callable[..., Any]] = {
    **OPERATORS,
    Operation.SQRT: hy.sqrt,
    Operation.EXP: hy.exp,
    Operation.LOG: hy.log,
    Operation.SIN: hy.sin,
    Operation.COS: hy.cos,
    Operation.TAN: hy.tan,
    Operation.ASIN: hy.asin,
    Operation.ACOS: hy.acos,
    Operation.ATAN: hy.atan,
    Operation.ATAN2: hy.atan2,
    Operation.SINH: hy.sinh,
    Operation.COSH: hy.cosh,
    Operation.TANH: hy.tanh,
    Operation.ASINH: hy.asinh,
    Operation.ACOSH: hy.acosh,
    Operation.ATANH: hy.atanh,
    Operation.ABS: lambda a: hy.select(hy.lt(a, 0.0), -a, a),
    Operation.SIGN: _sign,
    Operation.MIN: _minimum,
    Operation.MAX: _maximum,
    Operation.LESS: hy.lt,
    Operation.LESS_EQUAL: hy.lte,
    Operation.EQUAL: hy.eq,
    Operation.AND: lambda a, b: hy.logical_and([a, b]),
    Operation.OR: lambda a, b: hy.logical_or([a, b]),
    Operation.NOT: lambda a: hy.eq(a, 0.0),
    Operation.SELECT: hy.select,
    Operation.FMA: lambda a, b, c: a * b + c,
}


def to_heyoka(kernel: Kernel, inputs: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Expressions of heyoka by output name.

    Args:
        kernel: what to lower.
        inputs: a heyoka expression for some or all inputs (`hy.par[0]`, `hy.time`, a number as an expression);
            an input left out becomes the variable of its name.

    Raises:
        SimulationError: FLOOR and FLIP, which a Taylor series cannot carry.
    """
    given = inputs or {}
    return dict(zip(kernel.outputs, heyoka_values(kernel, given, kernel.results), strict=True))


def heyoka_values(kernel: Kernel, inputs: Mapping[str, Any], indices: Sequence[int]) -> list[Any]:
    """Expressions of heyoka for the values with the given indices (see `Kernel`)."""
    values: list[Any] = [inputs[name] if name in inputs else hy.expression(name) for name in kernel.inputs]
    for instruction in kernel.instructions:
        if instruction.operation is Operation.CONSTANT:
            values.append(hy.expression(instruction.value))
            continue
        function = _FUNCTIONS.get(instruction.operation)
        if function is None:
            raise SimulationError(
                f"continuous simulation of '{kernel.name}'",
                f"it contains '{instruction.operation}', a step function, which has no Taylor series.",
                "Put quantisation into a sampled loop.",
            )
        values.append(function(*(values[operand] for operand in instruction.operands)))
    return [values[index] for index in indices]
