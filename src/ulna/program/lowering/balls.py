"""A `Kernel` in ball arithmetic: rigorous enclosures of its exact values.

F. Johansson, "Arb: efficient arbitrary-precision midpoint-radius interval arithmetic", IEEE Trans. Computers 66 (2017).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import flint
from flint import arb, fmpq

from ulna.base import UlnaError
from ulna.program.instructions import Operation
from ulna.program.kernel import Kernel
from ulna.program.lowering.operators import OPERATORS

BITS = 200
"""A working precision that outlasts the cancellation in Lie derivatives of plants."""

_SHORT = 2.0**20
_SIMPLE = 2**36
"""Fractions whose numerator times denominator is below this are what a decimal in a plant file means."""
_YES, _NO, _NAN = arb(1), arb(0), arb("nan")


def to_balls(kernel: Kernel) -> Callable[..., tuple[arb, ...]]:
    """A function from balls of the inputs, in order, to balls of the outputs, in the working precision of the moment.

    A constant is the short fraction that rounds to it (9.81 is 981/100), or else any number that rounds to it: what is
    certainly not zero here is certainly not zero for the exact constants. A value that does not exist as a real number
    for every point of the balls is a NaN ball, also one that depends on a comparison which the balls leave open.

    Raises:
        UlnaError: for FLIP: what is written out in an arithmetic has no bounds of use.
    """
    return evaluator(kernel, FUNCTIONS)


def evaluator(kernel: Kernel, functions: Mapping[Operation, Callable[..., Any]]) -> Callable[..., tuple[Any, ...]]:
    """The kernel on values of any kind that the functions know, constants as balls."""
    first = len(kernel.inputs)
    constants: dict[int, arb | fmpq] = {}
    steps: list[tuple[int, Callable[..., Any], tuple[int, ...]]] = []
    for index, instruction in enumerate(kernel.instructions, start=first):
        if instruction.operation is Operation.CONSTANT:
            constants[index] = _enclosure(instruction.value)
        elif instruction.operation in functions:
            steps.append((index, functions[instruction.operation], instruction.operands))
        else:
            raise UlnaError(
                f"balls of '{kernel.name}'",
                f"'{instruction.operation}' has no enclosure here.",
                "Take the kernel as it was before `in_arithmetic`.",
            )

    def evaluate(*inputs: Any) -> tuple[Any, ...]:
        # A fraction becomes a ball here, not before: the working precision is that of the moment.
        values: dict[int, Any] = {**dict(enumerate(inputs)), **{k: arb(value) for k, value in constants.items()}}
        for index, function, operands in steps:
            values[index] = function(*[values[k] for k in operands])
        return tuple(values[k] for k in kernel.results)

    return evaluate


def balls_by_name(kernel: Kernel) -> Callable[[Mapping[str, arb]], dict[str, arb]]:
    """The same from a ball for every input's name to one for every output's, with `BITS` of working precision."""
    evaluate = to_balls(kernel)

    def at(point: Mapping[str, arb]) -> dict[str, arb]:
        with flint.ctx.workprec(BITS):
            return dict(zip(kernel.outputs, evaluate(*(point[name] for name in kernel.inputs)), strict=True))

    return at


def _enclosure(value: float) -> arb | fmpq:
    """The short fraction that rounds to the double, or a ball of every number that does."""
    if not math.isfinite(value):
        return _NAN
    if (math.frexp(value)[0] * _SHORT).is_integer() or (value.is_integer() and abs(value) < 2.0**53):
        return arb(value)
    for above, below in _convergents(abs(value)):
        if above * below > _SIMPLE:
            break
        if above / below == abs(value):
            return fmpq(above if value > 0 else -above, below)
    return arb(value, abs(value) * 2.0**-52)


def _convergents(value: float) -> Iterator[tuple[int, int]]:
    """The convergents of the continued fraction of a positive number, numerator and denominator."""
    above, below = value.as_integer_ratio()
    p, q = (1, 0), (0, 1)
    while below:
        whole, rest = divmod(above, below)
        p, q = (whole * p[0] + p[1], p[0]), (whole * q[0] + q[1], q[0])
        yield p[0], q[0]
        above, below = below, rest


def _truth(value: arb) -> bool | None:
    """Whether a condition holds, None where that is open."""
    if value == 0:
        return False
    return None if value.contains(0) else True


def _condition(truth: bool | None) -> arb:
    return _NAN if truth is None else _YES if truth else _NO


def _less(a: arb, b: arb) -> arb:
    return _YES if a < b else _NO if a >= b else _NAN


def _less_equal(a: arb, b: arb) -> arb:
    return _YES if a <= b else _NO if a > b else _NAN


def _equal(a: arb, b: arb) -> arb:
    return _YES if a == b else _NO if a != b else _NAN


def _both(a: arb, b: arb) -> arb:
    truths = _truth(a), _truth(b)
    return _condition(False if False in truths else None if None in truths else True)


def _either(a: arb, b: arb) -> arb:
    truths = _truth(a), _truth(b)
    return _condition(True if True in truths else None if None in truths else False)


def _not(a: arb) -> arb:
    truth = _truth(a)
    return _condition(None if truth is None else not truth)


def _select(condition: arb, yes: arb, no: arb) -> arb:
    truth = _truth(condition)
    return _NAN if truth is None else yes if truth else no


FUNCTIONS: Mapping[Operation, Callable[..., Any]] = {
    **OPERATORS,
    Operation.SQRT: arb.sqrt,
    Operation.EXP: arb.exp,
    Operation.LOG: arb.log,
    Operation.SIN: arb.sin,
    Operation.COS: arb.cos,
    Operation.TAN: arb.tan,
    Operation.ASIN: arb.asin,
    Operation.ACOS: arb.acos,
    Operation.ATAN: arb.atan,
    Operation.ATAN2: arb.atan2,
    Operation.SINH: arb.sinh,
    Operation.COSH: arb.cosh,
    Operation.TANH: arb.tanh,
    Operation.ASINH: arb.asinh,
    Operation.ACOSH: arb.acosh,
    Operation.ATANH: arb.atanh,
    Operation.ABS: arb.__abs__,
    Operation.SIGN: lambda a: a.sgn() if a.is_finite() else _NAN,
    Operation.FLOOR: arb.floor,
    Operation.MIN: arb.min,
    Operation.MAX: arb.max,
    Operation.LESS: _less,
    Operation.LESS_EQUAL: _less_equal,
    Operation.EQUAL: _equal,
    Operation.AND: _both,
    Operation.OR: _either,
    Operation.NOT: _not,
    Operation.SELECT: _select,
    Operation.FMA: lambda a, b, c: a * b + c,
}
