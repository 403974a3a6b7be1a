"""Exact arithmetic with fractions of polynomials in generators that obey relations (sin^2 = 1 - cos^2, r^2 = 2, ...).

An element is a pair (numerator, denominator) of integer polynomials (FLINT). Reduction by the relations is exact, so
an element whose numerator reduces to 0 *is* zero wherever its denominators are not; the converse need not hold.
`embed` brings SymPy expressions here.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import sympy as sp
from flint import Ordering, fmpz, fmpz_mpoly, fmpz_mpoly_ctx

from ulna.symbolic.exact.helper import HelperMemoryError, NoHelperError, apart

Polynomial: TypeAlias = fmpz_mpoly
Element: TypeAlias = tuple[Polynomial, Polynomial]
"""Numerator and denominator."""

_PRODUCT_LIMIT = 2_000_000
"""Term pairs of one product: about 0.2 s. Compiled code is not interruptible, so size is bounded beforehand."""

_MANY_PAIRS = 20_000
"""Term pairs from which the length of the coefficients counts as well."""

_HEAVY_PRODUCT = 20_000_000
"""Pairs of terms times pairs of words of their coefficients."""

_GCD_LIMIT = 3_000
"""Terms of both polynomials up to which a common divisor is looked for."""

_HEAVY_GCD = 20_000
"""Terms times words up to which that is so: 0.1 s."""

_FACTOR_LIMIT = 4_000
"""Terms up to which a polynomial is factored."""

_FACTOR_HERE = 500
"""Terms times words up to which a polynomial is factored in this process: 0.1 s. Above, the helper does it."""

_GREATEST_DEGREE = 3_000
"""Total degree of a product: FLINT ends the process where a dense form of high degree finds no memory."""

_DEGREE_HERE = 300
"""Total degree up to which divisors are looked for, and half of it that up to which factors are found here."""


class ExactAlgebraError(Exception):
    """Why an expression has no exact form here."""


class TooLargeError(ExactAlgebraError):
    """An intermediate polynomial is over the size limit."""


class VanishingDenominatorError(ExactAlgebraError):
    """A denominator is identically zero."""


class NotEmbeddableError(ExactAlgebraError):
    """An expression that is no real function of its symbols, or has too many or too high kernels."""


class NoRoomError(Exception):
    """More generators are needed than the field was made for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Relation:
    """generator^power = value, a polynomial in generators made earlier."""

    generator: int
    power: int
    value: Polynomial


