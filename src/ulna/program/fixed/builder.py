"""`Integers`: values of fixed point under construction, each with its interval and the binary point chosen by it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ulna.base import UlnaError
from ulna.program.fixed.integers import LARGEST, WORD, Format, IntegerInstruction, Step
from ulna.program.fixed.interval import Interval, enclosed
from ulna.program.instructions import Operation

MOST_POINT = 62
ROOM = 30
"""Bits by which a 32-bit operand may be shifted to the left in 64 bits and still be added."""


class UnboundedError(UlnaError):
    """A value that has no bounds over the stated ranges."""


@dataclass(frozen=True, slots=True)
class Value:
    """An integer of the program: n · 2^−point, within an interval that holds all roundings so far."""

    index: int
    point: int
    interval: Interval


class Integers:
    """Instructions gathered one by one, equal ones only once.

    Args:
        inputs: formats of the inputs, in order. factor: bits of each factor of a product, sign included.
    """

    def __init__(self, inputs: list[Format], factor: int) -> None:
        self.instructions: list[IntegerInstruction] = []
        self.inputs = [Value(k, each.point, Interval(each.lower, each.upper)) for k, each in enumerate(inputs)]
        self.narrow = WORD - factor
        self.functions: dict[str, float] = {}
        self._known: dict[IntegerInstruction, int] = {}

    def constant(self, value: float, point: int | None = None) -> Value:
        """A number, with as many bits as fit."""
        at = point_of(abs(value)) if point is None else point
        n = math.floor(math.ldexp(value, at) + 0.5)
        real = math.ldexp(float(n), -at)
        return self._emitted(Step.CONSTANT, (), (), at, Interval(real, real), value=n)

    def moved(self, a: Value, point: int) -> Value:
        """The same number with another binary point; a finer one must fit."""
        if a.point == point:
            return a
        rounding = 2.0**-point if point < a.point else 0.0
        return self._emitted(Step.MOVED, (a,), (a.point - point, 0), point, a.interval.wider(rounding))

    def sum(self, step: Step, a: Value, b: Value) -> Value:
        """a + b or a − b."""
        operation = Operation.ADD if step is Step.ADD else Operation.SUB
        exact = self._bounded(operation, enclosed(operation, (a.interval, b.interval)), (a, b))
        common = _common(a, b)
        lost = 2.0**-common if common < max(a.point, b.point) else 0.0
        point = point_of(exact.wider(2.0 * lost).size)
        shifts = (a.point - common, b.point - common, common - point)
        return self._emitted(step, (a, b), shifts, point, exact.wider(lost + _unit(point, common - point)))

    def product(self, a: Value, b: Value) -> Value:
        """a · b, each factor rounded to its bits first."""
        a, b = self._factor(a), self._factor(b)
        exact = enclosed(Operation.MUL, (a.interval, b.interval), same=a.index == b.index)
        exact = self._bounded(Operation.MUL, exact, (a, b))
        point = max(point_of(exact.size), a.point + b.point - MOST_POINT)
        by = a.point + b.point - point
        return self._emitted(Step.MUL, (a, b), (0, 0, by), point, exact.wider(_unit(point, by)))

    def quotient(self, a: Value, b: Value) -> Value:
        """a / b."""
        exact = self._bounded(Operation.DIV, enclosed(Operation.DIV, (a.interval, b.interval)), (a, b))
        if min(abs(b.interval.lower), abs(b.interval.upper)) < 2.0 ** (1 - b.point):
            raise UnboundedError(f"a / b with b in {b.interval}", "b is 0 in 32 bits.")
        point = min(point_of(exact.size), ROOM + a.point - b.point)
        by = a.point - b.point - point
        lost = 2.0 ** (by - a.point) / min(abs(b.interval.lower), abs(b.interval.upper)) if by > 0 else 0.0
        return self._emitted(Step.DIV, (a, b), (by, 0, 0), point, exact.wider(2.0**-point + lost))

    def root(self, a: Value) -> Value:
        """√a; what rounding put below 0 counts as 0."""
        slack = 2.0 ** (8 - a.point)
        if a.interval.lower < -slack:
            raise UnboundedError(f"the root of a number in {a.interval}", "it may be negative.")
        a = self.extreme(Step.MAX, a, self.constant(0.0, a.point))
        point = min(point_of(math.sqrt(a.interval.upper)), (a.point + ROOM) // 2)
        exact = enclosed(Operation.SQRT, (a.interval.within(0.0, math.inf),))
        by = a.point - 2 * point
        lost = math.sqrt(2.0 ** (by - a.point)) if by > 0 else 0.0
        return self._emitted(Step.ROOT, (a,), (by, 0), point, exact.wider(2.0**-point + lost))

    def sign_changed(self, a: Value) -> Value:
        """−a."""
        return self._emitted(Step.NEG, (a,), (0, 0), a.point, Interval(-a.interval.upper, -a.interval.lower))

    def magnitude(self, a: Value) -> Value:
        """|a|."""
        return self._emitted(Step.ABS, (a,), (0, 0), a.point, enclosed(Operation.ABS, (a.interval,)))

    def floor(self, a: Value) -> Value:
        """The largest whole number that is not above a."""
        found = enclosed(Operation.FLOOR, (a.interval,))
        if a.point <= 0:
            return a
        point = point_of(found.size)
        return self._emitted(Step.FLOOR, (a,), (a.point, -point), point, found)

    def extreme(self, step: Step, a: Value, b: Value) -> Value:
        """The smaller (MIN) or the larger (MAX) of two."""
        operation = Operation.MIN if step is Step.MIN else Operation.MAX
        exact = enclosed(operation, (a.interval, b.interval))
        common = _common(a, b)
        lost = 2.0**-common if common < max(a.point, b.point) else 0.0
        point = min(point_of(exact.wider(2.0 * lost).size), common)
        shifts = (a.point - common, b.point - common, common - point)
        return self._emitted(step, (a, b), shifts, point, exact.wider(lost + _unit(point, common - point)))

    def compared(self, step: Step, a: Value, b: Value) -> Value:
        """1 where a < b, a ≤ b or a = b, else 0."""
        common = _common(a, b)
        return self._emitted(step, (a, b), (a.point - common, b.point - common, 0), 0, Interval(0.0, 1.0))

    def logic(self, step: Step, *operands: Value) -> Value:
        """And, or, not."""
        return self._emitted(step, operands, (0,) * (len(operands) + 1), 0, Interval(0.0, 1.0))

    def choice(self, condition: Value, a: Value, b: Value, narrowed: tuple[Interval, Interval]) -> Value:
        """A where the condition holds, else b; `narrowed` is what each can be where it is chosen."""
        if condition.interval.lower > 0.0 or condition.interval.upper <= 0.0:
            return a if condition.interval.lower > 0.0 else b
        exact = narrowed[0].hull(narrowed[1])
        point = min(point_of(exact.size), max(a.point, b.point))
        coarser = max(_unit(point, each.point - point) for each in (a, b))
        shifts = (a.point - point, b.point - point)
        return self._emitted(Step.SELECT, (condition, a, b), shifts, point, exact.wider(coarser))

    def _factor(self, a: Value) -> Value:
        return a if self.narrow == 0 else self.moved(a, a.point - self.narrow)

    def _bounded(self, operation: Operation, found: Interval, operands: tuple[Value, ...]) -> Interval:
        if found.bounded and found.size < 2.0**MOST_POINT:
            return found
        given = " and ".join(str(each.interval) for each in operands)
        raise UnboundedError(f"'{operation}' of {given}", f"it lies in {found}.")

    def _emitted(
        self,
        step: Step,
        operands: tuple[Value, ...],
        shifts: tuple[int, ...],
        point: int,
        interval: Interval,
        value: int = 0,
    ) -> Value:
        short = step is Step.MUL and self.narrow >= WORD // 2
        each = IntegerInstruction(step, tuple(a.index for a in operands), shifts, value, short)
        if each not in self._known:
            self._known[each] = len(self.inputs) + len(self.instructions)
            self.instructions.append(each)
        return Value(self._known[each], point, interval)


def point_of(size: float) -> int:
    """The finest binary point with which a magnitude and two more units fit into a word."""
    if size == 0.0:
        return ROOM
    point = WORD - 1 - math.frexp(size)[1]
    point = point if math.ldexp(size, point) + 2.0 <= LARGEST else point - 1
    return min(point, MOST_POINT)


def _unit(point: int, by: int) -> float:
    """How far a shift to the right rounds."""
    return 2.0**-point if by > 0 else 0.0


def _common(a: Value, b: Value) -> int:
    """A binary point at which both fit into 64 bits with room for a sum."""
    return min(max(a.point, b.point), min(a.point, b.point) + ROOM)
