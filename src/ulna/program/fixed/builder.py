"""`Integers`: values of fixed point under construction, each with its interval, binary point and error."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from ulna.base import UlnaError
from ulna.program.fixed.integers import WORD, Format, IntegerInstruction, Step
from ulna.program.fixed.interval import Interval, enclosed
from ulna.program.instructions import Operation

MOST_POINT = 62
ROOM = 30
"""Bits by which a 32-bit operand may be shifted to the left in 64 bits and still be added."""
ROUNDED = 2.0**-52
"""What an operation in double precision rounds by, of its result."""


class UnboundedError(UlnaError):
    """A value that has no bounds over the stated ranges."""


@dataclass(frozen=True, slots=True)
class Value:
    """An integer of the program: n · 2^−point.

    Attributes:
        grain: the value is a multiple of 2^−grain, no finer than its binary point.
        interval: holds it with all roundings so far, and the same value in double precision.
        error: how far it is from the same value in double precision at most, SI.
        doubts: comparisons and roundings to whole numbers that have to come out as in double precision for that.
    """

    index: int
    point: int
    grain: int
    interval: Interval
    error: float = 0.0
    doubts: frozenset[int] = frozenset()

    @property
    def sure(self) -> Value:
        """The same integer, what it differs by left aside: of functions, which have errors of their own."""
        return replace(self, error=0.0, doubts=frozenset())


class Integers:
    """Instructions gathered one by one, equal ones only once.

    Args:
        inputs: formats of the inputs, in order. factor: bits of each factor of a product, sign included.

    Attributes:
        margins: of each doubt, how near to each other its sides must be to come out otherwise.
        functions: largest error of each polynomial.
    """

    def __init__(self, inputs: list[Format], factor: int) -> None:
        self.instructions: list[IntegerInstruction] = []
        self.inputs = [
            Value(k, each.point, each.point, Interval(each.lower, each.upper)) for k, each in enumerate(inputs)
        ]
        self.factor = factor
        self.functions: dict[str, float] = {}
        self.margins: dict[int, float] = {}
        self._known: dict[IntegerInstruction, int] = {}

    def constant(self, value: float, point: int | None = None) -> Value:
        """A number, with as many bits as fit."""
        at = point_of(abs(value)) if point is None else point
        n = math.floor(math.ldexp(value, at) + 0.5)
        real = math.ldexp(float(n), -at)
        # The interval holds the number itself, too: what is computed in double precision begins with it.
        interval = Interval(min(real, value), max(real, value))
        grain = at - ((n & -n).bit_length() - 1) if n else 0
        return self._emitted(Step.CONSTANT, (), (), at, interval, abs(real - value), grain=grain, value=n)

    def moved(self, a: Value, point: int) -> Value:
        """The same number with another binary point; a finer one must fit."""
        if a.point == point:
            return a
        unit = _unit(point, a.grain)
        shifts = (a.point - point, 0)
        return self._emitted(Step.MOVED, (a,), shifts, point, a.interval.wider(unit), a.error + unit / 2.0, a.grain)

    def sum(self, step: Step, a: Value, b: Value) -> Value:
        """a + b or a − b."""
        operation = Operation.ADD if step is Step.ADD else Operation.SUB
        exact = self._bounded(operation, enclosed(operation, (a.interval, b.interval)), (a, b))
        common, lost = _common(a, b)
        point = min(point_of(exact.wider(2.0 * lost).size), common)
        grain = max(a.grain, b.grain)
        unit = _unit(point, grain)
        shifts = (a.point - common, b.point - common, common - point)
        error = a.error + b.error + (lost + unit) / 2.0 + _in_double(exact, grain, a, b)
        return self._emitted(step, (a, b), shifts, point, exact.wider(lost + unit), error, grain)

    def product(self, a: Value, b: Value) -> Value:
        """a · b, each factor rounded to its bits first."""
        a, b = self._factor(a), self._factor(b)
        exact = enclosed(Operation.MUL, (a.interval, b.interval), same=a.index == b.index)
        exact = self._bounded(Operation.MUL, exact, (a, b))
        point = min(max(point_of(exact.size), a.point + b.point - MOST_POINT), a.point + b.point)
        grain = a.grain + b.grain
        unit = _unit(point, grain)
        error = a.interval.size * b.error + b.interval.size * a.error + unit / 2.0 + _in_double(exact, grain, a, b)
        shifts = (0, 0, a.point + b.point - point)
        return self._emitted(Step.MUL, (a, b), shifts, point, exact.wider(unit), error, grain)

    def quotient(self, a: Value, b: Value) -> Value:
        """a / b."""
        exact = self._bounded(Operation.DIV, enclosed(Operation.DIV, (a.interval, b.interval)), (a, b))
        least = min(abs(b.interval.lower), abs(b.interval.upper))
        if least < 2.0 ** (1 - b.point):
            raise UnboundedError(f"a / b with b in {b.interval}", "b may round to 0 in 32 bits.")
        point = min(point_of(exact.size), ROOM + a.point - b.point)
        by = a.point - b.point - point
        lost = 2.0 ** (by - a.point) / least if by > 0 else 0.0
        error = (a.error + exact.size * b.error) / least + 2.0**-point + lost + ROUNDED * exact.size
        return self._emitted(Step.DIV, (a, b), (by, 0, 0), point, exact.wider(2.0**-point + lost), error)

    def root(self, a: Value) -> Value:
        """√a; what rounding put below 0 counts as 0."""
        slack = 2.0 ** (8 - a.point)
        if a.interval.lower < -slack:
            raise UnboundedError(f"the root of a number in {a.interval}", "it may be negative.")
        a = self.extreme(Step.MAX, a, self.constant(0.0, a.point))
        point = min(point_of(math.sqrt(a.interval.upper)), (a.point + ROOM) // 2)
        exact = enclosed(Operation.SQRT, (a.interval.within(0.0, math.inf),))
        by = a.point - 2 * point
        coarse = 2.0 ** (by - a.point) if by > 0 else 0.0
        error = _of_root(a.error + coarse, exact.lower) + 2.0**-point + ROUNDED * exact.size
        return self._emitted(Step.ROOT, (a,), (by, 0), point, exact.wider(2.0**-point + math.sqrt(coarse)), error)

    def sign_changed(self, a: Value) -> Value:
        """−a."""
        turned = Interval(-a.interval.upper, -a.interval.lower)
        return self._emitted(Step.NEG, (a,), (0, 0), a.point, turned, a.error, a.grain)

    def magnitude(self, a: Value) -> Value:
        """|a|."""
        found = enclosed(Operation.ABS, (a.interval,))
        return self._emitted(Step.ABS, (a,), (0, 0), a.point, found, a.error, a.grain)

    def floor(self, a: Value) -> Value:
        """The largest whole number that is not above a."""
        found = enclosed(Operation.FLOOR, (a.interval,))
        if a.point <= 0:
            return replace(self._doubted(a, a.error), error=0.0)
        point = point_of(found.size)
        value = self._emitted(Step.FLOOR, (a,), (a.point, -point), point, found, grain=0)
        return self._doubted(value, a.error) if found.lower < found.upper else value

    def extreme(self, step: Step, a: Value, b: Value) -> Value:
        """The smaller (MIN) or the larger (MAX) of two."""
        operation = Operation.MIN if step is Step.MIN else Operation.MAX
        exact = enclosed(operation, (a.interval, b.interval))
        common, lost = _common(a, b)
        point = min(point_of(exact.wider(2.0 * lost).size), common)
        shifts = (a.point - common, b.point - common, common - point)
        grain = max(a.grain, b.grain)
        unit = _unit(point, grain)
        error = max(a.error, b.error) + (lost + unit) / 2.0
        return self._emitted(step, (a, b), shifts, point, exact.wider(lost + unit), error, grain)

    def compared(self, step: Step, a: Value, b: Value) -> Value:
        """1 where a < b, a ≤ b or a = b, else 0."""
        common, lost = _common(a, b)
        value = self._emitted(step, (a, b), (a.point - common, b.point - common, 0), 0, Interval(0.0, 1.0))
        return self._doubted(value, a.error + b.error + lost)

    def logic(self, step: Step, *operands: Value) -> Value:
        """And, or, not."""
        return self._emitted(step, operands, (0,) * (len(operands) + 1), 0, Interval(0.0, 1.0))

    def choice(
        self, condition: Value, a: Value, b: Value, narrowed: tuple[Interval, Interval], *, compares: bool = False
    ) -> Value:
        """A where the condition holds, else b.

        Args:
            condition: of the choice. a, b: what is chosen from. narrowed: what each can be where it is chosen.
            compares: whether the condition compares a with b: where it comes out otherwise, these are near each other.
        """
        if condition.interval.lower > 0.0 or condition.interval.upper <= 0.0:
            return a if condition.interval.lower > 0.0 else b
        exact = narrowed[0].hull(narrowed[1])
        point = min(point_of(exact.size), max(a.point, b.point))
        grain = max(a.grain, b.grain)
        coarser = _unit(point, grain)
        shifts = (a.point - point, b.point - point)
        error = max(a.error, b.error) + coarser / 2.0
        if compares:
            condition, error = condition.sure, error + a.error + b.error + _common(a, b)[1]
        return self._emitted(Step.SELECT, (condition, a, b), shifts, point, exact.wider(coarser), error, grain)

    def _doubted(self, value: Value, margin: float) -> Value:
        """The value, which is in doubt where what decides it is within a margin."""
        if margin == 0.0:
            return value
        self.margins[value.index] = max(margin, self.margins.get(value.index, 0.0))
        return replace(value, doubts=value.doubts | {value.index})

    def _factor(self, a: Value) -> Value:
        """With as many bits as a factor has; one that has no more stays as it is."""
        return self.moved(a, min(a.point, point_of(a.interval.size, self.factor)))

    def _bounded(self, operation: Operation, found: Interval, operands: tuple[Value, ...]) -> Interval:
        if found.bounded and found.size < 2.0**MOST_POINT:
            return found
        given = " and ".join(str(each.interval) for each in operands)
        raise UnboundedError(f"'{operation}' of {given}", f"its range {found} is too large.")

    def _emitted(
        self,
        step: Step,
        operands: tuple[Value, ...],
        shifts: tuple[int, ...],
        point: int,
        interval: Interval,
        error: float = 0.0,
        grain: int | None = None,
        value: int = 0,
    ) -> Value:
        each = IntegerInstruction(step, tuple(a.index for a in operands), shifts, value)
        if each not in self._known:
            self._known[each] = len(self.inputs) + len(self.instructions)
            self.instructions.append(each)
        doubts = frozenset[int]().union(*(a.doubts for a in operands))
        grain = point if grain is None else min(grain, point)
        return Value(self._known[each], point, grain, interval, error, doubts)


def point_of(size: float, word: int = WORD) -> int:
    """The finest binary point with which a magnitude and two more units fit into a word."""
    if size == 0.0:
        return ROOM
    point = word - 1 - math.frexp(size)[1]
    point = point if math.ldexp(size, point) + 2.0 <= 2 ** (word - 1) - 1 else point - 1
    return min(point, MOST_POINT)


def _unit(point: int, grain: int) -> float:
    """One unit of a binary point, where a value must be rounded to it."""
    return 2.0**-point if grain > point else 0.0


def _in_double(exact: Interval, grain: int, a: Value, b: Value) -> float:
    """What double precision rounds a sum or a product by; none of few bits."""
    few = exact.size * 2.0**grain <= 1.0 / ROUNDED
    return 0.0 if few and a.error == b.error == 0.0 else ROUNDED * exact.size


def _common(a: Value, b: Value) -> tuple[int, float]:
    """A binary point at which both fit into 64 bits with room for a sum, and one unit of it where one is rounded."""
    common = min(max(a.point, b.point), min(a.point, b.point) + ROOM)
    return common, _unit(common, max(a.grain, b.grain))


def _of_root(error: float, least: float) -> float:
    """How far roots of numbers that differ by an error are apart, the smaller root at least so large."""
    return math.sqrt(error) if least == 0.0 else min(math.sqrt(error), error / least)