class Field:
    """Fractions over a growing list of generators; each generator knows the SymPy expression it stands for.

    Args:
        room: the greatest number of generators.
    """

    def __init__(self, room: int) -> None:
        self.context = _context(room)
        self.room = room
        self.variables = self.context.gens()
        self.meaning: list[sp.Expr] = []
        self.relations: list[Relation] = []
        self.one = self.context.constant(1)
        self.none = self.context.constant(0)

    def generator(self, meaning: sp.Expr) -> int:
        """The number of a new generator that stands for `meaning`."""
        if len(self.meaning) == self.room:
            raise NoRoomError
        self.meaning.append(meaning)
        return len(self.meaning) - 1

    def element(self, generator: int) -> Element:
        """The generator as an element."""
        return self.variables[generator], self.one

    def relate(self, generator: int, power: int, value: Polynomial) -> None:
        """From now on generator^power = value; a former relation of this generator is dropped."""
        self.relations = [one for one in self.relations if one.generator != generator]
        self.relations.append(Relation(generator=generator, power=power, value=value))
        # A relation may only mention earlier generators: reducing the latest first then needs one pass.
        self.relations.sort(key=lambda one: one.generator)

    def rational(self, number: sp.Rational) -> Element:
        """A rational number."""
        return self.context.constant(int(number.p)), self.context.constant(int(number.q))

    def is_zero(self, element: Element) -> bool:
        """True only if the element is zero by the relations."""
        return self.reduced(element[0]).is_zero()

    def reduced(self, polynomial: Polynomial) -> Polynomial:
        """The polynomial with every generator below the power of its relation."""
        for relation in reversed(self.relations):
            if polynomial.degrees()[relation.generator] < relation.power:
                continue
            groups = self._powers(polynomial, relation.generator, relation.power)
            total = self.none
            for times in range(max(groups), -1, -1):
                total = self.times(total, relation.value) + groups.get(times, self.none)
            polynomial = total
        return polynomial

    def _powers(self, polynomial: Polynomial, generator: int, step: int) -> dict[int, Polynomial]:
        """The coefficients of (generator^step)^k, each of degree below `step` in the generator."""
        groups: dict[int, dict[tuple[int, ...], fmpz]] = {}
        for exponents, coefficient in polynomial.to_dict().items():
            times, rest = divmod(int(exponents[generator]), step)
            lower = (*exponents[:generator], rest, *exponents[generator + 1 :])
            groups.setdefault(times, {})[lower] = coefficient
        return {times: self.context.from_dict(terms) for times, terms in groups.items()}

    def without_common_roots(self, polynomials: list[Polynomial]) -> list[Polynomial]:
        """The polynomials divided by every generator g, g^p = v, that divides all of them by its relation.

        P = A + g B is divisible by g if v divides A, since A = (A / v) g^p: this turns (1 - cos^2) / sin into sin.
        """
        for relation in self.relations:
            # A constant value makes the generator a unit (a sign): dividing by it would never end.
            if relation.power == 1 or relation.value.is_constant():
                continue
            while any(polynomial.degrees()[relation.generator] for polynomial in polynomials):
                quotients = [self._divided_by_generator(polynomial, relation) for polynomial in polynomials]
                done = [one for one in quotients if one is not None]
                if len(done) < len(polynomials):
                    break
                polynomials = done
        return polynomials

    def _divided_by_generator(self, polynomial: Polynomial, relation: Relation) -> Polynomial | None:
        parts = self._powers(polynomial, relation.generator, 1)
        constant = parts.pop(0, self.none)
        quotient, rest = divmod(constant, relation.value)
        if not rest.is_zero():
            return None
        variable = self.variables[relation.generator]
        total = quotient * variable ** (relation.power - 1)
        for times, part in parts.items():
            total += part * variable ** (times - 1)
        return total

    def times(self, first: Polynomial, second: Polynomial) -> Polynomial:
        """The product of two polynomials, unless it would be too large."""
        pairs = len(first) * len(second)
        if pairs > _PRODUCT_LIMIT or (pairs > _MANY_PAIRS and weight(first) * weight(second) > _HEAVY_PRODUCT):
            raise TooLargeError
        if pairs and first.total_degree() + second.total_degree() > _GREATEST_DEGREE:
            raise TooLargeError
        return first * second

    def divisor(self, first: Polynomial, second: Polynomial) -> Polynomial:
        """The greatest common divisor; 1 where the two are too large to look for it."""
        if first.is_zero() or second.is_zero():
            return first.gcd(second)
        if first.is_one() or second.is_one() or len(first) + len(second) > _GCD_LIMIT:
            return self.one
        if first.total_degree() + second.total_degree() > _DEGREE_HERE or weight(first) + weight(second) > _HEAVY_GCD:
            return self.one
        return first.gcd(second)

    def make(self, numerator: Polynomial, denominator: Polynomial) -> Element:
        """The fraction reduced by the relations and in lowest terms.

        Raises:
            VanishingDenominatorError: if the denominator is zero by the relations.
        """
        numerator, denominator = self.reduced(numerator), self.reduced(denominator)
        if denominator.is_zero():
            raise VanishingDenominatorError
        if numerator.is_zero():
            return self.none, self.one
        return self._lowest(numerator, denominator)

    def _lowest(self, numerator: Polynomial, denominator: Polynomial) -> Element:
        if not denominator.is_constant():
            numerator, denominator = self.without_common_roots([numerator, denominator])
        if not denominator.is_one():
            [numerator, denominator] = self.coprime([numerator, denominator])
        if int(denominator.leading_coefficient()) < 0:
            numerator, denominator = -numerator, -denominator
        return numerator, denominator

    def coprime(self, polynomials: list[Polynomial]) -> list[Polynomial]:
        """The polynomials without their greatest common divisor, as far as size allows to look for it."""
        if sum(len(one) for one in polynomials) > _GCD_LIMIT:
            return polynomials
        divisor = self.none
        for one in sorted(polynomials, key=len):
            divisor = self.divisor(divisor, one)
            if divisor.is_one():
                return polynomials
        return polynomials if divisor.is_zero() else [one // divisor for one in polynomials]

    def add(self, first: Element, second: Element) -> Element:
        """The sum."""
        if first[1] == second[1]:
            return self.make(first[0] + second[0], first[1])
        shared = self.divisor(first[1], second[1])
        left, right = first[1] // shared, second[1] // shared
        numerator = self.times(first[0], right) + self.times(second[0], left)
        return self.make(numerator, self.times(first[1], right))

    def negative(self, element: Element) -> Element:
        """Minus the element."""
        return -element[0], element[1]

    def multiply(self, first: Element, second: Element) -> Element:
        """The product."""
        left = self._lowest(first[0], second[1]) if not first[0].is_zero() else first
        right = self._lowest(second[0], first[1]) if not second[0].is_zero() else second
        if first[0].is_zero() or second[0].is_zero():
            return self.none, self.one
        return self.make(self.times(left[0], right[0]), self.times(left[1], right[1]))

    def inverse(self, element: Element) -> Element:
        """One over the element."""
        return self.make(element[1], element[0])

    def power(self, element: Element, exponent: int) -> Element:
        """An integer power."""
        if exponent < 0:
            return self.power(self.inverse(element), -exponent)
        if exponent * max(one.total_degree() for one in element) > _GREATEST_DEGREE:
            raise TooLargeError
        result: Element = (self.one, self.one)
        square = element
        while exponent:
            if exponent & 1:
                result = self.multiply(result, square)
            exponent >>= 1
            if exponent:
                square = self.multiply(square, square)
        return result

    def total(self, elements: list[Element]) -> Element:
        """The sum of many, added pairwise to keep the parts small."""
        if not elements:
            return self.none, self.one
        while len(elements) > 1:
            paired = [self.add(one, two) for one, two in pairwise_apart(elements)]
            elements = paired + elements[len(paired) * 2 :]
        return elements[0]

    def expression(self, element: Element) -> sp.Expr:
        """The element as a SymPy expression."""
        return self.polynomial(element[0]) / self.polynomial(element[1])

    def factored(self, element: Element) -> sp.Expr:
        """The element as a SymPy expression, numerator and denominator in irreducible factors."""
        top, above = self.factors(element[0])
        bottom, below = self.factors(element[1])
        factors = [self.polynomial(p) ** e for p, e in above] + [self.polynomial(p) ** -e for p, e in below]
        return sp.Mul(sp.Rational(top, bottom), *factors)

    def factors(self, polynomial: Polynomial) -> tuple[int, list[tuple[Polynomial, int]]]:
        """The integer content and the irreducible factors with their exponents.

        Raises:
            TooLargeError: above the size where it could take minutes, or where memory ran out.
        """
        if len(polynomial) > _FACTOR_LIMIT:
            raise TooLargeError
        if weight(polynomial) <= _FACTOR_HERE and polynomial.total_degree() <= _DEGREE_HERE // 2:
            content, factors = polynomial.factor()
            return int(content), [(factor, int(exponent)) for factor, exponent in factors]
        try:
            number, found = apart(_factors_of_terms, self.room, _terms(polynomial))
        except (NoHelperError, HelperMemoryError) as error:
            raise TooLargeError from error
        return number, [(self.context.from_dict(terms), exponent) for terms, exponent in found]

    def polynomial(self, polynomial: Polynomial) -> sp.Expr:
        """The polynomial as a SymPy expression."""
        terms: list[sp.Expr] = []
        for exponents, coefficient in polynomial.to_dict().items():
            factors = [self.meaning[k] ** power for k, power in enumerate(exponents) if power]
            terms.append(sp.Mul(sp.Integer(int(coefficient)), *factors))
        return sp.Add(*terms)


Terms: TypeAlias = dict[tuple[int, ...], int]


def weight(polynomial: Polynomial) -> int:
    """Terms times words of the longest coefficient."""
    return len(polynomial) * (1 + max((int(c).bit_length() for c in polynomial.coeffs()), default=0) // 64)


def _terms(polynomial: Polynomial) -> Terms:
    return {tuple(map(int, exponents)): int(number) for exponents, number in polynomial.to_dict().items()}


def _context(room: int) -> fmpz_mpoly_ctx:
    return fmpz_mpoly_ctx.get([f"t{number}" for number in range(room)], Ordering.degrevlex)


def _factors_of_terms(room: int, terms: Terms) -> tuple[int, list[tuple[Terms, int]]]:
    """`Field.factors` for another process."""
    content, factors = _context(room).from_dict(terms).factor()
    return int(content), [(_terms(factor), int(exponent)) for factor, exponent in factors]


def pairwise_apart(elements: list[Element]) -> list[tuple[Element, Element]]:
    """(0, 1), (2, 3), ...: neighbours without overlap."""
    return list(pairwise(elements))[::2]
