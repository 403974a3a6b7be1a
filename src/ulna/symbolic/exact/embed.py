"""Brings expressions into a field of fractions whose generators are sines, exponentials, logarithms and roots.

Every rewriting used holds wherever all parts of the expression are real numbers, the domain on which plants live:
log(u v) = log u + log v with u, v > 0, sqrt(p^2) = p sign(p), addition theorems, exp(log u) = u.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import ParamSpec, TypeVar

import sympy as sp

from ulna.symbolic.exact.attempts import Attempt, attempt_expecting
from ulna.symbolic.exact.ball import is_leaf
from ulna.symbolic.exact.circular import (
    arccosine,
    arcsine,
    arctangent,
    arctangent_of_two,
    exponential,
    hyperbolic,
    sine_cosine,
)
from ulna.symbolic.exact.field import Element, ExactAlgebraError, Field, NoRoomError, NotEmbeddableError
from ulna.symbolic.exact.generators import Generators
from ulna.symbolic.exact.positive import logarithm, modulus, rational_power, sign
from ulna.symbolic.exact.scales import OtherLettersError, Scales

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

_GREATEST_POWER = 200
_GREATEST_ROOT_ORDER = 24
_GREATEST_ROOM = 256


def embed(expressions: Sequence[sp.Expr]) -> tuple[Field, list[Element]]:
    """The expressions as elements of one field.

    Raises:
        ExactAlgebraError: NotEmbeddableError, TooLargeError or VanishingDenominatorError.
    """
    scales = Scales()
    room = 16
    while True:
        embedding = _Embedding(room=room, scales=scales, root_order=_root_order(expressions))
        try:
            embedding.prepare(expressions)
            return embedding.made.ring, [embedding.element(one) for one in expressions]
        except OtherLettersError:
            continue
        except NoRoomError as error:
            room *= 2
            if room > _GREATEST_ROOM:
                raise NotEmbeddableError(f"more than {_GREATEST_ROOM} generators") from error


def attempt_exactly(
    seconds: float,
    what: str,
    function: Callable[Arguments, Result],
    /,
    *arguments: Arguments.args,
    **keywords: Arguments.kwargs,
) -> Attempt[Result]:
    """As `attempt`, for computations in a field: they fail by an ExactAlgebraError or too deep a nesting only."""
    return attempt_expecting((ExactAlgebraError, RecursionError), seconds, what, function, *arguments, **keywords)


def _root_order(expressions: Sequence[sp.Expr]) -> int:
    """The common multiple of the orders of all roots that can come up; 2 for the cosine of an arcsine and the like."""
    orders = [2 if any(one.has(sp.asin, sp.acos, sp.atan, sp.atan2, sp.asinh, sp.acosh) for one in expressions) else 1]
    for one in expressions:
        orders.extend(int(power.exp.q) for power in one.atoms(sp.Pow) if isinstance(power.exp, sp.Rational))
        # Sines of multiples of pi are roots of second order, if they are roots at all.
        orders.append(2 if one.has(sp.pi) else 1)
    order = math.lcm(*orders)
    if order > _GREATEST_ROOT_ORDER:
        raise NotEmbeddableError("roots of too many orders")
    return order


class _Embedding:
    """The translation of SymPy nodes to elements of one field."""

    def __init__(self, *, room: int, scales: Scales, root_order: int) -> None:
        self.made = Generators(room=room, scales=scales, root_order=root_order, translate=self.element)
        self._memory: dict[sp.Basic, Element] = {}

    def prepare(self, expressions: Sequence[sp.Expr]) -> None:
        """Translate roots and logarithms first, small ones before large ones: their arguments are positive."""
        kernels: set[sp.Expr] = set()
        for one in expressions:
            kernels |= {power for power in one.atoms(sp.Pow) if power.exp.is_Rational and not power.exp.is_Integer}
            kernels |= one.atoms(sp.log)
        for kernel in sorted(kernels, key=lambda one: (sp.count_ops(one), str(one))):
            self.element(kernel)

    def element(self, one: sp.Basic) -> Element:
        """The expression as an element."""
        known = self._memory.get(one)
        if known is None:
            known = self._memory[one] = self._translated(one)
        return known

    def _translated(self, one: sp.Basic) -> Element:
        if isinstance(one, sp.Number):
            return self._number(one)
        if one is sp.E:
            return exponential(self.made, self.made.one)
        if is_leaf(one) or isinstance(one, sp.NumberSymbol):
            return self.made.call(one)
        if isinstance(one, sp.Add):
            return self.made.ring.total([self.element(term) for term in one.args])
        if isinstance(one, sp.Mul):
            product = self.made.one
            for factor in one.args:
                product = self.made.ring.multiply(product, self.element(factor))
            return product
        if isinstance(one, sp.Pow):
            return self._power(one.base, one.exp)
        return self._function(one)

    def _number(self, number: sp.Number) -> Element:
        exact = sp.Rational(number) if isinstance(number, sp.Float) and number.is_finite else number
        if not isinstance(exact, sp.Rational) or not exact.is_finite:
            raise NotEmbeddableError(f"{number} is not a real number")
        return self.made.ring.rational(exact)

    def _power(self, base: sp.Expr, exponent: sp.Expr) -> Element:
        ring = self.made.ring
        if isinstance(exponent, sp.Integer):
            if abs(int(exponent)) > _GREATEST_POWER:
                raise NotEmbeddableError(f"power {exponent} is too high to be multiplied out")
            return ring.power(self.element(base), int(exponent))
        if isinstance(exponent, sp.Rational):
            return rational_power(self.made, self.element(base), exponent)
        if base is sp.E:
            return exponential(self.made, self.element(exponent))
        # A real power with a general exponent has a positive base.
        return exponential(self.made, ring.multiply(self.element(exponent), logarithm(self.made, self.element(base))))

    def _function(self, one: sp.Basic) -> Element:
        rule = _RULES.get(type(one))
        if rule is not None and len(one.args) == 1:
            return rule(self.made, self.element(one.args[0]))
        if isinstance(one, sp.atan2):
            return arctangent_of_two(self.made, self.element(one.args[0]), self.element(one.args[1]))
        if isinstance(one, sp.Piecewise):
            return self.made.call(one)
        if isinstance(one, sp.Function):
            # Without known relations: equal arguments give equal values, no more.
            canonical = one.func(*[self.made.ring.expression(self.element(argument)) for argument in one.args])
            return self.made.call(canonical) if isinstance(canonical, sp.Function) else self.element(canonical)
        raise NotEmbeddableError(f"{type(one).__name__} has no exact form")


_RULES: dict[type, Callable[[Generators, Element], Element]] = {
    sp.sin: lambda made, u: sine_cosine(made, u)[0],
    sp.cos: lambda made, u: sine_cosine(made, u)[1],
    sp.tan: lambda made, u: made.ratio(*sine_cosine(made, u)),
    sp.cot: lambda made, u: made.ring.inverse(made.ratio(*sine_cosine(made, u))),
    sp.sec: lambda made, u: made.ring.inverse(sine_cosine(made, u)[1]),
    sp.csc: lambda made, u: made.ring.inverse(sine_cosine(made, u)[0]),
    sp.exp: exponential,
    sp.log: logarithm,
    sp.sinh: lambda made, u: hyperbolic(made, u)[0],
    sp.cosh: lambda made, u: hyperbolic(made, u)[1],
    sp.tanh: lambda made, u: made.ratio(*hyperbolic(made, u)),
    sp.coth: lambda made, u: made.ring.inverse(made.ratio(*hyperbolic(made, u))),
    sp.sech: lambda made, u: made.ring.inverse(hyperbolic(made, u)[1]),
    sp.csch: lambda made, u: made.ring.inverse(hyperbolic(made, u)[0]),
    sp.asin: arcsine,
    sp.acos: arccosine,
    sp.atan: arctangent,
    sp.Abs: modulus,
    sp.sign: sign,
    sp.asinh: lambda made, u: _log_with_root(made, u, 1),
    sp.acosh: lambda made, u: _log_with_root(made, u, -1),
    sp.atanh: lambda made, u: made.ring.multiply(
        made.rational(1, 2), logarithm(made, made.ratio(made.ring.add(made.one, u), made.subtract(made.one, u)))
    ),
}


def _log_with_root(made: Generators, argument: Element, shift: int) -> Element:
    """log(u + sqrt(u^2 + 1)) is asinh u, log(u + sqrt(u^2 - 1)) is acosh u."""
    square = made.ring.power(argument, 2)
    root = rational_power(made, made.ring.add(square, made.rational(shift)), sp.Rational(1, 2))
    return logarithm(made, made.ring.add(argument, root))
