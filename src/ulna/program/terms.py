"""Multiples of a program's values: signs and constant factors are carried along and written only where they must be."""

from __future__ import annotations

from dataclasses import dataclass

from ulna.program.instructions import InstructionList, Operation

Term = tuple[int | None, float]
"""(index of a value, factor): factor · value, the factor alone where the index is None. None instead of a term is 0."""

ONE: Term = (None, 1.0)


def negative(term: Term) -> Term:
    """−term."""
    return term[0], -term[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Terms:
    """Arithmetic of terms; what has to be computed is emitted into `out`."""

    out: InstructionList

    def value(self, index: int | None) -> Term | None:
        """A value of the program as a term; constants are seen."""
        if index is None:
            return None
        constant = self.out.value_of(index)
        if constant is not None:
            return None if constant == 0.0 else (None, constant)
        if index >= self.out.input_count:
            instruction = self.out.instructions[index - self.out.input_count]
            if instruction.operation is Operation.NEG:
                return instruction.operands[0], -1.0
        return index, 1.0

    def written(self, term: Term | None) -> int:
        """The index of the term's value."""
        if term is None:
            return self.out.constant(0.0)
        index, factor = term
        if index is None:
            return self.out.constant(factor)
        return index if factor == 1.0 else self.out.emit(Operation.MUL, self.out.constant(factor), index)

    def settled(self, term: Term | None) -> Term | None:
        """The same value with no factor but a sign."""
        if term is None or term[0] is None or abs(term[1]) == 1.0:
            return term
        return self.written((term[0], abs(term[1]))), 1.0 if term[1] > 0 else -1.0

    def times(self, left: Term | None, right: Term | None) -> Term | None:
        """left · right."""
        if left is None or right is None:
            return None
        factor = left[1] * right[1]
        if left[0] is None or right[0] is None:
            return (left[0] if right[0] is None else right[0]), factor
        return self.out.emit(Operation.MUL, left[0], right[0]), factor

    def over(self, above: Term | None, below: Term) -> Term | None:
        """above / below."""
        if above is None:
            return None
        factor = above[1] / below[1]
        if below[0] is None:
            return above[0], factor
        if above[0] is None:
            return self.out.emit(Operation.DIV, self.out.constant(factor), below[0]), 1.0
        return self.out.emit(Operation.DIV, above[0], below[0]), factor

    def less(self, left: Term | None, right: Term | None) -> Term | None:
        """left − right."""
        if right is None:
            return left
        if left is None:
            return negative(right)
        if left[0] == right[0]:
            factor = left[1] - right[1]
            return (left[0], factor) if factor else None
        ratio = abs(right[1] / left[1])
        operation = Operation.SUB if (right[1] > 0) == (left[1] > 0) else Operation.ADD
        if left[0] is None or right[0] is None:
            return self._shifted(left, right, operation)
        return self.out.emit(operation, left[0], self.written((right[0], ratio))), left[1]

    def _shifted(self, left: Term, right: Term, operation: Operation) -> Term:
        """left − right where one of them is a number."""
        if left[0] is None:
            negated = (right[0], -right[1])
            return self.out.emit(Operation.ADD, self.out.constant(left[1]), self.written(negated)), 1.0
        return self.out.emit(operation, left[0], self.out.constant(abs(right[1] / left[1]))), left[1]
