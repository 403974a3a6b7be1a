"""`condensed`: a kernel with fewer choices and comparisons, every bit of its results the same."""

from __future__ import annotations

import math

from ulna.program.instructions import InstructionList, Operation, pruned
from ulna.program.kernel import Kernel

_COMPARISONS = frozenset({Operation.LESS, Operation.LESS_EQUAL, Operation.EQUAL})
_LOGIC = frozenset({Operation.AND, Operation.OR, Operation.NOT})


def condensed(kernel: Kernel) -> Kernel:
    """The kernel for a processor: choices that are known, nested or turned round are made once.

    Limiters and guards are put together of parts that do not know each other. Where one passes on to the next a limit
    that is infinite, a fault told as NaN, or the same two conditions for every state, fewer instructions do.
    """
    out = InstructionList(len(kernel.inputs))
    rules = _Rules(out)
    values = list(range(len(kernel.inputs)))
    for each in kernel.instructions:
        if each.operation is Operation.CONSTANT:
            values.append(out.constant(each.value))
        else:
            values.append(rules.emit(each.operation, *(values[k] for k in each.operands)))
    instructions, results = pruned(len(kernel.inputs), out.instructions, [values[k] for k in kernel.results])
    return Kernel(
        name=kernel.name, inputs=kernel.inputs, outputs=kernel.outputs, instructions=instructions, results=results
    )


class _Rules:
    """What an instruction is replaced by."""

    def __init__(self, out: InstructionList) -> None:
        self.out = out

    def emit(self, operation: Operation, *operands: int) -> int:
        """The index of operation(operands), or of what has the same bits."""
        if operation is Operation.SELECT:
            return self._choice(*operands)
        if operation in _COMPARISONS:
            return self._comparison(operation, *operands)
        if operation in _LOGIC:
            return self._logic(operation, *operands)
        return self.out.emit(operation, *operands)

    def _choice(self, condition: int, yes: int, no: int) -> int:
        known = self.out.value_of(condition)
        if known is not None or yes == no:
            return yes if known != 0.0 else no
        parts = self._of(condition, Operation.NOT)
        if parts is not None:
            return self._choice(parts[0], no, yes)
        if self._boolean(condition):
            ends = self.out.value_of(yes), self.out.value_of(no)
            if ends == (1.0, 0.0) and math.copysign(1.0, ends[1] or 0.0) > 0.0:
                return condition
            if ends == (0.0, 1.0) and math.copysign(1.0, ends[0] or 0.0) > 0.0:
                return self._logic(Operation.NOT, condition)
        inner = self._of(yes, Operation.SELECT)
        if inner is not None and inner[2] == no:
            return self._choice(self._logic(Operation.AND, condition, inner[0]), inner[1], no)
        inner = self._of(no, Operation.SELECT)
        if inner is not None and inner[1] == yes:
            return self._choice(self._logic(Operation.OR, condition, inner[0]), yes, inner[2])
        return self.out.emit(Operation.SELECT, condition, yes, no)

    def _comparison(self, operation: Operation, a: int, b: int) -> int:
        left, right = self.out.value_of(a), self.out.value_of(b)
        if left is not None and right is not None:
            return self.out.constant(float(_decided(operation, left, right)))
        if operation is Operation.LESS and (left == math.inf or right == -math.inf):
            return self.out.constant(0.0)
        # A choice between numbers that are known is one between answers that are known.
        for place, other in ((a, right), (b, left)):
            inner = self._of(place, Operation.SELECT)
            if inner is not None and other is not None and self._known(place):
                answers = [self._comparison(operation, *((each, b) if place == a else (a, each))) for each in inner[1:]]
                return self._choice(inner[0], *answers)
        return self.out.emit(operation, a, b)

    def _logic(self, operation: Operation, *operands: int) -> int:
        if operation is Operation.NOT:
            known, inner = self.out.value_of(operands[0]), self._of(operands[0], Operation.NOT)
            if known is not None:
                return self.out.constant(float(known == 0.0))
            if inner is not None and self._boolean(inner[0]):
                return inner[0]
            return self.out.emit(operation, *operands)
        decides = operation is Operation.OR
        for place, other in (operands, operands[::-1]):
            known = self.out.value_of(place)
            if known is not None and (known != 0.0) == decides:
                return self.out.constant(float(decides))
            if (known is not None or place == other) and self._boolean(other):
                return other
        return self.out.emit(operation, *operands)

    def _of(self, index: int, operation: Operation) -> tuple[int, ...] | None:
        """The operands of a value that an operation makes."""
        if index < self.out.input_count:
            return None
        each = self.out.instructions[index - self.out.input_count]
        return each.operands if each.operation is operation else None

    def _boolean(self, index: int) -> bool:
        """Whether a value can only be 1 or 0."""
        if index < self.out.input_count:
            return False
        each = self.out.instructions[index - self.out.input_count]
        if each.operation is Operation.SELECT:
            return all(self._boolean(k) for k in each.operands[1:])
        if each.operation is Operation.CONSTANT:
            return each.value == 1.0 or (each.value == 0.0 and math.copysign(1.0, each.value) > 0.0)
        return each.operation in _COMPARISONS | _LOGIC

    def _known(self, index: int) -> bool:
        """Whether a value is chosen between constants alone."""
        if self.out.value_of(index) is not None:
            return True
        inner = self._of(index, Operation.SELECT)
        return inner is not None and all(self._known(k) for k in inner[1:])


def _decided(operation: Operation, a: float, b: float) -> bool:
    return a < b if operation is Operation.LESS else a <= b if operation is Operation.LESS_EQUAL else a == b
