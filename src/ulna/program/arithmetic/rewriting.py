"""Kernels rewritten in an arithmetic, instruction by instruction."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ulna.program.arithmetic.arithmetic import AbstractArithmetic, Unwritten
from ulna.program.arithmetic.exponential import exponential
from ulna.program.arithmetic.hyperbolic import (
    hyperbolic_cosine,
    hyperbolic_sine,
    hyperbolic_tangent,
    inverse_hyperbolic_cosine,
    inverse_hyperbolic_sine,
    inverse_hyperbolic_tangent,
)
from ulna.program.arithmetic.inverse_trigonometric import arc_cosine, arc_sine, arc_tangent, arc_tangent_of_two
from ulna.program.arithmetic.logarithm import logarithm, power
from ulna.program.arithmetic.rounding import floor
from ulna.program.arithmetic.trigonometric import cosine, sine, tangent
from ulna.program.instructions import Instruction, InstructionList, Operation, pruned
from ulna.program.kernel import Kernel
from ulna.program.scalar import Scalar

_Function = Callable[..., Scalar]


def in_arithmetic(kernel: Kernel, arithmetic: AbstractArithmetic) -> Kernel:
    """The kernel in an arithmetic: equal up to rounding, the rounding fixed.

    The last transform before a lowering, and done once: what is written out has no derivatives, and a sum of products
    that was not fused the first time would be the second time.
    """
    if isinstance(arithmetic, Unwritten):
        return kernel
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
        function = _FUNCTIONS.get(operation)
        if operation is Operation.CONSTANT:
            value = self._out.constant(instruction.value)
        elif operation is Operation.MUL and self._arithmetic.fuses:
            self._waiting[len(self._values)] = (self.value(operands[0]), self.value(operands[1]))
            value = -1
        elif operation in (Operation.ADD, Operation.SUB) and not self._waiting.keys().isdisjoint(operands):
            value = self._fused(operation, operands)
        elif operation is Operation.FMA and not self._arithmetic.fuses:
            product = self._out.emit(Operation.MUL, *[self.value(k) for k in operands[:2]])
            value = self._out.emit(Operation.ADD, product, self.value(operands[2]))
        elif function is not None:
            arguments = [Scalar(self._out, self.value(k)) for k in operands]
            value = function(self._arithmetic, *arguments).index
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


_FUNCTIONS: Mapping[Operation, _Function] = {
    Operation.FLOOR: floor,
    Operation.SIN: sine,
    Operation.COS: cosine,
    Operation.TAN: tangent,
    Operation.ASIN: arc_sine,
    Operation.ACOS: arc_cosine,
    Operation.ATAN: arc_tangent,
    Operation.ATAN2: arc_tangent_of_two,
    Operation.EXP: exponential,
    Operation.LOG: logarithm,
    Operation.POW: power,
    Operation.SINH: hyperbolic_sine,
    Operation.COSH: hyperbolic_cosine,
    Operation.TANH: hyperbolic_tangent,
    Operation.ASINH: inverse_hyperbolic_sine,
    Operation.ACOSH: inverse_hyperbolic_cosine,
    Operation.ATANH: inverse_hyperbolic_tangent,
}
