"""Random rational points, and the expressions' balls there; deterministic for a given seed."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice

import sympy as sp
from flint import arb

from ulna.symbolic.ball import Tape, is_leaf, leaves_of

Point = dict[sp.Basic, sp.Rational]

SEED = 20140912
"""Default seed of every random choice in this package."""

_TRIES_PER_POINT = 40


def random_points(leaves: Sequence[sp.Basic], *, seed: int, near: Mapping[sp.Basic, sp.Expr] | None) -> Iterator[Point]:
    """Endless random rational points with a value for each leaf.

    The signs and sizes vary from point to point so that logarithms, roots and inverse sines soon find a point of
    their domain. With `near`, the named leaves stay within a shrinking and growing neighbourhood of that point.
    """
    generator = random.Random(seed)  # noqa: S311 - reproducible sampling, no secret
    known = dict(near or {})
    scales = (2, 2, 1, sp.Rational(1, 3), 3, 10, 30)
    radii = (sp.Rational(1, 8), sp.Rational(1, 2), sp.Rational(1, 64), sp.Rational(1, 4))
    count = 0
    while True:
        positive = count % 2 == 1
        scale = scales[count % len(scales)]
        radius = radii[count % len(radii)]
        count += 1
        yield {leaf: _value(leaf, generator, known.get(leaf), positive, scale, radius) for leaf in leaves}


def _value(
    leaf: sp.Basic,
    generator: random.Random,
    base: sp.Expr | None,
    positive: bool,
    scale: sp.Rational | int,
    radius: sp.Rational,
) -> sp.Rational:
    denominator = generator.randint(131, 521)
    numerator = generator.randint(1, denominator) * generator.choice((1, 1, 1) if positive else (1, -1))
    unit = sp.Rational(numerator, denominator)
    if base is not None:
        value = rational(base) + unit * radius * generator.choice((1, -1))
    else:
        value = unit * scale
    if getattr(leaf, "is_integer", None):
        value = sp.Integer(round(value * 5))
    if (getattr(leaf, "is_nonnegative", None) and value < 0) or (getattr(leaf, "is_nonpositive", None) and value > 0):
        value = -value
    return value


def rational(value: sp.Expr | float) -> sp.Rational:
    """The number itself if it is rational, else a rational number close to it."""
    number = sp.sympify(value)
    return number if isinstance(number, sp.Rational) else sp.Rational(str(sp.N(number, 20)))


def regular_points(
    tape: Tape,
    count: int,
    *,
    seed: int = SEED,
    digits: int = 40,
    near: Mapping[sp.Basic, sp.Expr] | None = None,
) -> Iterator[tuple[Point, list[arb]]]:
    """At most `count` random points where every expression is a finite real number, with the balls there.

    Each value carries at least about half of the digits, or is indistinguishable from 0 to that many digits.
    """
    tries = random_points(tape.leaves, seed=seed, near=near)
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


def undetermined(expressions: Sequence[sp.Basic], point: Mapping[sp.Basic, sp.Expr]) -> tuple[sp.Basic, ...]:
    """The leaves to which the point gives no value."""
    return tuple(leaf for leaf in leaves_of(expressions) if leaf not in point and is_leaf(leaf))
