"""Level sets as graphs: equations solved for as many unknowns, on the branch through a base point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy as sp
from flint import arb

from ulna.base import Verdict
from ulna.symbolic.exact.attempts import attempt
from ulna.symbolic.exact.ball import tape
from ulna.symbolic.exact.zero import SampledZero, is_zero

_FACTOR_SECONDS = 0.3
_SOLVE_SECONDS = 0.6
_QUICK = SampledZero(seconds=0.2)


@dataclass(frozen=True, slots=True, kw_only=True)
class Graph:
    """The set {equations = 0} near a point, as unknowns = expressions in the other symbols.

    Attributes:
        solved: expression by unknown, free of the solved unknowns; empty unless the verdict holds.
        point: a value for every symbol, on the set where that could be reached, on the branch chosen.
        verdict: on "the equations are solved"; refuted if the set is empty.
    """

    solved: Mapping[sp.Symbol, sp.Expr]
    point: Mapping[sp.Symbol, sp.Expr]
    verdict: Verdict


@dataclass(frozen=True, slots=True, kw_only=True)
class _Candidate:
    cost: tuple[int, int, int]
    unknown: sp.Symbol
    value: sp.Expr


class _UnsolvableError(Exception):
    """Carries the verdict that says why."""

    def __init__(self, verdict: Verdict) -> None:
        self.verdict = verdict
        super().__init__(str(verdict))


def graph_near(
    equations: Sequence[sp.Expr], unknowns: Sequence[sp.Symbol], *, near: Mapping[sp.Symbol, sp.Expr]
) -> Graph:
    """The level set through (or next to) a point, each equation solved for one unknown.

    One equation at a time, the simplest first: linear with a constant coefficient, with a coefficient of
    parameters, with one that does not vanish at the point, and only then by SymPy's `solve`. Factors that do not
    vanish at the point are divided out.

    Args:
        equations: k expressions.
        unknowns: symbols to solve for, the ones to solve for first in front.
        near: a value for every symbol; where it is not on the set, the nearest branch is taken.
    """
    claim = "the equations are solved for as many unknowns"
    point = dict(near)
    solved: dict[sp.Symbol, sp.Expr] = {}
    pending = list(equations)
    try:
        while pending:
            pending = _substituted(pending, solved, unknowns, point)
            if not pending:
                break
            factors = [_factors(one, [u for u in unknowns if u not in solved], point) for one in pending]
            chosen = _simplest(factors, [u for u in unknowns if u not in solved], point)
            if chosen is None:
                shown = tuple(str(one) for one in pending)
                tried = "several branches meet at the point" if [] in factors else "linear elimination and solve"
                raise _UnsolvableError(Verdict.undecided(claim, tried=tried, equations=shown))
            step = {chosen.unknown: chosen.value}
            solved = {s: e.xreplace(step) for s, e in solved.items()} | step
            point = _moved(point, solved)
    except _UnsolvableError as reason:
        return Graph(solved={}, point=point, verdict=reason.verdict)
    return Graph(solved=solved, point=point, verdict=Verdict.proved(claim, solved=dict(solved)))


def ball_at(expression: sp.Expr, point: Mapping[sp.Symbol, sp.Expr]) -> arb:
    """A ball that contains the value at the point; not finite where there is no real value."""
    return tape([expression])(point, 40)[0]


def vanishes_at(expression: sp.Expr, point: Mapping[sp.Symbol, sp.Expr]) -> bool:
    """Whether the value at the point is zero to 20 digits (False where there is no real value)."""
    value = ball_at(expression, point)
    return value.is_finite() and value.contains(0) and bool(abs(value) < arb(10) ** -20)


def regular_value_at(expression: sp.Expr, point: Mapping[sp.Symbol, sp.Expr]) -> bool:
    """Whether the value at the point is a real number for certain other than zero."""
    value = ball_at(expression, point)
    return value.is_finite() and not value.contains(0)


def _substituted(
    equations: Sequence[sp.Expr],
    solved: Mapping[sp.Symbol, sp.Expr],
    unknowns: Sequence[sp.Symbol],
    point: Mapping[sp.Symbol, sp.Expr],
) -> list[sp.Expr]:
    kept = []
    for one in equations:
        value = one.xreplace(dict(solved))
        if not value.free_symbols & set(unknowns) and vanishes_at(value, point):
            continue  # a condition on parameters, such as a = |a|, that their values fulfil
        if value != 0 and not is_zero(value, test=_QUICK).holds:
            kept.append(value)
    return kept


def _factors(equation: sp.Expr, unknowns: Sequence[sp.Symbol], point: Mapping[sp.Symbol, sp.Expr]) -> list[sp.Expr]:
    """The factors of the numerator that can vanish near the point; none if several branches meet there."""
    claim = "the equations are solved for as many unknowns"
    together = attempt(_FACTOR_SECONDS, "numerator", lambda: sp.fraction(sp.together(equation))[0])
    numerator = equation if together.value is None else together.value
    factored = attempt(_FACTOR_SECONDS, "factor", sp.factor_list, numerator)
    parts = [numerator] if factored.value is None else [one for one, _ in factored.value[1]]
    parts = [one for one in parts if one.free_symbols & set(unknowns)]
    if equation.has(sp.nan, sp.zoo, sp.oo):
        raise _UnsolvableError(Verdict.undecided(claim, found="an equation has no value on what is solved already"))
    if not parts:
        raise _UnsolvableError(Verdict.refuted(claim, empty=f"{equation} = 0 has no solution"))
    active = [one for one in parts if vanishes_at(one, point)]
    held = [one.free_symbols & set(unknowns) for one in active]
    if len(active) > 1 and all(symbols == held[0] and len(symbols) == 1 for symbols in held):
        return active[:1]  # zeros of functions of one unknown lie apart: near the point they are the same one
    if len(active) > 1:
        return []  # several branches meet here; other equations may settle which
    return active or [one for one in parts if not isinstance(one, sp.exp)] or parts


def _simplest(
    factors: Sequence[Sequence[sp.Expr]], unknowns: Sequence[sp.Symbol], point: Mapping[sp.Symbol, sp.Expr]
) -> _Candidate | None:
    linear = [
        candidate
        for group in factors
        for one in group
        for rank, unknown in enumerate(unknowns)
        if (candidate := _linear(one, unknown, rank, unknowns, point)) is not None
    ]
    if linear:
        return min(linear, key=lambda c: c.cost)
    for group in sorted(factors, key=lambda g: sum(sp.count_ops(one) for one in g)):
        for one in group:
            for unknown in unknowns:
                found = _by_solve(one, unknown, point) or _isolated_zero(one, unknown, unknowns, point)
                if found is not None:
                    return found
    return None


def _isolated_zero(
    equation: sp.Expr, unknown: sp.Symbol, unknowns: Sequence[sp.Symbol], point: Mapping[sp.Symbol, sp.Expr]
) -> _Candidate | None:
    """The point's own value where the equation holds no other unknown: zeros of an analytic function lie apart.

    This takes in multiple zeros such as that of cos(x) − 1, at which no slope tells the branch.
    """
    value = point[unknown]
    if equation.free_symbols & set(unknowns) != {unknown}:
        return None
    there = equation.xreplace({unknown: value})
    if there.has(sp.nan, sp.zoo, sp.oo) or not is_zero(there, test=_QUICK).holds:
        return None
    return _Candidate(cost=(2, 0, 0), unknown=unknown, value=value)


def _linear(
    equation: sp.Expr,
    unknown: sp.Symbol,
    rank: int,
    unknowns: Sequence[sp.Symbol],
    point: Mapping[sp.Symbol, sp.Expr],
) -> _Candidate | None:
    if not equation.has(unknown):
        return None
    slope = equation.diff(unknown)
    if slope.has(unknown):
        slope = sp.expand(slope)
        if slope.has(unknown):
            return None
    if not regular_value_at(slope, point):
        return None
    if slope.is_number:
        kind, size = 0, 0
    elif not slope.free_symbols & set(unknowns):
        kind, size = 0, 1
    else:
        kind, size = 1, int(sp.count_ops(slope))
    value = -equation.xreplace({unknown: sp.Integer(0)}) / slope
    if value.has(sp.nan, sp.zoo, sp.oo):
        return None
    return _Candidate(cost=(kind, size if kind else 0, rank), unknown=unknown, value=sp.factor_terms(value))


def _by_solve(equation: sp.Expr, unknown: sp.Symbol, point: Mapping[sp.Symbol, sp.Expr]) -> _Candidate | None:
    """The solution of one equation that passes through the point, else the one nearest to it."""
    if not equation.has(unknown):
        return None
    on_set = vanishes_at(equation, point)
    if on_set and not regular_value_at(equation.diff(unknown), point):
        return None
    found = attempt(_SOLVE_SECONDS, "solve", sp.solve, equation, unknown)
    best: tuple[arb, sp.Expr] | None = None
    for value in found.value or []:
        if not isinstance(value, sp.Expr) or value.has(sp.I, sp.nan, sp.zoo, sp.oo):
            continue
        distance = abs(ball_at(value - unknown, point))
        if not distance.is_finite() or (on_set and not distance < arb(10) ** -15):
            continue
        if best is None or distance < best[0]:
            best = (distance, value)
    return None if best is None else _Candidate(cost=(2, 0, 0), unknown=unknown, value=best[1])


def _moved(point: Mapping[sp.Symbol, sp.Expr], solved: Mapping[sp.Symbol, sp.Expr]) -> dict[sp.Symbol, sp.Expr]:
    """The point with the solved unknowns at their values on the graph."""
    rest = {s: v for s, v in point.items() if s not in solved}
    moved = dict(point)
    for symbol, expression in solved.items():
        value = expression.xreplace(rest)
        if value.is_number and value.is_finite is not False:
            moved[symbol] = value
    return moved
