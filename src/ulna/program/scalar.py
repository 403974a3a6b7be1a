"""`Scalar`: a value of an instruction list that is computed with like a number."""

from __future__ import annotations

from dataclasses import dataclass

from ulna.program.instructions import InstructionList, Operation


@dataclass(frozen=True, slots=True)
class Scalar:
    """The value with the given index; arithmetic on it emits instructions, plain numbers become constants.

    Comparisons are methods and answer the scalar 1 or 0.
    """

    out: InstructionList
    index: int

    def apply(self, operation: Operation, *others: Scalar | float) -> Scalar:
        """operation(self, *others)."""
        return Scalar(self.out, self.out.emit(operation, self.index, *(self.like(each).index for each in others)))

    def like(self, value: Scalar | float) -> Scalar:
        """A number as a constant of the same list; a scalar as it is."""
        return value if isinstance(value, Scalar) else Scalar(self.out, self.out.constant(float(value)))

    def __add__(self, other: Scalar | float) -> Scalar:
        return self.apply(Operation.ADD, other)

    def __radd__(self, other: float) -> Scalar:
        return self.like(other) + self

    def __sub__(self, other: Scalar | float) -> Scalar:
        return self.apply(Operation.SUB, other)

    def __rsub__(self, other: float) -> Scalar:
        return self.like(other) - self

    def __mul__(self, other: Scalar | float) -> Scalar:
        return self.apply(Operation.MUL, other)

    def __rmul__(self, other: float) -> Scalar:
        return self.like(other) * self

    def __truediv__(self, other: Scalar | float) -> Scalar:
        return self.apply(Operation.DIV, other)

    def __rtruediv__(self, other: float) -> Scalar:
        return self.like(other) / self

    def __neg__(self) -> Scalar:
        return self.apply(Operation.NEG)

    def __abs__(self) -> Scalar:
        return self.apply(Operation.ABS)

    def less(self, other: Scalar | float) -> Scalar:
        """Self < other."""
        return self.apply(Operation.LESS, other)

    def more(self, other: Scalar | float) -> Scalar:
        """Self > other."""
        return self.like(other).apply(Operation.LESS, self)

    def where(self, yes: Scalar | float, no: Scalar | float) -> Scalar:
        """The first of two values where this one is not zero, else the second."""
        return self.apply(Operation.SELECT, yes, no)

    def at_most(self, other: Scalar | float) -> Scalar:
        """Self ≤ other."""
        return self.apply(Operation.LESS_EQUAL, other)

    def at_least(self, other: Scalar | float) -> Scalar:
        """Self ≥ other."""
        return self.like(other).apply(Operation.LESS_EQUAL, self)

    def equals(self, other: Scalar | float) -> Scalar:
        """Self = other; no NaN equals anything."""
        return self.apply(Operation.EQUAL, other)

    def both(self, other: Scalar) -> Scalar:
        """Neither is 0."""
        return self.apply(Operation.AND, other)

    def either(self, other: Scalar) -> Scalar:
        """One of them is not 0."""
        return self.apply(Operation.OR, other)

    def negated(self) -> Scalar:
        """It is 0."""
        return self.apply(Operation.NOT)

    def fused(self, factor: Scalar | float, summand: Scalar | float) -> Scalar:
        """Self · factor + summand, rounded once."""
        return self.apply(Operation.FMA, factor, summand)
