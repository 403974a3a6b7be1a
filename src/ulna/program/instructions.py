"""The alphabet of a `Kernel`: its operations, one instruction, and the list that instructions are gathered in."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Protocol, TypeVar, runtime_checkable


class Operation(StrEnum):
    """What one instruction computes from its operands a, b, c, in IEEE double precision.

    Comparisons and logic answer 1.0 or 0.0; SELECT(a, b, c) is b where a is not zero, else c.
    MIN and MAX hand a NaN on, whichever operand it sits in: a limiter must not hide it.
    FMA(a, b, c) is a·b + c rounded once. FLIP(a, b) is a, its sign changed where the last bit of the significand of b
    is set: where n is odd for b = 1.5 · 2^52 + n.
    """

    CONSTANT = "constant"
    ADD = "add"
    SUB = "sub"
    MUL = "mul"
    DIV = "div"
    NEG = "neg"
    POW = "pow"
    SQRT = "sqrt"
    EXP = "exp"
    LOG = "log"
    SIN = "sin"
    COS = "cos"
    TAN = "tan"
    ASIN = "asin"
    ACOS = "acos"
    ATAN = "atan"
    ATAN2 = "atan2"
    SINH = "sinh"
    COSH = "cosh"
    TANH = "tanh"
    ASINH = "asinh"
    ACOSH = "acosh"
    ATANH = "atanh"
    ABS = "abs"
    SIGN = "sign"
    FLOOR = "floor"
    MIN = "min"
    MAX = "max"
    LESS = "less"
    LESS_EQUAL = "less_equal"
    EQUAL = "equal"
    AND = "and"
    OR = "or"
    NOT = "not"
    SELECT = "select"
    FMA = "fma"
    FLIP = "flip"


COMMUTATIVE = frozenset({Operation.ADD, Operation.MUL, Operation.EQUAL, Operation.AND, Operation.OR})
"""Operations whose operands can be swapped without changing a single bit of the result."""

LONGEST_CHAIN = 64
"""Integer powers up to this one become multiplications; beyond it one call of `pow` is shorter."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Instruction:
    """One value: an operation on earlier values.

    Operand k is input k of the kernel for k < number of inputs, else instruction k − number of inputs.
    `value` is the constant of a CONSTANT and zero otherwise.
    """

    operation: Operation
    operands: tuple[int, ...] = ()
    value: float = 0.0


class InstructionList:
    """Instructions gathered one by one, equal ones only once (hash-consing).

    Every method returns the index of the value it stands for. Only rewritings that leave every bit of the result
    alone are made: x·1 = x, x·(−1) = −x, x/1 = x, −(−x) = x, and the order of commutative operands.
    """

    def __init__(self, input_count: int) -> None:
        self.input_count = input_count
        self.instructions: list[Instruction] = []
        self._known: dict[tuple[object, ...], int] = {}

    def constant(self, value: float) -> int:
        """The index of a constant; −0.0 and 0.0 are different constants."""
        return self._intern(("constant", value.hex()), Instruction(operation=Operation.CONSTANT, value=value))

    def emit(self, operation: Operation, *operands: int) -> int:
        """The index of operation(operands)."""
        shorter = self._shortened(operation, operands)
        if shorter is not None:
            return shorter
        key_operands = operands
        if operation in COMMUTATIVE:
            key_operands = tuple(sorted(operands))
        elif operation is Operation.FMA:
            key_operands = (*sorted(operands[:2]), operands[2])
        return self._intern((operation, *key_operands), Instruction(operation=operation, operands=operands))

    def power(self, base: int, exponent: int) -> int:
        """base**exponent for a whole exponent ≥ 1, by repeated squaring (the shortest bits first)."""
        if exponent > LONGEST_CHAIN:
            return self.emit(Operation.POW, base, self.constant(float(exponent)))
        result: int | None = None
        square = base
        while True:
            if exponent & 1:
                result = square if result is None else self.emit(Operation.MUL, result, square)
            exponent >>= 1
            if not exponent:
                return base if result is None else result
            square = self.emit(Operation.MUL, square, square)

    def value_of(self, index: int) -> float | None:
        """The value of a constant, None for anything else."""
        if index < self.input_count:
            return None
        instruction = self.instructions[index - self.input_count]
        return instruction.value if instruction.operation is Operation.CONSTANT else None

    def _shortened(self, operation: Operation, operands: tuple[int, ...]) -> int | None:
        if operation is Operation.NEG:
            inner = operands[0] - self.input_count
            if inner >= 0 and self.instructions[inner].operation is Operation.NEG:
                return self.instructions[inner].operands[0]
            value = self.value_of(operands[0])
            return None if value is None else self.constant(-value)
        if operation is Operation.DIV and self.value_of(operands[1]) == 1.0:
            return operands[0]
        if operation is Operation.MUL:
            for factor, other in (operands, operands[::-1]):
                value = self.value_of(factor)
                if value == 1.0:
                    return other
                if value == -1.0:
                    return self.emit(Operation.NEG, other)
        return None

    def _intern(self, key: tuple[object, ...], instruction: Instruction) -> int:
        index = self._known.get(key)
        if index is None:
            index = self.input_count + len(self.instructions)
            self.instructions.append(instruction)
            self._known[key] = index
        return index


@runtime_checkable
class Operated(Protocol):
    """What has operands: an instruction on numbers, or on integers."""

    @property
    def operands(self) -> tuple[int, ...]:
        """Indices of earlier values."""
        ...


_T = TypeVar("_T", bound=Operated)


def pruned(
    input_count: int, instructions: Iterable[_T], results: Iterable[int]
) -> tuple[tuple[_T, ...], tuple[int, ...]]:
    """The instructions that the results need, renumbered, and the renumbered results."""
    listed = tuple(instructions)
    results = tuple(results)
    needed = set(results)
    changed: Any = replace
    for position in range(len(listed) - 1, -1, -1):
        if position + input_count in needed:
            needed.update(listed[position].operands)
    renumbered = {index: index for index in range(input_count)}
    kept: list[_T] = []
    for position, instruction in enumerate(listed):
        if position + input_count in needed:
            renumbered[position + input_count] = input_count + len(kept)
            operands = tuple(renumbered[operand] for operand in instruction.operands)
            kept.append(instruction if operands == instruction.operands else changed(instruction, operands=operands))
    return tuple(kept), tuple(renumbered[result] for result in results)
