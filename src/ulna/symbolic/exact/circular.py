"""Exponentials, sines and their inverse functions of field elements, by addition theorems (see `embed`)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import sympy as sp

from ulna.symbolic.exact.field import Element
from ulna.symbolic.exact.generators import Generators, polynomial_key
from ulna.symbolic.exact.positive import rational_power

_HALF = sp.Rational(1, 2)


def exponential(made: Generators, argument: Element) -> Element:
    """exp(sum of n_k m_k / D_k) as a product of powers of exp(m_k / D_k); exp(log u) is u."""
    ring = made.ring
    result = made.one
    for number, key, monomial in made.parts(argument):
        generator = made.number_of(monomial)
        if generator in made.logarithm:
            power = rational_power(made, made.logarithm[generator], number)
        else:
            power = made.one
            for times, scale in made.scales.multiples(number, key):
                power = ring.multiply(power, ring.power(_letter(made, scale, key, monomial), times))
        result = ring.multiply(result, power)
    return result


def _letter(made: Generators, scale: sp.Rational, key: sp.Expr, monomial: Element) -> Element:
    """The generator exp(scale * key)."""
    exponent = scale * key
    if exponent not in made.exponential:
        ring = made.ring
        new = ring.generator(sp.exp(exponent))
        made.exponential[exponent] = ring.element(new)
        made.exponent[new] = ring.multiply(monomial, ring.rational(scale))
        made.positive[polynomial_key(ring.variables[new])] = None
    return made.exponential[exponent]


def sine_cosine(made: Generators, argument: Element) -> tuple[Element, Element]:
    """Sine and cosine of a sum of angles."""
    ring = made.ring
    angle = (ring.none, ring.one), made.one
    for number, key, monomial in made.parts(argument):
        angle = _added(made, angle, _of_part(made, number, key, monomial))
    return angle


def _added(
    made: Generators, first: tuple[Element, Element], second: tuple[Element, Element]
) -> tuple[Element, Element]:
    """The addition theorems."""
    ring = made.ring
    (s, c), (sine, cosine) = first, second
    return (
        ring.add(ring.multiply(s, cosine), ring.multiply(c, sine)),
        made.subtract(ring.multiply(c, cosine), ring.multiply(s, sine)),
    )


def _of_part(made: Generators, number: sp.Rational, key: sp.Expr, monomial: Element) -> tuple[Element, Element]:
    ring = made.ring
    if key is sp.pi:
        values = sp.sin(number * sp.pi), sp.cos(number * sp.pi)
        if not any(value.has(sp.sin, sp.cos) for value in values) and _fits_roots(made, values):
            return made.translate(values[0]), made.translate(values[1])
    generator = made.number_of(monomial)
    inverse = None if generator is None else made.inverse_circular.get(generator)
    if inverse is not None:
        made.scales.note(sp.S.One, key)
    sum_of_angles = (ring.none, ring.one), made.one
    for times, scale in made.scales.multiples(number, key):
        unit = inverse() if inverse is not None and scale == 1 else _unit(made, scale * key)
        sum_of_angles = _added(made, sum_of_angles, _times(made, unit, times))
    return sum_of_angles


def _unit(made: Generators, angle: sp.Expr) -> tuple[Element, Element]:
    """The generators sin(angle) and cos(angle)."""
    if angle not in made.circular:
        ring = made.ring
        c, s = ring.generator(sp.cos(angle)), ring.generator(sp.sin(angle))
        ring.relate(s, 2, ring.one - ring.variables[c] ** 2)
        made.circular[angle] = ring.element(s), ring.element(c)
    return made.circular[angle]


def _fits_roots(made: Generators, values: Sequence[sp.Expr]) -> bool:
    roots = [int(power.exp.q) for value in values for power in value.atoms(sp.Pow) if power.exp.is_Rational]
    return all(made.root_order % order == 0 for order in roots)


def _times(made: Generators, unit: tuple[Element, Element], times: int) -> tuple[Element, Element]:
    """Sine and cosine of a multiple of the angle."""
    ring = made.ring
    angle = (ring.none, ring.one), made.one
    for _ in range(abs(times)):
        angle = _added(made, angle, unit)
    return (ring.negative(angle[0]) if times < 0 else angle[0]), angle[1]


def hyperbolic(made: Generators, argument: Element) -> tuple[Element, Element]:
    """Hyperbolic sine and cosine, through the exponential."""
    ring = made.ring
    grow = exponential(made, argument)
    fall = ring.inverse(grow)
    half = made.rational(1, 2)
    return ring.multiply(half, made.subtract(grow, fall)), ring.multiply(half, ring.add(grow, fall))


def arcsine(made: Generators, argument: Element) -> Element:
    """asin as a generator that knows its sine and cosine."""

    def pair() -> tuple[Element, Element]:
        square = made.ring.power(argument, 2)
        return argument, rational_power(made, made.subtract(made.one, square), _HALF)

    return _odd_inverse(made, sp.asin, argument, arcsine, pair)


def arctangent(made: Generators, argument: Element) -> Element:
    """atan as a generator that knows its sine and cosine."""

    def pair() -> tuple[Element, Element]:
        square = made.ring.power(argument, 2)
        cosine = rational_power(made, made.ring.add(made.one, square), -_HALF)
        return made.ring.multiply(argument, cosine), cosine

    return _odd_inverse(made, sp.atan, argument, arctangent, pair)


def _odd_inverse(
    made: Generators,
    function: Callable[[sp.Expr], sp.Expr],
    argument: Element,
    again: Callable[[Generators, Element], Element],
    pair: Callable[[], tuple[Element, Element]],
) -> Element:
    ring = made.ring
    if argument[0].is_zero():
        return argument
    if int(argument[0].leading_coefficient()) < 0:
        return ring.negative(again(made, ring.negative(argument)))
    return _with_sine_cosine(made, function(ring.expression(argument)), function, pair)


def arccosine(made: Generators, argument: Element) -> Element:
    """acos = pi/2 - asin."""
    return made.subtract(made.translate(sp.pi / 2), arcsine(made, argument))


def arctangent_of_two(made: Generators, y: Element, x: Element) -> Element:
    """atan2(y, x) as a generator that knows its sine and cosine."""
    ring = made.ring

    def pair() -> tuple[Element, Element]:
        inverse = rational_power(made, ring.add(ring.power(x, 2), ring.power(y, 2)), -_HALF)
        return ring.multiply(y, inverse), ring.multiply(x, inverse)

    return _with_sine_cosine(made, sp.atan2(ring.expression(y), ring.expression(x)), sp.atan2, pair)


def _with_sine_cosine(
    made: Generators, meaning: sp.Expr, kind: object, pair: Callable[[], tuple[Element, Element]]
) -> Element:
    if meaning.func is not kind:
        return made.translate(meaning)
    known = meaning in made.named
    element = made.call(meaning)
    number = made.number_of(element)
    if not known and number is not None and made.root_order % 2 == 0:
        made.inverse_circular[number] = pair
    return element
