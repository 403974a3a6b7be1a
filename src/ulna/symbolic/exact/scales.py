"""Which multiples of an angle or exponent get letters of their own, so that no degree grows large (see `embed`).

exp(3 x) is the third power of exp(x), exp(38.68 x) would be the 967th of exp(x / 25): measured numbers are no algebraic
facts. So the letter is the largest common part of all multiples that come up, and where even that needs high powers
the multiples stay independent letters. What is zero over independent letters is zero; the converse is only *supported*.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations, product

import sympy as sp

from ulna.symbolic.exact.field import NotEmbeddableError

Multiples = list[tuple[int, sp.Rational]]
"""number = sum of times * scale."""

_GREATEST_MULTIPLE = 12
"""Up to which a multiple is written as a power of one letter."""

_FEW = 3
"""Up to which multiples of two letters are added."""

_GREATEST_COUNT = 6
"""Letters of one angle or exponent."""


class OtherLettersError(Exception):
    """A multiple came up that the letters chosen before do not give; the next attempt knows it."""


class Scales:
    """The letters of each angle or exponent, chosen anew when a multiple comes up that they do not give."""

    def __init__(self) -> None:
        self._numbers: dict[sp.Expr, list[sp.Rational]] = {}
        self._letters: dict[sp.Expr, list[sp.Rational]] = {}

    def note(self, number: sp.Rational, key: sp.Expr) -> None:
        """Choose letters that give this multiple, too, where none are chosen yet."""
        if key not in self._letters:
            self._numbers[key] = [number]
            self._letters[key] = _letters([number])

    def multiples(self, number: sp.Rational, key: sp.Expr) -> Multiples:
        """The number over the letters of this key.

        Raises:
            OtherLettersError: if they do not give it.
            NotEmbeddableError: if too many letters would be needed.
        """
        self.note(number, key)
        found = _over(number, self._letters[key])
        if found is None:
            self._numbers[key].append(number)
            self._letters[key] = _letters(self._numbers[key])
            raise OtherLettersError
        return found


def _letters(numbers: Sequence[sp.Rational]) -> list[sp.Rational]:
    below = math.lcm(*(int(n.q) for n in numbers))
    above = math.gcd(*(int(n * below) for n in numbers))
    for scale in (sp.Rational(1, below), sp.Rational(above, below)):
        if all(abs(n / scale) <= _GREATEST_MULTIPLE for n in numbers):
            return [scale]
    chosen: list[sp.Rational] = []
    for number in sorted(numbers, key=abs):
        if _over(number, chosen) is None:
            chosen.append(abs(number))
    if len(chosen) > _GREATEST_COUNT:
        raise NotEmbeddableError("too many multiples of one angle or exponent")
    return chosen


def _over(number: sp.Rational, letters: Sequence[sp.Rational]) -> Multiples | None:
    """The number as a small multiple of one letter, or a sum of two of them."""
    for scale in letters:
        times = number / scale
        if times.is_Integer and abs(times) <= _GREATEST_MULTIPLE:
            return [(int(times), scale)]
    few = [times for times in range(-_FEW, _FEW + 1) if times]
    for (first, second), (one, other) in product(combinations(letters, 2), product(few, few)):
        if one * first + other * second == number:
            return [(one, first), (other, second)]
    return None
