"""Brings expressions into a field of fractions whose generators are sines, exponentials, logarithms and roots.

Every rewriting used holds wherever all parts of the expression are real numbers, the domain on which plants live:
log(u v) = log u + log v with u, v > 0, sqrt(p^2) = p sign(p), addition theorems, exp(log u) = u.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import sympy as sp

from ulna.symbolic.ball import is_leaf
from ulna.symbolic.field import Element, Field, NoRoomError, Polynomial

PolynomialKey: TypeAlias = frozenset[tuple[tuple[int, ...], int]]


def _key(polynomial: Polynomial) -> PolynomialKey:
    """A hashable name of the polynomial."""
    return frozenset((tuple(map(int, exponents)), int(number)) for exponents, number in polynomial.to_dict().items())


class NotEmbeddableError(Exception):
    """An expression that is no real function of its symbols (infinite, complex, undefined)."""


class _FinerAngleError(Exception):
    """An angle or exponent came up that is no integer multiple of the unit chosen before."""


@dataclass(slots=True, kw_only=True)
class _Kernels:
    """What the generators made so far stand for."""

    units: dict[sp.Expr, int]
    """Canonical angle or exponent -> the denominator of its unit."""
    leaf: dict[sp.Expr, int] = field(default_factory=dict)
    circular: dict[sp.Expr, tuple[Element, Element]] = field(default_factory=dict)
    exponential: dict[sp.Expr, tuple[int, Element]] = field(default_factory=dict)
    logarithm: dict[int, Element] = field(default_factory=dict)
    """Generator of a logarithm -> the element whose modulus it is the logarithm of."""
    inverse_circular: dict[int, tuple[Element, Element]] = field(default_factory=dict)
    """Generator of asin, atan, atan2 -> its sine and cosine."""
    opaque: dict[sp.Expr, int] = field(default_factory=dict)
    positive: dict[PolynomialKey, Element | None] = field(default_factory=dict)
    """Irreducible polynomials known to be positive, with their root generator once made."""
    sign: dict[PolynomialKey, int] = field(default_factory=dict)


def embed(expressions: Sequence[sp.Expr]) -> tuple[Field, list[Element]]:
    """The expressions as elements of one field.

    Raises:
        NotEmbeddableError: if one is no real function of its symbols.
        TooLargeError: if an intermediate polynomial is too large.
        ZeroDivisionError: if a denominator vanishes identically.
    """
    units: dict[sp.Expr, int] = {}
    room = 16
    while True:
        embedding = Embedding(room=room, units=units, root_order=_root_order(expressions))
        try:
            embedding.prepare(expressions)
            return embedding.field, [embedding.element(one) for one in expressions]
        except _FinerAngleError:
            continue
        except NoRoomError as error:
            room *= 2
            if room > 256:
                raise NotEmbeddableError("more than 256 generators") from error


def _root_order(expressions: Sequence[sp.Expr]) -> int:
    orders = [1]
    for one in expressions:
        orders.extend(int(p.exp.q) for p in one.atoms(sp.Pow) if isinstance(p.exp, sp.Rational))
    order = math.lcm(*orders)
    if order > 24:
        raise NotEmbeddableError("roots of too many orders")
    return order


class Embedding:
    """The translation of SymPy nodes to elements of one field; made by `embed`."""

    def __init__(self, *, room: int, units: dict[sp.Expr, int], root_order: int) -> None:
        self.field = Field(room)
        self.root_order = root_order
        self._known = _Kernels(units=units)
        self._memory: dict[sp.Basic, Element] = {}
        self._one: Element = (self.field.one, self.field.one)

    def prepare(self, expressions: Sequence[sp.Expr]) -> None:
        """Translate roots and logarithms first, small ones before large ones: their arguments are positive."""
        kernels: set[sp.Expr] = set()
        for one in expressions:
            kernels |= {p for p in one.atoms(sp.Pow) if isinstance(p.exp, sp.Rational) and not p.exp.is_Integer}
            kernels |= one.atoms(sp.log)
        for kernel in sorted(kernels, key=lambda one: (one.count_ops(), str(one))):
            self.element(kernel)

    def element(self, one: sp.Basic) -> Element:
        """The expression as an element."""
        known = self._memory.get(one)
        if known is None:
            known = self._memory[one] = self._translated(one)
        return known

    def _translated(self, one: sp.Basic) -> Element:
        ring = self.field
        if isinstance(one, sp.Rational):
            if not one.is_finite:
                raise NotEmbeddableError(f"{one} is no number")
            return ring.rational(one)
        if isinstance(one, sp.Float):
            return self.element(sp.Rational(one))
        if one is sp.E:
            return self._exponential(self._one)
        if is_leaf(one) or isinstance(one, sp.NumberSymbol):
            if one not in self._known.leaf:
                self._known.leaf[one] = ring.generator(one)
            return ring.element(self._known.leaf[one])
        if isinstance(one, sp.Add):
            return ring.total([self.element(term) for term in one.args])
        if isinstance(one, sp.Mul):
            product = self._one
            for factor in one.args:
                product = ring.multiply(product, self.element(factor))
            return product
        if isinstance(one, sp.Pow):
            return self._pow(one.base, one.exp)
        return self._function(one)

    def _pow(self, base: sp.Expr, exponent: sp.Expr) -> Element:
        ring = self.field
        if isinstance(exponent, sp.Integer):
            if abs(int(exponent)) > 200:
                raise NotEmbeddableError(f"power {exponent} is too high to be multiplied out")
            return ring.power(self.element(base), int(exponent))
        if isinstance(exponent, sp.Rational):
            return self._rational_power(self.element(base), exponent)
        if base is sp.E:
            return self._exponential(self.element(exponent))
        return self._exponential(ring.multiply(self.element(exponent), self._logarithm(self.element(base))))

    def _function(self, one: sp.Basic) -> Element:
        ring = self.field
        rule = _RULES.get(type(one))
        if rule is not None and len(one.args) == 1:
            return rule(self, self.element(one.args[0]))
        if isinstance(one, sp.atan2):
            return self._atan2(*[self.element(argument) for argument in one.args])
        if isinstance(one, sp.Piecewise):
            return self._opaque(one)
        if isinstance(one, sp.Function):
            return self._opaque(one.func(*[ring.expression(self.element(argument)) for argument in one.args]))
        raise NotEmbeddableError(f"{type(one).__name__} has no exact form")

    def _opaque(self, canonical: sp.Expr) -> Element:
        if not isinstance(canonical, sp.Function):
            return self.element(canonical)
        if canonical not in self._known.opaque:
            self._known.opaque[canonical] = self.field.generator(canonical)
        return self.field.element(self._known.opaque[canonical])

    # Angles and exponents: sums of rational multiples of canonical monomials.

    def _parts(self, argument: Element) -> list[tuple[sp.Rational, sp.Expr, Element]]:
        """The argument as a sum of number * monomial; each monomial as expression (the key) and as element."""
        ring = self.field
        content = int(argument[1].content())
        below = argument[1] // ring.context.constant(content)
        parts: list[tuple[sp.Rational, sp.Expr, Element]] = []
        for exponents, coefficient in argument[0].to_dict().items():
            monomial = ring.make(ring.context.from_dict({exponents: 1}), below)
            number = sp.Rational(int(coefficient), content)
            parts.append((number, ring.expression(monomial), monomial))
        return parts

    def _multiple(self, number: sp.Rational, key: sp.Expr) -> tuple[int, int]:
        """(n, D) with number = n / D, where 1/D is the unit chosen for this key."""
        unit = self._known.units.setdefault(key, int(number.q))
        if unit % int(number.q):
            self._known.units[key] = math.lcm(unit, int(number.q))
            raise _FinerAngleError
        return int(number.p) * (unit // int(number.q)), unit

    def _single(self, monomial: Element) -> int | None:
        """The number of the generator that the element is, if it is one."""
        if not monomial[1].is_one():
            return None
        [exponents] = monomial[0].monoms()
        if sum(exponents) != 1:
            return None
        return tuple(exponents).index(1)

    def _exponential(self, argument: Element) -> Element:
        ring = self.field
        result = self._one
        for number, key, monomial in self._parts(argument):
            generator = self._single(monomial)
            if generator in self._known.logarithm:
                power = self._rational_power(self._known.logarithm[generator], number)
            else:
                times, unit = self._multiple(number, key)
                if key not in self._known.exponential:
                    new = ring.generator(sp.exp(key / unit))
                    self._known.exponential[key] = (new, ring.multiply(monomial, ring.rational(sp.Rational(1, unit))))
                    self._known.positive[_key(ring.variables[new])] = None
                power = ring.power(ring.element(self._known.exponential[key][0]), times)
            result = ring.multiply(result, power)
        return result

    def _sine_cosine(self, argument: Element) -> tuple[Element, Element]:
        ring = self.field
        sine, cosine = (ring.none, ring.one), self._one
        for number, key, monomial in self._parts(argument):
            s, c = self._sine_cosine_of_part(number, key, monomial)
            sine, cosine = (
                ring.add(ring.multiply(sine, c), ring.multiply(cosine, s)),
                ring.add(ring.multiply(cosine, c), ring.negative(ring.multiply(sine, s))),
            )
        return sine, cosine

    def _sine_cosine_of_part(self, number: sp.Rational, key: sp.Expr, monomial: Element) -> tuple[Element, Element]:
        ring = self.field
        if key is sp.pi:
            values = sp.sin(number * sp.pi), sp.cos(number * sp.pi)
            if not any(value.has(sp.sin, sp.cos) for value in values) and self._fits_roots(values):
                return self.element(values[0]), self.element(values[1])
        times, unit = self._multiple(number, key)
        generator = self._single(monomial)
        if unit == 1 and generator in self._known.inverse_circular:
            sine, cosine = self._known.inverse_circular[generator]
        else:
            if key not in self._known.circular:
                angle = key / unit
                c, s = ring.generator(sp.cos(angle)), ring.generator(sp.sin(angle))
                ring.relate(s, 2, ring.one - ring.variables[c] ** 2)
                self._known.circular[key] = ring.element(s), ring.element(c)
            sine, cosine = self._known.circular[key]
        return self._angle_multiple(sine, cosine, times)

    def _fits_roots(self, values: Sequence[sp.Expr]) -> bool:
        return all(self.root_order % _root_order([value]) == 0 for value in values)

    def _angle_multiple(self, sine: Element, cosine: Element, times: int) -> tuple[Element, Element]:
        ring = self.field
        if abs(times) > 60:
            raise NotEmbeddableError("angle multiple too high")
        s, c = (ring.none, ring.one), self._one
        for _ in range(abs(times)):
            s, c = (
                ring.add(ring.multiply(s, cosine), ring.multiply(c, sine)),
                ring.add(ring.multiply(c, cosine), ring.negative(ring.multiply(s, sine))),
            )
        return (ring.negative(s) if times < 0 else s), c

    # Signs, roots and logarithms: through the irreducible factors of the argument.

    def _factors(self, element: Element) -> tuple[sp.Rational, list[tuple[Polynomial, int]]]:
        """The number and the irreducible factors with their (possibly negative) exponents."""
        top, above = element[0].factor()
        bottom, below = element[1].factor()
        number = sp.Rational(int(top), int(bottom))
        return number, [(p, int(e)) for p, e in above] + [(p, -int(e)) for p, e in below]

    def _sign_of(self, polynomial: Polynomial) -> int:
        """1 or -1 where it is known, else 0."""
        if _key(polynomial) in self._known.positive:
            return 1
        if _key(-polynomial) in self._known.positive:
            return -1
        expression = self.field.polynomial(polynomial)
        if expression.is_positive:
            self._known.positive[_key(polynomial)] = None
            return 1
        if expression.is_negative:
            self._known.positive[_key(-polynomial)] = None
            return -1
        return 0

    def _declare_positive(self, polynomial: Polynomial) -> None:
        self._known.positive.setdefault(_key(polynomial), None)
        for one, value in ((polynomial, 1), (-polynomial, -1)):
            if _key(one) in self._known.sign:
                self.field.relate(self._known.sign[_key(one)], 1, self.field.context.constant(value))

    def _sign(self, element: Element) -> Element:
        ring = self.field
        if element[0].is_zero():
            raise NotEmbeddableError("the sign of zero")
        number, factors = self._factors(element)
        result = ring.rational(sp.Integer(1 if number > 0 else -1))
        for polynomial, exponent in factors:
            if exponent % 2 == 0:
                continue
            known = self._sign_of(polynomial)
            if known:
                result = ring.multiply(result, ring.rational(sp.Integer(known)))
                continue
            if _key(polynomial) not in self._known.sign:
                new = ring.generator(sp.sign(ring.polynomial(polynomial)))
                ring.relate(new, 2, ring.one)
                self._known.sign[_key(polynomial)] = new
            result = ring.multiply(result, ring.element(self._known.sign[_key(polynomial)]))
        return result

    def _modulus(self, element: Element) -> Element:
        return element if element[0].is_zero() else self.field.multiply(element, self._sign(element))

    def _split(self, element: Element) -> tuple[sp.Rational, list[tuple[Polynomial, int]], list[tuple[Polynomial, int]]]:
        """A positive argument as |number| * product of known-positive factors * product of the others.

        A lone factor of unknown sign and odd exponent must be positive, since the whole argument is.
        """
        number, factors = self._factors(element)
        known: list[tuple[Polynomial, int]] = []
        others: list[tuple[Polynomial, int]] = []
        for polynomial, exponent in factors:
            sign = self._sign_of(polynomial)
            if sign < 0 and exponent % 2:
                number = -number
            (known if sign else others).append((-polynomial if sign < 0 else polynomial, exponent))
        odd = [one for one in others if one[1] % 2]
        if len(odd) == 1:
            others.remove(odd[0])
            positive = odd[0][0] if number > 0 else -odd[0][0]
            self._declare_positive(positive)
            known.append((positive, odd[0][1]))
            number = abs(number)
        elif number < 0:
            if not odd:
                raise NotEmbeddableError("a root or logarithm of a negative number")
            others = [(-p, e) if p == odd[0][0] else (p, e) for p, e in others]
            number = -number
        return number, known, others

    def _rational_power(self, element: Element, exponent: sp.Rational) -> Element:
        """element^exponent for a positive element."""
        ring = self.field
        if exponent.is_Integer:
            return ring.power(element, int(exponent))
        if element[0].is_zero():
            if exponent < 0:
                raise ZeroDivisionError("a root in a denominator vanishes identically")
            return element
        if self.root_order % int(exponent.q):
            raise NotEmbeddableError(f"no root of order {exponent.q} was foreseen")
        number, known, others = self._split(element)
        result = self._one
        for prime, times in sorted(sp.factorrat(number).items()):
            known = [*known, (ring.context.constant(int(prime)), int(times))]
        for polynomial, times in known:
            whole, part = divmod(times * int(exponent.p) * (self.root_order // int(exponent.q)), self.root_order)
            factor = ring.power((polynomial, ring.one), whole)
            result = ring.multiply(result, ring.multiply(factor, ring.power(self._root(polynomial), part)))
        return ring.multiply(result, self._power_of_unsigned(others, exponent)) if others else result

    def _root(self, polynomial: Polynomial) -> Element:
        """The positive root, of the common order, of a positive polynomial."""
        ring = self.field
        root = self._known.positive.get(_key(polynomial))
        if root is None:
            meaning = ring.polynomial(polynomial) ** sp.Rational(1, self.root_order)
            new = ring.generator(meaning)
            ring.relate(new, self.root_order, polynomial)
            root = self._known.positive[_key(polynomial)] = ring.element(new)
            self._known.positive.setdefault(_key(ring.variables[new]), None)
        return root

    def _power_of_unsigned(self, others: list[tuple[Polynomial, int]], exponent: sp.Rational) -> Element:
        # Only the product is known to be positive; |p|^(2k) = p^(2k) and |p| = p sign(p) come out of the root.
        ring = self.field
        outside, inside = self._one, self._one
        step = int(exponent.q) if exponent.q % 2 == 0 else 2 * int(exponent.q)
        for polynomial, times in others:
            whole, part = divmod(times, step)
            base: Element = (polynomial, ring.one)
            if step == exponent.q:
                outside = ring.multiply(outside, ring.power(self._modulus(base), whole))
            else:
                outside = ring.multiply(outside, ring.power(base, 2 * whole))
            inside = ring.multiply(inside, ring.power(base, part))
        outside = ring.power(outside, int(exponent.p))
        if inside == self._one:
            return outside
        root = self._root(inside[0])
        return ring.multiply(outside, ring.power(root, int(exponent.p) * (self.root_order // int(exponent.q))))

    def _logarithm(self, element: Element) -> Element:
        ring = self.field
        if element[0].is_zero():
            raise NotEmbeddableError("the logarithm of zero")
        number, known, others = self._split(element)
        known = known + [(ring.context.constant(int(p)), int(e)) for p, e in sorted(sp.factorrat(number).items())]
        terms = [
            ring.multiply(ring.rational(sp.Integer(times)), self._logarithm_of_positive(polynomial))
            for polynomial, times in known
        ]
        if others:
            # The exponents share the factor 2 at most here: |p|^2k is left under one logarithm.
            product = self._one
            for polynomial, times in others:
                product = ring.multiply(product, ring.power((polynomial, ring.one), times))
            terms.append(self._logarithm_generator(product))
        return ring.total(terms)

    def _logarithm_of_positive(self, polynomial: Polynomial) -> Element:
        generator = self._single((polynomial, self.field.one)) if len(polynomial) == 1 else None
        for new, exponent in self._known.exponential.values():
            if new == generator:
                return exponent
        return self._logarithm_generator((polynomial, self.field.one))

    def _logarithm_generator(self, argument: Element) -> Element:
        ring = self.field
        meaning = sp.log(ring.expression(argument), evaluate=False)
        if meaning not in self._known.opaque:
            new = ring.generator(meaning)
            self._known.opaque[meaning] = new
            self._known.logarithm[new] = argument
        return ring.element(self._known.opaque[meaning])

    # Inverse functions: generators that remember their sine and cosine.

    def _inverse(self, make: Callable[[sp.Expr], sp.Expr], argument: Element, circular: bool) -> Element:
        """An odd inverse function, with the sign of its argument normalised."""
        ring = self.field
        if argument[0].is_zero():
            return argument
        if int(argument[0].leading_coefficient()) < 0:
            return ring.negative(self._inverse(make, ring.negative(argument), circular))
        meaning = make(ring.expression(argument))
        if not isinstance(meaning, sp.asin | sp.atan):
            return self.element(meaning)
        if meaning not in self._known.opaque:
            new = ring.generator(meaning)
            self._known.opaque[meaning] = new
            square = ring.power(argument, 2)
            if circular and self.root_order % 2 == 0:
                other = self._rational_power(ring.add(self._one, ring.negative(square)), sp.Rational(1, 2))
                self._known.inverse_circular[new] = argument, other
            elif self.root_order % 2 == 0:
                cosine = self._rational_power(ring.add(self._one, square), sp.Rational(-1, 2))
                self._known.inverse_circular[new] = ring.multiply(argument, cosine), cosine
        return ring.element(self._known.opaque[meaning])

    def _asin(self, argument: Element) -> Element:
        return self._inverse(sp.asin, argument, circular=True)

    def _atan(self, argument: Element) -> Element:
        return self._inverse(sp.atan, argument, circular=False)

    def _acos(self, argument: Element) -> Element:
        return self.field.add(self.element(sp.pi / 2), self.field.negative(self._asin(argument)))

    def _atan2(self, y: Element, x: Element) -> Element:
        ring = self.field
        meaning = sp.atan2(ring.expression(y), ring.expression(x))
        if not isinstance(meaning, sp.atan2):
            return self.element(meaning)
        if meaning not in self._known.opaque:
            new = ring.generator(meaning)
            self._known.opaque[meaning] = new
            if self.root_order % 2 == 0:
                radius = ring.add(ring.power(x, 2), ring.power(y, 2))
                inverse = self._rational_power(radius, sp.Rational(-1, 2))
                self._known.inverse_circular[new] = ring.multiply(y, inverse), ring.multiply(x, inverse)
        return ring.element(self._known.opaque[meaning])

    def _hyperbolic(self, argument: Element) -> tuple[Element, Element]:
        ring = self.field
        grow = self._exponential(argument)
        fall = ring.inverse(grow)
        half = ring.rational(sp.Rational(1, 2))
        sine = ring.multiply(half, ring.add(grow, ring.negative(fall)))
        return sine, ring.multiply(half, ring.add(grow, fall))


def _ratio(embedding: Embedding, pair: tuple[Element, Element]) -> Element:
    return embedding.field.multiply(pair[0], embedding.field.inverse(pair[1]))


_RULES: dict[type, Callable[[Embedding, Element], Element]] = {
    sp.sin: lambda e, u: e._sine_cosine(u)[0],
    sp.cos: lambda e, u: e._sine_cosine(u)[1],
    sp.tan: lambda e, u: _ratio(e, e._sine_cosine(u)),
    sp.cot: lambda e, u: _ratio(e, e._sine_cosine(u)[::-1]),
    sp.sec: lambda e, u: e.field.inverse(e._sine_cosine(u)[1]),
    sp.csc: lambda e, u: e.field.inverse(e._sine_cosine(u)[0]),
    sp.exp: lambda e, u: e._exponential(u),
    sp.log: lambda e, u: e._logarithm(u),
    sp.sinh: lambda e, u: e._hyperbolic(u)[0],
    sp.cosh: lambda e, u: e._hyperbolic(u)[1],
    sp.tanh: lambda e, u: _ratio(e, e._hyperbolic(u)),
    sp.coth: lambda e, u: _ratio(e, e._hyperbolic(u)[::-1]),
    sp.sech: lambda e, u: e.field.inverse(e._hyperbolic(u)[1]),
    sp.csch: lambda e, u: e.field.inverse(e._hyperbolic(u)[0]),
    sp.asin: Embedding._asin,
    sp.acos: Embedding._acos,
    sp.atan: Embedding._atan,
    sp.Abs: Embedding._modulus,
    sp.sign: Embedding._sign,
}
