"""What outputs tell of parameters that cannot be known one by one: functions that no hidden direction changes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations_with_replacement

import sympy as sp
from flint import arb, arb_mat, ctx

from ulna.base import Verdict
from ulna.identification.structural.observed import DIGITS, Observed
from ulna.symbolic.exact import rank_of_balls, value_at

_GREATEST = 10_000
"""Of the denominators of a relation that is meant."""
_MOST_TERMS = 60
_HIGHEST_DEGREE = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Combination:
    """A function of parameters that can be known although its parameters cannot.

    Attributes:
        expression: the function.
        verdict: on "the outputs determine this".
    """

    expression: sp.Expr
    verdict: Verdict


def combinations_of(
    unknown: Sequence[sp.Symbol],
    seen: Observed,
    further: Callable[[int], Observed],
    offered: Sequence[Combination],
) -> tuple[Combination, ...]:
    """As many independent functions of hidden parameters as are known, the shortest first.

    Args:
        unknown: (q,) all unknown parameters, in the order of the hidden directions.
        seen: the rank at one point; further: the same at another random point, by number.
        offered: functions that are known to be known.
    """
    moved = [j for j in range(len(unknown)) if seen.moved(j)]
    due = len(moved) - rank_of_directions(seen.hidden)
    chosen: list[Combination] = []
    at = {s: seen.parameters[s.name] for s in unknown}
    columns = [unknown[j] for j in moved]
    points = _Points(seen, further)
    with ctx.workprec(DIGITS):
        if due:
            _choose(chosen, [*_products(unknown, moved, points), *offered], columns, at, due)
        degree = 1
        while len(chosen) < due and degree <= _HIGHEST_DEGREE:
            _choose(chosen, list(_sums(unknown, moved, points, degree)), columns, at, due)
            degree += 1
    return tuple(chosen)


def rank_of_directions(hidden: Sequence[Sequence[arb]]) -> int:
    """How many hidden directions there are in the parameters alone."""
    with ctx.workprec(DIGITS):
        return rank_of_balls(hidden, point={}).value if hidden else 0


class _Points:
    """Hidden directions at as many random parameters as are asked for."""

    def __init__(self, first: Observed, further: Callable[[int], Observed]) -> None:
        self._found = [first]
        self._further = further

    def at_least(self, count: int) -> list[Observed]:
        while len(self._found) < count:
            self._found.append(self._further(len(self._found)))
        return self._found[:count]


def _choose(
    chosen: list[Combination],
    offered: Sequence[Combination],
    columns: Sequence[sp.Symbol],
    at: dict[sp.Symbol, sp.Expr],
    due: int,
) -> None:
    """Take what is independent of what has been taken, the shortest first."""
    gradients = [_gradient(c.expression, columns, at) for c in chosen]
    for one in sorted(
        offered, key=lambda c: (len(c.expression.free_symbols), c.expression.count_ops(), str(c.expression))
    ):
        if len(chosen) == due:
            return
        row = _gradient(one.expression, columns, at)
        if row is not None and sp.Matrix([*gradients, row]).rank() > len(chosen):
            gradients.append(row)
            chosen.append(one)


def _gradient(expression: sp.Expr, columns: Sequence[sp.Symbol], at: dict[sp.Symbol, sp.Expr]) -> list[sp.Expr] | None:
    row = [value_at(expression.diff(s), at) for s in columns]
    known = [sp.nsimplify(v, rational=True) for v in row if v is not None]
    return known if len(known) == len(row) else None


def _products(unknown: Sequence[sp.Symbol], moved: Sequence[int], points: _Points) -> Iterator[Combination]:
    """Monomials Π p_j^e_j: the exponents are orthogonal to every hidden direction in logarithms."""
    rows = [
        [row[j] / _ball(one.parameters[unknown[j].name]) for j in moved]
        for one in points.at_least(3)
        for row in one.hidden
    ]
    for exponents in _relations(rows):
        whole = sp.ilcm(*(e.denominator for e in exponents))
        powers = [int(e * whole) for e in exponents]
        divisor = sp.igcd(*powers)
        sign = 1 if sum(powers) > 0 or (sum(powers) == 0 and next(e for e in powers if e) > 0) else -1
        yield _supported(sp.Mul(*(unknown[j] ** (sign * e // divisor) for j, e in zip(moved, powers, strict=True))), 3)


def _sums(unknown: Sequence[sp.Symbol], moved: Sequence[int], points: _Points, degree: int) -> Iterator[Combination]:
    """Polynomials Σ c_k m_k of low degree in all parameters, with whole coefficients."""
    hidden = {unknown[j] for j in moved}
    terms = [
        sp.Mul(*factors)
        for d in range(1, degree + 1)
        for factors in combinations_with_replacement(unknown, d)
        if hidden & set(factors)
    ][::-1]  # the lowest last: they are what a relation is solved for
    if len(terms) > _MOST_TERMS:
        return
    slopes = [[(j, term.diff(s)) for j, s in enumerate(unknown) if term.has(s)] for term in terms]
    rows = []
    for one in points.at_least(len(terms) + 3):
        at = {s: one.parameters[s.name] for s in unknown}
        values = [[(j, _ball(slope.xreplace(at))) for j, slope in row] for row in slopes]
        rows += [[sum((v * direction[j] for j, v in row), arb(0)) for row in values] for direction in one.hidden]
    for coefficients in _relations(rows):
        whole = sp.ilcm(*(c.denominator for c in coefficients))
        expression = sp.Add(*(int(c * whole) * term for c, term in zip(coefficients, terms, strict=True)))
        yield _supported(sp.factor(expression), len(rows))


def _supported(expression: sp.Expr, points: int) -> Combination:
    return Combination(expression=expression, verdict=Verdict.supported(claim(expression), points=points))


def claim(expression: sp.Expr) -> str:
    """What is said of a combination."""
    return f"the outputs determine {expression}"


def _ball(value: sp.Expr) -> arb:
    number = sp.Rational(value)
    return arb(int(number.p)) / int(number.q)


def _relations(rows: Sequence[Sequence[arb]]) -> Iterator[list[Fraction]]:
    """Rational vectors with short denominators that every row is orthogonal to."""
    rank = rank_of_balls(rows, point={})
    rest = [j for j in range(len(rows[0])) if j not in rank.columns]
    if not rank.columns or not rest or not rank.verdict.holds:
        return
    minor = arb_mat([[rows[i][j] for j in rank.columns] for i in rank.rows])
    solution = minor.solve(arb_mat([[-rows[i][j] for j in rest] for i in rank.rows]))
    for k, j in enumerate(rest):
        vector = [Fraction(0)] * len(rows[0])
        vector[j] = Fraction(1)
        numbers = [_short(solution[i, k]) for i in range(len(rank.columns))]
        if all(number is not None for number in numbers):
            for column, number in zip(rank.columns, numbers, strict=True):
                vector[column] = number or Fraction(0)
            yield vector


def _short(value: arb) -> Fraction | None:
    """The fraction that a ball stands for, if a short one is in it."""
    significand, exponent = value.mid().man_exp()
    power = Fraction(2) ** int(exponent)
    near = (Fraction(int(significand)) * power).limit_denominator(_GREATEST)
    off = abs(value - arb(near.numerator) / near.denominator)
    return near if off.abs_upper() < arb(2) ** (-DIGITS // 4) else None
