"""`Interval`: every value that a number can take, rounded outward; what the scales of fixed point are chosen by."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flint import arb

from ulna.program.instructions import Operation
from ulna.program.lowering.balls import FUNCTIONS


@dataclass(frozen=True, slots=True)
class Interval:
    """lower ≤ value ≤ upper."""

    lower: float
    upper: float

    @property
    def size(self) -> float:
        """The largest magnitude."""
        return max(abs(self.lower), abs(self.upper))

    @property
    def bounded(self) -> bool:
        """Whether both ends are finite."""
        return math.isfinite(self.lower) and math.isfinite(self.upper)

    def wider(self, by: float) -> Interval:
        """Both ends moved outward."""
        return Interval(_down(self.lower - by), _up(self.upper + by))

    def hull(self, other: Interval) -> Interval:
        """The smallest interval around both."""
        return Interval(min(self.lower, other.lower), max(self.upper, other.upper))

    def within(self, lower: float, upper: float) -> Interval:
        """The part between two bounds; where there is none, the nearer bound."""
        low, high = max(self.lower, lower), min(self.upper, upper)
        return Interval(low, high) if low <= high else Interval(*((upper, upper) if low > upper else (lower, lower)))

    def __str__(self) -> str:
        return f"[{self.lower:.4g}, {self.upper:.4g}]"


EVERYTHING = Interval(-math.inf, math.inf)


def enclosed(operation: Operation, operands: tuple[Interval, ...], *, same: bool = False) -> Interval:
    """What an operation can give; everything where that has no bounds.

    Args:
        operation: no comparison and no choice. operands: of it. same: both factors are one value.
    """
    if not all(each.bounded for each in operands):
        return EVERYTHING
    rule = _RULES.get(operation)
    if rule is not None:
        found = _square(operands[0]) if same and operation is Operation.MUL else rule(*operands)
    else:
        found = _by_ball(operation, operands)
    if math.isnan(found.lower) or math.isnan(found.upper):
        return EVERYTHING
    return Interval(_down(found.lower), _up(found.upper))


def _down(value: float) -> float:
    return math.nextafter(value, -math.inf) if value != 0.0 else value


def _up(value: float) -> float:
    return math.nextafter(value, math.inf) if value != 0.0 else value


def _square(a: Interval) -> Interval:
    ends = (a.lower * a.lower, a.upper * a.upper)
    return Interval(0.0 if a.lower < 0.0 < a.upper else min(ends), max(ends))


def _product(a: Interval, b: Interval) -> Interval:
    ends = [p * q for p in (a.lower, a.upper) for q in (b.lower, b.upper)]
    return Interval(min(ends), max(ends))


def _quotient(a: Interval, b: Interval) -> Interval:
    if b.lower <= 0.0 <= b.upper:
        return EVERYTHING
    ends = [p / q for p in (a.lower, a.upper) for q in (b.lower, b.upper)]
    return Interval(min(ends), max(ends))


def _magnitude(a: Interval) -> Interval:
    return Interval(0.0 if a.lower < 0.0 < a.upper else min(abs(a.lower), abs(a.upper)), a.size)


def _by_ball(operation: Operation, operands: tuple[Interval, ...]) -> Interval:
    """Of a function, in ball arithmetic."""
    balls = []
    for each in operands:
        middle = each.lower + (each.upper - each.lower) / 2.0
        balls.append(arb(middle, max(each.upper - middle, middle - each.lower) * (1.0 + 2.0**-50)))
    found = FUNCTIONS[operation](*balls)
    if not found.is_finite():
        return EVERYTHING
    return Interval(float(found.lower()), float(found.upper()))


_RULES = {
    Operation.ADD: lambda a, b: Interval(a.lower + b.lower, a.upper + b.upper),
    Operation.SUB: lambda a, b: Interval(a.lower - b.upper, a.upper - b.lower),
    Operation.MUL: _product,
    Operation.DIV: _quotient,
    Operation.NEG: lambda a: Interval(-a.upper, -a.lower),
    Operation.ABS: _magnitude,
    Operation.FLOOR: lambda a: Interval(float(math.floor(a.lower)), float(math.floor(a.upper))),
    Operation.MIN: lambda a, b: Interval(min(a.lower, b.lower), min(a.upper, b.upper)),
    Operation.MAX: lambda a, b: Interval(max(a.lower, b.lower), max(a.upper, b.upper)),
    Operation.SQRT: lambda a: Interval(math.sqrt(a.lower), math.sqrt(a.upper)) if a.lower >= 0.0 else EVERYTHING,
}
