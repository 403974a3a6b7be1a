"""What the generators of a field stand for, while expressions are being translated (see `embed`)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import sympy as sp

from ulna.symbolic.exact.field import Element, Field, Polynomial
from ulna.symbolic.exact.scales import Scales

PolynomialKey: TypeAlias = frozenset[tuple[tuple[int, ...], int]]


class Generators:
    """The field under construction and the meaning of its generators; made and used by one call of `embed`.

    Args:
        room: the greatest number of generators.
        scales: which multiples of an angle or exponent get letters; kept between attempts.
        root_order: the order of which all root generators are.
        translate: brings a SymPy expression into the field.
    """

    def __init__(self, *, room: int, scales: Scales, root_order: int, translate: Callable[[sp.Basic], Element]) -> None:
        self.ring = Field(room)
        self.one: Element = (self.ring.one, self.ring.one)
        self.scales = scales
        self.root_order = root_order
        self.translate = translate
        self.named: dict[sp.Basic, Element] = {}
        """Symbols, constants, functions without relations, logarithms, inverse functions."""
        self.circular: dict[sp.Expr, tuple[Element, Element]] = {}
        """Angle -> the letters of its sine and cosine."""
        self.exponential: dict[sp.Expr, Element] = {}
        """Exponent -> the letter of its exponential."""
        self.exponent: dict[int, Element] = {}
        """Generator of an exponential -> its exponent."""
        self.logarithm: dict[int, Element] = {}
        """Generator of a logarithm -> the positive element it is the logarithm of."""
        self.inverse_circular: dict[int, Callable[[], tuple[Element, Element]]] = {}
        """Generator of asin, atan, atan2 -> what gives its sine and cosine when they are needed."""
        self.positive: dict[PolynomialKey, Element | None] = {}
        """Irreducible polynomials known to be positive, with their root once it was made."""
        self.sign: dict[PolynomialKey, int] = {}
        """Irreducible polynomials -> the generator of their sign."""

    def call(self, meaning: sp.Expr) -> Element:
        """The generator that stands for this expression, made at the first call."""
        if meaning not in self.named:
            self.named[meaning] = self.ring.element(self.ring.generator(meaning))
        return self.named[meaning]

    def number_of(self, element: Element) -> int | None:
        """The number of the generator that the element is, if it is one."""
        if not element[1].is_one() or len(element[0]) != 1 or element[0].leading_coefficient() != 1:
            return None
        [exponents] = element[0].monoms()
        return None if sum(exponents) != 1 else tuple(exponents).index(1)

    def rational(self, numerator: int, denominator: int = 1) -> Element:
        """A rational number."""
        return self.ring.rational(sp.Rational(numerator, denominator))

    def parts(self, argument: Element) -> list[tuple[sp.Rational, sp.Expr, Element]]:
        """The argument as a sum of number * monomial; each monomial as expression and as element."""
        ring = self.ring
        content = math.gcd(*(int(number) for number in argument[1].coeffs()))
        below = argument[1] // ring.context.constant(content)
        parts: list[tuple[sp.Rational, sp.Expr, Element]] = []
        for exponents, coefficient in argument[0].to_dict().items():
            monomial = ring.make(ring.context.from_dict({exponents: 1}), below)
            number = sp.Rational(int(coefficient), content)
            parts.append((number, ring.expression(monomial), monomial))
        return parts

    def ratio(self, above: Element, below: Element) -> Element:
        """The quotient of two elements."""
        return self.ring.multiply(above, self.ring.inverse(below))

    def subtract(self, first: Element, second: Element) -> Element:
        """The difference."""
        return self.ring.add(first, self.ring.negative(second))


def polynomial_key(polynomial: Polynomial) -> PolynomialKey:
    """A hashable name of the polynomial."""
    return frozenset((tuple(map(int, exponents)), int(number)) for exponents, number in polynomial.to_dict().items())
