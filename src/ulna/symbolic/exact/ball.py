"""Numbers with rigorous error bounds for expressions: midpoint-radius (ball) arithmetic on a flat instruction list.

Ball arithmetic decides "not zero" with certainty: a ball that excludes 0 is a proof at that point. F. Johansson,
"Arb: efficient arbitrary-precision midpoint-radius interval arithmetic", IEEE Trans. Computers 66 (2017).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import flint
import sympy as sp
from flint import arb, fmpq
from sympy.core.function import AppliedUndef
from sympy.logic.boolalg import BooleanFunction

Step = tuple[Callable[..., Any], tuple[int, ...]]

_NAN = arb("nan")


@dataclass(frozen=True, slots=True, kw_only=True)
class Tape:
    """Expressions as a list of steps; step k writes value `len(leaves) + k`, `roots` are the places of the results."""

    leaves: tuple[sp.Basic, ...]
    steps: tuple[Step, ...]
    roots: tuple[int, ...]

    def __call__(self, point: Mapping[sp.Basic, sp.Expr], digits: int = 40) -> list[arb]:
        """Balls that contain the exact values; a value that does not exist as a real number is a NaN ball."""
        with flint.ctx.workprec(math.ceil(digits * 3.33) + 16):
            values: list[Any] = [exact_ball(point[leaf]) for leaf in self.leaves]
            for function, places in self.steps:
                values.append(function(*[values[place] for place in places]))
            return [values[place] for place in self.roots]


def is_leaf(expression: sp.Basic) -> bool:
    """True for what gets a value of its own: symbols, undefined functions and their derivatives."""
    return isinstance(expression, sp.Symbol | AppliedUndef | sp.Derivative | sp.Integral | sp.Subs)


def leaves_of(expressions: Sequence[sp.Basic]) -> tuple[sp.Basic, ...]:
    """Everything in the expressions that needs a value, in a fixed order."""
    found: set[sp.Basic] = set()
    seen: set[sp.Basic] = set()
    waiting = list(expressions)
    while waiting:
        one = waiting.pop()
        if one in seen:
            continue
        seen.add(one)
        if is_leaf(one):
            found.add(one)
        else:
            waiting.extend(one.args)
    return tuple(sorted(found, key=lambda leaf: (str(leaf), leaf.sort_key())))


def tape(expressions: Sequence[sp.Basic]) -> Tape:
    """The instruction list of the expressions; equal subexpressions are evaluated once."""
    leaves = leaves_of(expressions)
    place: dict[sp.Basic, int] = {leaf: number for number, leaf in enumerate(leaves)}
    steps: list[Step] = []
    for root in expressions:
        waiting = [root]
        while waiting:
            one = waiting[-1]
            if one in place:
                waiting.pop()
                continue
            function, arguments = _step(one)
            missing = [argument for argument in arguments if argument not in place]
            if missing:
                waiting.extend(missing)
                continue
            waiting.pop()
            place[one] = len(leaves) + len(steps)
            steps.append((function, tuple(place[argument] for argument in arguments)))
    return Tape(leaves=leaves, steps=tuple(steps), roots=tuple(place[root] for root in expressions))


def exact_ball(value: sp.Basic | float) -> arb:
    """The ball of a rational number (radius: rounding only) or of another real constant."""
    number = sp.sympify(value)
    if isinstance(number, sp.Float):
        number = sp.Rational(number)
    if isinstance(number, sp.Rational):
        return arb(fmpq(int(number.p), int(number.q)))
    constant = tape([number])
    if constant.leaves:
        return _NAN
    values: list[Any] = []
    for function, places in constant.steps:
        values.append(function(*[values[place] for place in places]))
    return values[constant.roots[0]]


def _sum(*terms: arb) -> arb:
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def _product(*factors: arb) -> arb:
    total = factors[0]
    for factor in factors[1:]:
        total = total * factor
    return total


def _power(base: arb, exponent: arb) -> arb:
    return base**exponent


def _integer_power(number: int) -> Callable[[arb], arb]:
    def power(base: arb) -> arb:
        return base**number if number >= 0 else 1 / base ** (-number)

    return power


def _root_power(numerator: int, denominator: int) -> Callable[[arb], arb]:
    # The principal root of a negative number is not real, for odd denominators too: NaN, as Arb gives it.
    def power(base: arb) -> arb:
        root = base.sqrt() if denominator == 2 else (base.log() / denominator).exp() if base > 0 else _NAN
        return root**numerator if numerator >= 0 else 1 / root ** (-numerator)

    return power


def _sign(value: arb) -> arb:
    return value.sgn()


def _step_function(value: arb) -> arb:
    return (1 + value.sgn()) / 2


_FUNCTIONS: dict[type, Callable[..., Any]] = {
    sp.Add: _sum,
    sp.Mul: _product,
    sp.exp: arb.exp,
    sp.log: arb.log,
    sp.sin: arb.sin,
    sp.cos: arb.cos,
    sp.tan: arb.tan,
    sp.cot: arb.cot,
    sp.sec: arb.sec,
    sp.csc: arb.csc,
    sp.asin: arb.asin,
    sp.acos: arb.acos,
    sp.atan: arb.atan,
    sp.acot: lambda value: (1 / value).atan(),
    sp.atan2: arb.atan2,
    sp.sinh: arb.sinh,
    sp.cosh: arb.cosh,
    sp.tanh: arb.tanh,
    sp.coth: arb.coth,
    sp.sech: arb.sech,
    sp.csch: arb.csch,
    sp.asinh: arb.asinh,
    sp.acosh: arb.acosh,
    sp.atanh: arb.atanh,
    sp.Abs: abs,
    sp.sign: _sign,
    sp.Heaviside: lambda value, *_: _step_function(value),
    sp.erf: arb.erf,
    sp.LambertW: lambda value, *branch: value.lambertw() if not branch else _NAN,
    sp.sinc: arb.sinc,
    sp.Max: lambda *values: _extreme(values, arb.max),
    sp.Min: lambda *values: _extreme(values, arb.min),
}


def _extreme(values: Sequence[arb], choose: Callable[[arb, arb], arb]) -> arb:
    best = values[0]
    for value in values[1:]:
        best = choose(best, value)
    return best


def _step(one: sp.Basic) -> tuple[Callable[..., Any], tuple[sp.Basic, ...]]:
    """What to call for this node, and on which other nodes."""
    if isinstance(one, sp.Number):
        return _constant(one), ()
    if isinstance(one, sp.NumberSymbol):
        return {sp.pi: arb.pi, sp.E: arb.const_e}.get(one, _evalf_constant(one)), ()
    if isinstance(one, sp.Pow):
        if isinstance(one.exp, sp.Integer):
            return _integer_power(int(one.exp)), (one.base,)
        if isinstance(one.exp, sp.Rational):
            return _root_power(int(one.exp.p), int(one.exp.q)), (one.base,)
        return _power, (one.base, one.exp)
    if isinstance(one, sp.Piecewise):
        return _piecewise(one)
    known = _FUNCTIONS.get(type(one))
    if known is not None:
        return known, one.args
    if isinstance(one, sp.Function):
        return _by_evalf(one.func), one.args
    return (lambda: _NAN), ()


def _constant(number: sp.Number) -> Callable[[], arb]:
    exact = sp.Rational(number) if isinstance(number, sp.Float) and number.is_finite else number
    if not isinstance(exact, sp.Rational) or not exact.is_finite:
        return lambda: _NAN
    numerator, denominator = int(exact.p), int(exact.q)
    return lambda: arb(fmpq(numerator, denominator))


def _evalf_constant(number: sp.NumberSymbol) -> Callable[[], arb]:
    return lambda: _from_evalf(number)


def _by_evalf(function: Callable[..., Any]) -> Callable[..., arb]:
    def value(*arguments: arb) -> arb:
        digits = flint.ctx.dps
        floats = [sp.Float(argument.mid().str(digits + 5, radius=False), digits + 5) for argument in arguments]
        return _from_evalf(function(*floats)) if all(argument.is_finite() for argument in arguments) else _NAN

    return value


def _from_evalf(expression: sp.Expr) -> arb:
    # SymPy gives no error bound: the ball claims ten digits less than were asked for.
    digits = flint.ctx.dps
    value = expression.evalf(digits)
    if not isinstance(value, sp.Float):
        return _NAN
    middle = arb(str(value))
    return middle + arb(0, (abs(middle) + 1).mid() * arb(10) ** (10 - digits))


def _piecewise(one: sp.Expr) -> tuple[Callable[..., Any], tuple[sp.Basic, ...]]:
    branches: list[sp.Basic] = [pair.args[0] for pair in one.args]
    sides: list[sp.Basic] = []
    for pair in one.args:
        for relation in sorted(pair.args[1].atoms(sp.core.relational.Relational), key=str):
            sides.extend(relation.args)

    def value(*values: Any) -> Any:
        known = {side: values[len(branches) + number] for number, side in enumerate(sides)}
        for number, pair in enumerate(one.args):
            truth = _truth(pair.args[1], known)
            if truth is None:
                return _NAN
            if truth:
                return values[number]
        return _NAN

    return value, (*branches, *sides)


def _truth(condition: sp.Basic, known: Mapping[sp.Basic, arb]) -> bool | None:
    """True or false where the balls decide it, else None."""
    if condition in (sp.true, sp.false):
        return bool(condition)
    if isinstance(condition, BooleanFunction):
        parts = [_truth(part, known) for part in condition.args]
        if isinstance(condition, sp.Not):
            return None if parts[0] is None else not parts[0]
        if None in parts:
            return None
        return all(parts) if isinstance(condition, sp.And) else any(parts)
    if isinstance(condition, sp.core.relational.Relational):
        difference = known[condition.lhs] - known[condition.rhs]
        if difference > 0:
            return isinstance(condition, sp.Gt | sp.Ge | sp.Ne)
        if difference < 0:
            return isinstance(condition, sp.Lt | sp.Le | sp.Ne)
    return None
