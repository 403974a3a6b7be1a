"""Random rational points, and the expressions' balls there; deterministic for a given seed."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence
from itertools import count as count_from
from itertools import islice

import sympy as sp
from flint import arb

from ulna.symbolic.exact.ball import Tape

Point = dict[sp.Basic, sp.Rational]

SEED = 20140912
"""Default seed of every random choice in this package."""

_TRIES_PER_POINT = 40


RADIUS = sp.Rational(1, 8)
"""Default half width of the neighbourhood of a given point."""


def random_points(
    leaves: Sequence[sp.Basic],
    *,
    seed: int,
    near: Mapping[sp.Basic, sp.Expr] | None = None,
    radius: sp.Rational = RADIUS,
) -> Iterator[Point]:
    """Endless random rational points with a value for each leaf.

    The signs and sizes vary from point to point so that logarithms, roots and inverse sines soon find a point of
    their domain. With `near`, the leaves named there stay within `radius` of that point, whose values may contain
    other leaves.
    """
    generator = random.Random(seed)  # noqa: S311 - reproducible sampling, no secret
    known = dict(near or {})
    others = {symbol for value in known.values() for symbol in sp.sympify(value).free_symbols} - known.keys()
    free = sorted({leaf for leaf in leaves if leaf not in known} | others, key=str)
    # Seven sizes against two signs: all fourteen pairs come up.
    sizes = (2, 2, 1, sp.Rational(1, 3), 3, 10, 30)
    for count in count_from(0):
        signs = (1,) if count % 2 else (1, -1)
        size = sizes[count % len(sizes)]
        point = {leaf: admissible(leaf, _unit(generator) * generator.choice(signs) * size) for leaf in free}
        for leaf, base in known.items():
            offset = _unit(generator) * generator.choice((1, -1)) * radius / 4 ** (count % 3)
            point[leaf] = rational(sp.sympify(base).xreplace(point)) + offset
        yield {leaf: point[leaf] for leaf in leaves}


def _unit(generator: random.Random) -> sp.Rational:
    denominator = generator.randint(131, 521)
    return sp.Rational(generator.randint(1, denominator), denominator)


def admissible(leaf: sp.Basic, value: sp.Rational) -> sp.Rational:
    """The value, changed to fit what is assumed of the leaf: integer, positive, negative."""
    if getattr(leaf, "is_integer", None):
        value = sp.Integer(round(value * 5))
    if (getattr(leaf, "is_nonnegative", None) and value < 0) or (getattr(leaf, "is_nonpositive", None) and value > 0):
        value = -value
    return value


def rational(value: sp.Expr | float) -> sp.Rational:
    """The number itself if it is rational, else a rational number close to its real part.

    A point with parameters in it, such as asin(c/a), is complex for some values of these: then any number will do.
    """
    number = sp.sympify(value)
    return number if isinstance(number, sp.Rational) else sp.Rational(str(sp.re(sp.N(number, 20))))


def regular_points(
    tape: Tape,
    count: int,
    *,
    seed: int = SEED,
    digits: int = 40,
    near: Mapping[sp.Basic, sp.Expr] | None = None,
    radius: sp.Rational = RADIUS,
) -> Iterator[tuple[Point, list[arb]]]:
    """At most `count` random points where every expression is a finite real number, with the balls there.

    Each value carries at least about half of the digits, or is indistinguishable from 0 to that many digits.
    """
    tries = random_points(tape.leaves, seed=seed, near=near, radius=radius)
    found = 0
    for point in islice(tries, _TRIES_PER_POINT + count * 4):
        values = _finite_values(tape, point, digits)
        if values is None:
            continue
        yield point, values
        found += 1
        if found == count or not tape.leaves:
            return


def _finite_values(tape: Tape, point: Point, digits: int) -> list[arb] | None:
    tolerance = arb(10) ** (-digits // 2)
    for factor in (1, 2, 4):
        values = tape(point, digits * factor)
        if all(value.is_finite() for value in values):
            if all(is_sharp(value, tolerance) for value in values):
                return values
        elif factor == 2:
            return None
    return None


def is_sharp(value: arb, tolerance: arb) -> bool:
    """True if the ball excludes 0 or is narrower than the tolerance."""
    return not value.contains(0) or bool(abs(value) < tolerance)
