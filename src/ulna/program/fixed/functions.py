"""Functions in fixed point: polynomials over the interval of their argument; sine and cosine after whole turns."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from ulna.program.fixed.builder import Integers, UnboundedError, Value
from ulna.program.fixed.integers import WORD, Step
from ulna.program.fixed.interval import EVERYTHING, Interval, enclosed
from ulna.program.fixed.polynomial import Piece, exact_function, pieces_of, variation
from ulna.program.instructions import Operation

_ROUND = {Operation.SIN: 0.0, Operation.COS: math.pi / 2}
"""Functions of a whole turn, and what makes a sine of each."""
_FEW = 1.6
"""Radians up to which a sine needs no whole turns taken off."""
WRITTEN = 2.0**-48
"""What a function that is written out in double precision is off by at most, of its largest value."""


def function_of(w: Integers, operation: Operation, a: Value, part: float) -> Value:
    """The function of a value. part: the error that is aimed at, of the largest value."""
    return _with_error_of(a, _computed(w, operation, a.sure, part), str(operation), exact_function(str(operation)))


def _computed(w: Integers, operation: Operation, a: Value, part: float) -> Value:
    if operation in _ROUND and a.interval.size > _FEW:
        return _sine(w, operation, a, part)
    if operation is Operation.TAN and a.interval.size >= math.pi / 2:
        raise UnboundedError(f"'{operation}' of {a.interval}", "it has a pole there.")
    return _fitted(w, str(operation), exact_function(str(operation)), a, operation, part)


def power_of(w: Integers, a: Value, exponent: float, part: float) -> Value:
    """A constant power; whole ones as products."""
    whole = int(exponent) if exponent == int(exponent) and abs(exponent) <= 16 else None
    if whole is not None and whole > 0:
        value = a
        for _ in range(whole - 1):
            value = w.product(value, a)
        return value
    if a.interval.lower <= 0.0:
        raise UnboundedError(f"a power {exponent:g} of a number in {a.interval}", "it may be 0 or negative.")
    function = exact_function("pow", exponent)
    name = f"power {exponent:g}"
    return _with_error_of(a, _fitted(w, name, function, a.sure, None, part), name, function)


def _with_error_of(a: Value, value: Value, name: str, function: Callable[[float], float]) -> Value:
    """The function's value: its own error, and what that of its argument makes of it."""
    own = value.error + WRITTEN * value.interval.size
    return replace(value, error=own + variation(name, function, a.interval, a.error), doubts=a.doubts)


def _sine(w: Integers, operation: Operation, a: Value, part: float) -> Value:
    """sin(r) with the sign of (−1)^n, r = a + shift − n π, |r| ≤ π/2."""
    moved = w.sum(Step.ADD, a, w.constant(_ROUND[operation])) if _ROUND[operation] else a
    turns = w.sum(Step.ADD, _exact_product(w, moved, 1.0 / math.pi), w.constant(0.5))
    # Any whole number near the true one gives the same sine: only what is left over counts.
    whole, uncertain = w.floor(turns).sure, math.pi * turns.error
    rest = _limited(w, w.sum(Step.SUB, moved, _exact_product(w, whole, math.pi)), math.pi / 2)
    value = _fitted(w, str(Operation.SIN), math.sin, rest.sure, Operation.SIN, part)
    value = replace(value, error=value.error + rest.error + uncertain)
    half = w.floor(w.product(whole, w.constant(0.5)))
    odd = w.compared(Step.LESS, w.sum(Step.ADD, half, half), whole)
    negative = w.sign_changed(value)
    return w.choice(odd.sure, negative, value, (negative.interval, value.interval))


def _exact_product(w: Integers, a: Value, factor: float) -> Value:
    """A product whose factors keep all their bits: what is taken off are whole turns."""
    bits, w.factor = w.factor, WORD
    found = w.product(a, w.constant(factor))
    w.factor = bits
    return found


def _limited(w: Integers, a: Value, most: float) -> Value:
    """What lies within ± most but for rounding."""
    a = w.extreme(Step.MIN, a, w.constant(most))
    return w.extreme(Step.MAX, a, w.constant(-most))


def _fitted(
    w: Integers, name: str, function: Callable[[float], float], a: Value, operation: Operation | None, part: float
) -> Value:
    """A polynomial for each piece of the argument's interval."""
    true = enclosed(operation, (a.interval,)) if operation is not None else _ends(function, a.interval)
    if not true.bounded:
        raise UnboundedError(f"'{name}' of {a.interval}", f"its range {true} is unbounded.")
    pieces, error = pieces_of(function, a.interval, part)
    w.functions[name] = max(error, w.functions.get(name, 0.0))
    conditions = [w.compared(Step.LESS, a, w.constant(piece.middle + piece.half)) for piece in pieces[:-1]]
    # At an edge either piece serves; beyond it by a rounding the argument is limited to the piece.
    beyond = max((w.margins.get(each.index, 0.0) for each in conditions), default=0.0)
    conditions = [each.sure for each in conditions]
    middle = _chosen(w, conditions, [piece.middle for piece in pieces])
    half = max(piece.half for piece in pieces)
    t = _limited(w, w.product(w.sum(Step.SUB, a, middle), w.constant(1.0 / half)), 1.0)
    value = w.extreme(Step.MIN, _horner(w, conditions, pieces, t), w.constant(true.upper))
    value = w.extreme(Step.MAX, value, w.constant(true.lower))
    return replace(value, error=value.error + error + variation(name, function, a.interval, beyond))


def _horner(w: Integers, conditions: list[Value], pieces: tuple[Piece, ...], t: Value) -> Value:
    """Σ c_k t^k; in t² where every other coefficient is 0."""
    columns = list(zip(*(piece.coefficients for piece in pieces), strict=True))
    used = [k for k, column in enumerate(columns) if any(column)]
    parity = used[0] % 2 if used and len({k % 2 for k in used}) == 1 and len(used) > 1 else None
    if parity is not None:
        columns, step = columns[parity::2], w.product(t, t)
    else:
        step = t
    value = _chosen(w, conditions, list(columns[-1]))
    for column in reversed(columns[:-1]):
        value = w.product(value, step)
        if any(column):
            value = w.sum(Step.ADD, value, _chosen(w, conditions, list(column)))
    return w.product(value, t) if parity == 1 else value


def _chosen(w: Integers, conditions: list[Value], numbers: list[float]) -> Value:
    """The number of the piece."""
    value = w.constant(numbers[-1])
    for condition, number in zip(reversed(conditions), reversed(numbers[:-1]), strict=True):
        other = w.constant(number)
        value = w.choice(condition, other, value, (other.interval, value.interval))
    return value


def _ends(function: Callable[[float], float], over: Interval) -> Interval:
    """Of a monotonic function."""
    try:
        ends = function(over.lower), function(over.upper)
    except (ArithmeticError, ValueError):
        return EVERYTHING
    return Interval(min(ends), max(ends))
