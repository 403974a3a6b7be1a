"""`Fused` and `Plain` arithmetic: which elementary steps a kernel may consist of.

A call of a mathematical library rounds otherwise in every language, and in its vector form otherwise than alone.
Written out, a function gives the same bits in any language that has the elementary steps, for one run and for many.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ulna.program.arithmetic.hyperbolic import hyperbolic_tangent
from ulna.program.arithmetic.rounding import floor
from ulna.program.arithmetic.trigonometric import fused_cosine, fused_sine
from ulna.program.instructions import Instruction, InstructionList, Operation, pruned
from ulna.program.kernel import Kernel
from ulna.program.scalar import Scalar

_Function = Callable[[Scalar], Scalar]


class AbstractArithmetic(ABC):
    """The steps a kernel may consist of."""

    @property
    @abstractmethod
    def functions(self) -> Mapping[Operation, _Function]:
        """Functions of one argument that are written out."""

    @property
    @abstractmethod
    def fuses(self) -> bool:
        """Whether a product and the sum that it enters are rounded once."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fused(AbstractArithmetic):
    """+, −, ×, ÷, √, comparisons, and the fused multiply-add of processors: fast and accurate, not for JavaScript.

    A product that is added or subtracted is fused with the sum; of two products the second one. Sine, cosine, tanh and
    floor are written out; exp, log, pow and the functions made of them are the library's.
    """

    @property
    def functions(self) -> Mapping[Operation, _Function]:
        """Functions of one argument that are written out."""
        return _FUSED

    @property
    def fuses(self) -> bool:
        """True."""
        return True


@dataclass(frozen=True, slots=True, kw_only=True)
class Plain(AbstractArithmetic):
    """+, −, ×, ÷, √ and comparisons, each rounded alone: the same bits in every language."""

    @property
    def functions(self) -> Mapping[Operation, _Function]:
        """Functions of one argument that are written out."""
        return _PLAIN

    @property
    def fuses(self) -> bool:
        """False."""
        return False


def in_arithmetic(kernel: Kernel, arithmetic: AbstractArithmetic) -> Kernel:
    """The kernel in an arithmetic: equal up to rounding, the rounding fixed.

    The last transform before a lowering, and done once: what is written out has no derivatives, and a sum of products
    that was not fused the first time would be the second time.
    """
    out = InstructionList(len(kernel.inputs))
    rewriting = _Rewriting(out, arithmetic)
    for instruction in kernel.instructions:
        rewriting.append(instruction)
    results = [rewriting.value(result) for result in kernel.results]
    instructions, kept = pruned(len(kernel.inputs), out.instructions, results)
    return Kernel(
        name=kernel.name, inputs=kernel.inputs, outputs=kernel.outputs, instructions=instructions, results=kept
    )


class _Rewriting:
    """Instructions rewritten one by one."""

    def __init__(self, out: InstructionList, arithmetic: AbstractArithmetic) -> None:
        self._out = out
        self._arithmetic = arithmetic
        self._values = list(range(out.input_count))
        # Products wait until somebody needs their value; most are only added to something.
        self._waiting: dict[int, tuple[int, int]] = {}

    def value(self, k: int) -> int:
        """The index of value k; a product that waited is computed now and no longer fused with later sums."""
        if k in self._waiting:
            self._values[k] = self._out.emit(Operation.MUL, *self._waiting.pop(k))
        return self._values[k]

    def append(self, instruction: Instruction) -> None:
        """The next instruction."""
        operation, operands = instruction.operation, instruction.operands
        function = self._arithmetic.functions.get(operation)
        if operation is Operation.CONSTANT:
            value = self._out.constant(instruction.value)
        elif operation is Operation.MUL and self._arithmetic.fuses:
            self._waiting[len(self._values)] = (self.value(operands[0]), self.value(operands[1]))
            value = -1
        elif operation in (Operation.ADD, Operation.SUB) and not self._waiting.keys().isdisjoint(operands):
            value = self._fused(operation, operands)
        elif function is not None:
            value = function(Scalar(self._out, self.value(operands[0]))).index
        else:
            value = self._out.emit(operation, *[self.value(k) for k in operands])
        self._values.append(value)

    def _fused(self, operation: Operation, operands: tuple[int, ...]) -> int:
        """a + b·c, a − b·c or a·b − c; of two products the second one is fused."""
        first, second = operands
        emit, minus = self._out.emit, operation is Operation.SUB
        if second in self._waiting:
            left, right = self._waiting[second]
            return emit(Operation.FMA, emit(Operation.NEG, left) if minus else left, right, self.value(first))
        left, right = self._waiting[first]
        other = self.value(second)
        return emit(Operation.FMA, left, right, emit(Operation.NEG, other) if minus else other)


_FUSED: Mapping[Operation, _Function] = {
    Operation.SIN: fused_sine,
    Operation.COS: fused_cosine,
    Operation.TANH: hyperbolic_tangent,
    Operation.FLOOR: floor,
}
_PLAIN: Mapping[Operation, _Function] = {Operation.FLOOR: floor}
