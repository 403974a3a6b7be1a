"""A `Kernel` as a NumPy function that broadcasts over arrays."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from ulna.program.instructions import Operation
from ulna.program.kernel import Kernel
from ulna.program.lowering.fused import flipped, fused
from ulna.program.lowering.python_source import INDENT, TEMPLATES, executed, literal, to_python
from ulna.program.precision import Precision

_ARRAY_TEMPLATES: Mapping[Operation, str] = MappingProxyType(
    {
        **{operation: TEMPLATES[operation] for operation in (Operation.ADD, Operation.SUB, Operation.MUL)},
        Operation.DIV: "np.divide({0}, {1})",
        Operation.NEG: "-{0}",
        Operation.POW: "np.power({0}, {1})",
        Operation.SQRT: "np.sqrt({0})",
        Operation.EXP: "np.exp({0})",
        Operation.LOG: "np.log({0})",
        Operation.SIN: "np.sin({0})",
        Operation.COS: "np.cos({0})",
        Operation.TAN: "np.tan({0})",
        Operation.ASIN: "np.arcsin({0})",
        Operation.ACOS: "np.arccos({0})",
        Operation.ATAN: "np.arctan({0})",
        Operation.ATAN2: "np.arctan2({0}, {1})",
        Operation.SINH: "np.sinh({0})",
        Operation.COSH: "np.cosh({0})",
        Operation.TANH: "np.tanh({0})",
        Operation.ASINH: "np.arcsinh({0})",
        Operation.ACOSH: "np.arccosh({0})",
        Operation.ATANH: "np.arctanh({0})",
        Operation.ABS: "np.abs({0})",
        Operation.SIGN: "np.where(np.greater({0}, zero), one, np.where(np.less({0}, zero), -one, {0}))",
        Operation.FLOOR: "np.floor({0})",
        Operation.MIN: "np.where(np.less({0}, {1}) | np.not_equal({0}, {0}), {0}, {1})",
        Operation.MAX: "np.where(np.greater({0}, {1}) | np.not_equal({0}, {0}), {0}, {1})",
        Operation.LESS: "np.where(np.less({0}, {1}), one, zero)",
        Operation.LESS_EQUAL: "np.where(np.less_equal({0}, {1}), one, zero)",
        Operation.EQUAL: "np.where(np.equal({0}, {1}), one, zero)",
        Operation.AND: "np.where(np.logical_and({0}, {1}), one, zero)",
        Operation.OR: "np.where(np.logical_or({0}, {1}), one, zero)",
        Operation.NOT: "np.where({0}, zero, one)",
        Operation.SELECT: "np.where({0}, {1}, {2})",
        Operation.FMA: "fused({0}, {1}, {2})",
        Operation.FLIP: "flipped({0}, {1})",
    }
)


def to_numpy(kernel: Kernel, *, precision: Precision = Precision.DOUBLE) -> Callable[..., tuple[Any, ...]]:
    """A function of the inputs, in order, that returns the outputs as a tuple.

    With scalars only: floats, bit-equal to the Python source. With arrays, and always in single precision: every output
    is an array of the broadcast shape of all inputs; elementary functions are NumPy's, which may differ from `math` in
    the last bit. Infinities and NaN come out where IEEE arithmetic has them, without warnings.
    """
    scalar = to_python(kernel)
    real = precision.dtype
    names = {"np": np, "math": math, "fused": fused, "flipped": flipped, "one": real(1), "zero": real(0), "real": real}
    arrays = executed(_source(kernel, "real({})" if precision is Precision.SINGLE else "{}"), names)

    def evaluate(*values: Any) -> tuple[Any, ...]:
        if precision is Precision.DOUBLE and all(isinstance(v, float | int) or np.ndim(v) == 0 for v in values):
            return scalar(*map(float, values))
        with np.errstate(all="ignore"):
            converted = [np.asarray(value, dtype=real) for value in values]
            shape = np.broadcast_shapes(*(value.shape for value in converted))
            results = arrays(*converted)
        return tuple(np.broadcast_to(result, shape).copy() for result in results)

    return evaluate


def _source(kernel: Kernel, constant: str) -> str:
    """Like the Python source, but a name is used again once its value is dead: arrays may be large."""
    last_use = _last_uses(kernel)
    names = list(kernel.identifiers)
    free: list[str] = []
    count = 0
    lines = [f"def kernel({', '.join(names)}):"]
    for position, instruction in enumerate(kernel.instructions):
        index = len(kernel.inputs) + position
        if instruction.operation is Operation.CONSTANT:
            names.append(constant.format(literal(instruction)))
            continue
        text = _ARRAY_TEMPLATES[instruction.operation].format(*(names[operand] for operand in instruction.operands))
        dead = {k for k in instruction.operands if last_use[k] == index and _is_intermediate(kernel, k)}
        free.extend(names[operand] for operand in sorted(dead))
        if free:
            target = free.pop()
        else:
            target, count = f"v{count}", count + 1
        names.append(target)
        lines.append(f"{INDENT}{target} = {text}")
    values = "".join(f"{names[result]}, " for result in kernel.results)
    return "\n".join([*lines, f"{INDENT}return ({values.rstrip()})"]) + "\n"


def _last_uses(kernel: Kernel) -> dict[int, int]:
    first = len(kernel.inputs)
    last = {operand: first + k for k, each in enumerate(kernel.instructions) for operand in each.operands}
    return {**last, **dict.fromkeys(kernel.results, first + len(kernel.instructions))}


def _is_intermediate(kernel: Kernel, index: int) -> bool:
    position = index - len(kernel.inputs)
    return position >= 0 and kernel.instructions[position].operation is not Operation.CONSTANT
