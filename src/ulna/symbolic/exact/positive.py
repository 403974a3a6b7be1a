"""Signs, roots and logarithms of field elements, through the irreducible factors of their argument (see `embed`).

What stands under a root or a logarithm is positive wherever the expression is real; each rule uses that.
"""

from __future__ import annotations

import sympy as sp

from ulna.symbolic.exact.field import Element, NotEmbeddableError, Polynomial, VanishingDenominatorError
from ulna.symbolic.exact.generators import Generators, polynomial_key

Factor = tuple[Polynomial, int]


def _factors(made: Generators, element: Element) -> tuple[sp.Rational, list[Factor]]:
    """The number and the irreducible factors with their (possibly negative) exponents."""
    top, above = made.ring.factors(element[0])
    bottom, below = made.ring.factors(element[1])
    return sp.Rational(top, bottom), above + [(p, -e) for p, e in below]


def _known_sign(made: Generators, polynomial: Polynomial) -> int:
    """1 or -1 where it is known, else 0."""
    for one, sign in ((polynomial, 1), (-polynomial, -1)):
        if polynomial_key(one) in made.positive:
            return sign
    expression = made.ring.polynomial(polynomial)
    if not (expression.is_positive or expression.is_negative):
        return 0
    sign = 1 if expression.is_positive else -1
    made.positive[polynomial_key(polynomial if sign > 0 else -polynomial)] = None
    return sign


def declare_positive(made: Generators, polynomial: Polynomial) -> None:
    """Note that the polynomial is positive; a sign generator made for it before becomes 1 (or -1)."""
    made.positive.setdefault(polynomial_key(polynomial), None)
    for one, value in ((polynomial, 1), (-polynomial, -1)):
        generator = made.sign.get(polynomial_key(one))
        if generator is not None:
            made.ring.relate(generator, 1, made.ring.context.constant(value))


def sign(made: Generators, element: Element) -> Element:
    """The sign of an element that is not zero."""
    ring = made.ring
    if element[0].is_zero():
        raise NotEmbeddableError("the sign of zero")
    number, factors = _factors(made, element)
    result = made.rational(1 if number > 0 else -1)
    for polynomial, exponent in factors:
        if exponent % 2 == 0:
            continue
        known = _known_sign(made, polynomial)
        if known:
            result = ring.multiply(result, made.rational(known))
            continue
        key = polynomial_key(polynomial)
        if key not in made.sign:
            made.sign[key] = ring.generator(sp.sign(ring.polynomial(polynomial)))
            ring.relate(made.sign[key], 2, ring.one)
        result = ring.multiply(result, ring.element(made.sign[key]))
    return result


def modulus(made: Generators, element: Element) -> Element:
    """The absolute value, as element times sign."""
    return element if element[0].is_zero() else made.ring.multiply(element, sign(made, element))


def _split(made: Generators, element: Element) -> tuple[list[Factor], list[Factor]]:
    """A positive element as product of known-positive factors (primes included) and product of the others.

    A lone factor of unknown sign and odd exponent must be positive, since the whole is.
    """
    number, factors = _factors(made, element)
    known: list[Factor] = []
    others: list[Factor] = []
    for polynomial, exponent in factors:
        known_sign = _known_sign(made, polynomial)
        if known_sign < 0 and exponent % 2:
            number = -number
        (known if known_sign else others).append((-polynomial if known_sign < 0 else polynomial, exponent))
    odd = [one for one in others if one[1] % 2]
    if number < 0 and not odd:
        raise NotEmbeddableError("a root or logarithm of a negative number")
    if len(odd) == 1:
        positive = odd[0][0] if number > 0 else -odd[0][0]
        others.remove(odd[0])
        declare_positive(made, positive)
        known.append((positive, odd[0][1]))
    elif number < 0:
        others = [(-p, e) if p == odd[0][0] else (p, e) for p, e in others]
    primes = sorted(sp.factorrat(abs(number)).items())
    return known + [(made.ring.context.constant(int(p)), int(e)) for p, e in primes], others


def rational_power(made: Generators, element: Element, exponent: sp.Rational) -> Element:
    """element^exponent for a positive element (any element if the exponent is an integer)."""
    ring = made.ring
    if exponent.is_Integer:
        return ring.power(element, int(exponent))
    if element[0].is_zero():
        if exponent < 0:
            raise VanishingDenominatorError
        return element
    if made.root_order % int(exponent.q):
        raise NotEmbeddableError(f"no root of order {exponent.q} was foreseen")
    known, others = _split(made, element)
    times_order = int(exponent.p) * (made.root_order // int(exponent.q))
    result = made.one
    for polynomial, times in known:
        whole, part = divmod(times * times_order, made.root_order)
        factor = ring.power((polynomial, ring.one), whole)
        result = ring.multiply(result, ring.multiply(factor, ring.power(_root(made, polynomial), part)))
    return ring.multiply(result, _power_of_unsigned(made, others, exponent)) if others else result


def _root(made: Generators, polynomial: Polynomial) -> Element:
    """The positive root, of the common order, of a positive polynomial."""
    ring = made.ring
    key = polynomial_key(polynomial)
    root = made.positive.get(key)
    if root is None:
        new = ring.generator(ring.polynomial(polynomial) ** sp.Rational(1, made.root_order))
        ring.relate(new, made.root_order, polynomial)
        root = made.positive[key] = ring.element(new)
        made.positive.setdefault(polynomial_key(ring.variables[new]), None)
    return root


def _power_of_unsigned(made: Generators, others: list[Factor], exponent: sp.Rational) -> Element:
    # Only the product is known to be positive; |p|^(2k) = p^(2k) and |p| = p sign(p) come out of the root.
    ring = made.ring
    order = int(exponent.q)
    even = order % 2 == 0
    outside, inside = made.one, made.one
    for polynomial, times in others:
        base: Element = (polynomial, ring.one)
        whole, part = divmod(times, order if even else 2 * order)
        outside = ring.multiply(
            outside, ring.power(modulus(made, base) if even else base, whole if even else 2 * whole)
        )
        inside = ring.multiply(inside, ring.power(base, part))
    outside = ring.power(outside, int(exponent.p))
    if inside == made.one:
        return outside
    root = _root(made, inside[0])
    return ring.multiply(outside, ring.power(root, int(exponent.p) * (made.root_order // order)))


def logarithm(made: Generators, element: Element) -> Element:
    """The logarithm of a positive element, as sum over its known-positive factors."""
    ring = made.ring
    if element[0].is_zero():
        raise NotEmbeddableError("the logarithm of zero")
    known, others = _split(made, element)
    terms = [
        ring.multiply(made.rational(times), _logarithm_of(made, (polynomial, ring.one))) for polynomial, times in known
    ]
    if others:
        product = made.one
        for polynomial, times in others:
            product = ring.multiply(product, ring.power((polynomial, ring.one), times))
        terms.append(_logarithm_of(made, product))
    return ring.total(terms)


def _logarithm_of(made: Generators, argument: Element) -> Element:
    """The generator log(argument), or the exponent if the argument is an exponential."""
    generator = made.number_of(argument)
    exponent = None if generator is None else made.exponent.get(generator)
    if exponent is not None:
        return exponent
    element = made.call(sp.log(made.ring.expression(argument), evaluate=False))
    number = made.number_of(element)
    if number is not None:
        made.logarithm[number] = argument
    return element
