"""A `Kernel` as a CasADi SX function: derivatives of large plants, and code other tools read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import casadi as ca

from ulna.program.instructions import Operation
from ulna.program.kernel import Kernel
from ulna.program.lowering.operators import OPERATORS

_FUNCTIONS: Mapping[Operation, Callable[..., Any]] = {
    **OPERATORS,
    Operation.SQRT: ca.sqrt,
    Operation.EXP: ca.exp,
    Operation.LOG: ca.log,
    Operation.SIN: ca.sin,
    Operation.COS: ca.cos,
    Operation.TAN: ca.tan,
    Operation.ASIN: ca.asin,
    Operation.ACOS: ca.acos,
    Operation.ATAN: ca.atan,
    Operation.ATAN2: ca.atan2,
    Operation.SINH: ca.sinh,
    Operation.COSH: ca.cosh,
    Operation.TANH: ca.tanh,
    Operation.ASINH: ca.asinh,
    Operation.ACOSH: ca.acosh,
    Operation.ATANH: ca.atanh,
    Operation.ABS: ca.fabs,
    Operation.SIGN: ca.sign,
    Operation.FLOOR: ca.floor,
    Operation.MIN: ca.fmin,
    Operation.MAX: ca.fmax,
    Operation.LESS: lambda a, b: a < b,
    Operation.LESS_EQUAL: lambda a, b: a <= b,
    Operation.EQUAL: lambda a, b: a == b,
    Operation.AND: ca.logic_and,
    Operation.OR: ca.logic_or,
    Operation.NOT: ca.logic_not,
    Operation.SELECT: ca.if_else,
    Operation.FMA: lambda a, b, c: a * b + c,
    Operation.FLIP: lambda a, b: ca.if_else(b - 2.0 * ca.floor(0.5 * b) == 1.0, -a, a),
}


def to_casadi(kernel: Kernel) -> ca.Function:
    """The CasADi function from one column of all inputs to one column of all outputs, both in the kernel's order.

    CasADi's fmin and fmax answer the operand that is not NaN; FMA rounds twice;
    everything else agrees with the other lowerings.
    """
    column = ca.SX.sym("inputs", len(kernel.inputs))
    values: list[Any] = [column[k] for k in range(len(kernel.inputs))]
    for instruction in kernel.instructions:
        if instruction.operation is Operation.CONSTANT:
            values.append(ca.SX(instruction.value))
        else:
            function = _FUNCTIONS[instruction.operation]
            values.append(function(*(values[operand] for operand in instruction.operands)))
    outputs = ca.vertcat(*(ca.densify(values[result]) for result in kernel.results))
    return ca.Function("kernel", [column], [outputs], ["inputs"], ["outputs"])
