"""Solves one equation for one unknown on the branch through a given point."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import sympy as sp
from flint import arb
from sympy.simplify.fu import TR2i

from ulna.base import Status
from ulna.symbolic.exact.attempts import attempt
from ulna.symbolic.exact.ball import tape
from ulna.symbolic.exact.quotients import lowest_terms
from ulna.symbolic.exact.zero import SampledZero

Base = Mapping[sp.Basic, sp.Expr]
"""A value for every symbol in play: the point through which the branch goes."""

_CLOSE = arb(10) ** -25

_EDGE = 1e-9
"""Half turns from the end of a branch within which the base point counts as singular."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Isolated:
    """unknown = expression, where every one of `nonzero` does not vanish and every one of `positive` is positive."""

    expression: sp.Expr
    nonzero: tuple[sp.Expr, ...] = ()
    positive: tuple[sp.Expr, ...] = ()


def linear_in(expression: sp.Expr, unknown: sp.Symbol) -> Isolated | None:
    """The solution of expression = 0 if the expression is linear in the unknown."""
    slope = expression.diff(unknown)
    if slope.has(unknown):
        if SampledZero(points=2)(slope.diff(unknown)).status is not Status.PROVED:
            return None
        slope = lowest_terms(slope)
        if slope.has(unknown):
            return None
    if slope == 0:
        return None
    rest = expression.xreplace({unknown: sp.S.Zero})
    if rest.has(sp.nan, sp.zoo, sp.oo):
        rest = sp.expand(expression - slope * unknown)
        if rest.has(unknown):
            return None
    return Isolated(expression=-rest / slope, nonzero=() if slope.is_number else (slope,))


def peeled(expression: sp.Expr, unknown: sp.Symbol, base: Base) -> Isolated | None:
    """The solution of expression = 0 if the unknown stands in one place under functions that can be inverted.

    Each inverse takes the branch on which the base point lies: x^2 = w gives sqrt(w) or -sqrt(w), sin(u) = w gives
    asin(w) or pi - asin(w), both up to a multiple of 2 pi.
    """
    found = outer_layers(expression, unknown, base)
    return None if found is None or found.inner != unknown else found.solved


@dataclass(frozen=True, slots=True, kw_only=True)
class Peeled:
    """An equation inner = solved.expression, the unknown standing in `inner` only."""

    inner: sp.Expr
    solved: Isolated


def outer_layers(expression: sp.Expr, unknown: sp.Symbol, base: Base) -> Peeled | None:
    """Expression = 0 with all functions taken off under which the unknown stands; None if one cannot be inverted."""
    left, right = expression, sp.S.Zero
    nonzero: list[sp.Expr] = []
    positive: list[sp.Expr] = []
    while left != unknown:
        if isinstance(left, sp.Add | sp.Mul):
            rest, inner = left.as_independent(unknown, as_Add=isinstance(left, sp.Add))
            if inner.func is left.func:
                # The unknown stands in several factors or terms; sin(u) / cos(u) is one function after all.
                joined = TR2i(inner)
                if joined.func is left.func:
                    break
                inner = joined
            if isinstance(left, sp.Add):
                right = right - rest
            else:
                right = right / rest
                nonzero.append(rest)
            left = inner
            continue
        step = _one_layer(left, right, unknown, base)
        if step is None:
            return None
        left, solved = step
        right = solved.expression
        nonzero.extend(solved.nonzero)
        positive.extend(solved.positive)
    return Peeled(inner=left, solved=Isolated(expression=right, nonzero=tuple(nonzero), positive=tuple(positive)))


def _one_layer(left: sp.Expr, right: sp.Expr, unknown: sp.Symbol, base: Base) -> tuple[sp.Expr, Isolated] | None:
    """(u, solution for u) of F(u) = right for the outermost function F."""
    if isinstance(left, sp.Pow) and left.base is not sp.E:
        if left.exp.has(unknown):
            if left.base.has(unknown):
                return None
            return left.exp, Isolated(expression=sp.log(right) / sp.log(left.base), positive=(right, left.base))
        solved = root(left.base, left.exp, right, base)
        return None if solved is None else (left.base, solved)
    if isinstance(left, sp.atan2):
        return _one_of_two(left, right, unknown)
    if len(left.args) != 1:
        return (left.exp, Isolated(expression=sp.log(right), positive=(right,))) if left.func is sp.Pow else None
    rule = _LAYERS.get(type(left))
    if rule is None:
        return None
    inner = left.args[0]
    solved = rule(right, number_at(inner, base))
    return None if solved is None else (inner, solved)


def _one_of_two(left: sp.Expr, right: sp.Expr, unknown: sp.Symbol) -> tuple[sp.Expr, Isolated] | None:
    """The solution of atan2(y, x) = right for y or for x: y = x tan(right)."""
    y, x = left.args
    if y.has(unknown) and x.has(unknown):
        return None
    if y.has(unknown):
        return y, Isolated(expression=x * sp.tan(right), nonzero=(x,))
    return x, Isolated(expression=y / sp.tan(right), nonzero=(y,))


def number_at(expression: sp.Expr, base: Base) -> float:
    """The value at the base point in double precision; NaN where it is not real."""
    return float(tape([expression])(base)[0].mid())


def root(inner: sp.Expr, exponent: sp.Expr, right: sp.Expr, base: Base) -> Isolated | None:
    """The solution for u of u^exponent = right on the branch through the base point, u being `inner`."""
    if not isinstance(exponent, sp.Integer):
        # A real power with such an exponent lives on positive numbers.
        return Isolated(expression=right ** (1 / exponent), positive=(right,))
    if exponent < 0:
        solved = root(inner, -exponent, 1 / right, base)
        return solved and Isolated(
            expression=solved.expression, nonzero=(right, *solved.nonzero), positive=solved.positive
        )
    if exponent == 1:
        return Isolated(expression=right)
    value = number_at(inner, base)
    if value > 0:
        return Isolated(expression=right ** (1 / exponent), positive=(right,))
    if value < 0:
        power = right if exponent % 2 == 0 else -right
        return Isolated(expression=-(power ** (1 / exponent)), positive=(power,))
    return None


def _half_turns(value: float, offset: float) -> int | None:
    """k with value in the open interval ((k - offset) pi, (k + 1 - offset) pi); None on or next to its ends."""
    if math.isnan(value):
        return None
    turns = value / math.pi + offset
    return None if abs(turns - round(turns)) < _EDGE else math.floor(turns)


def _asin(right: sp.Expr, value: float) -> Isolated | None:
    half = _half_turns(value, 0.5)
    if half is None:
        return None
    angle = (-1) ** half * sp.asin(right) + half * sp.pi
    return Isolated(expression=angle, positive=(1 - right**2,))


def _acos(right: sp.Expr, value: float) -> Isolated | None:
    half = _half_turns(value, 0.0)
    if half is None:
        return None
    angle = sp.acos(right) + half * sp.pi if half % 2 == 0 else (half + 1) * sp.pi - sp.acos(right)
    return Isolated(expression=angle, positive=(1 - right**2,))


def _atan(right: sp.Expr, value: float) -> Isolated | None:
    half = _half_turns(value, 0.5)
    return None if half is None else Isolated(expression=sp.atan(right) + half * sp.pi)


def _signed(inverse: Callable[[sp.Expr], sp.Expr], bound: sp.Expr, value: float) -> Isolated | None:
    if value == 0 or math.isnan(value):
        return None
    return Isolated(expression=inverse(bound) if value > 0 else -inverse(bound))


def _acosh(right: sp.Expr, value: float) -> Isolated | None:
    solved = _signed(sp.acosh, right, value)
    return solved and Isolated(expression=solved.expression, positive=(right - 1,))


_LAYERS: dict[type, Callable[[sp.Expr, float], Isolated | None]] = {
    sp.exp: lambda w, _: Isolated(expression=sp.log(w), positive=(w,)),
    sp.log: lambda w, _: Isolated(expression=sp.exp(w)),
    sp.sin: _asin,
    sp.cos: _acos,
    sp.tan: _atan,
    sp.asin: lambda w, _: Isolated(expression=sp.sin(w)),
    sp.acos: lambda w, _: Isolated(expression=sp.cos(w)),
    sp.atan: lambda w, _: Isolated(expression=sp.tan(w)),
    sp.sinh: lambda w, _: Isolated(expression=sp.asinh(w)),
    sp.cosh: _acosh,
    sp.tanh: lambda w, _: Isolated(expression=sp.atanh(w), positive=(1 - w**2,)),
    sp.asinh: lambda w, _: Isolated(expression=sp.sinh(w)),
    sp.atanh: lambda w, _: Isolated(expression=sp.tanh(w)),
    sp.Abs: lambda w, value: _signed(lambda one: one, w, value),
}


def harmonic(expression: sp.Expr, unknown: sp.Symbol, base: Base) -> Isolated | None:
    """The solution of A cos x + B sin x + C = 0 on the branch of the base point, as in an arm's inverse kinematics.

    x = ±acos(−C/r) + an angle of (A, B), r² = A² + B², both angles on the branch of the point; sums of angles are
    written out first.
    """
    expanded = sp.expand(sp.expand_trig(expression))
    cosine, sine = sp.cos(unknown), sp.sin(unknown)
    A, B = expanded.coeff(cosine), expanded.coeff(sine)
    C = sp.expand(expanded - A * cosine - B * sine)
    if A == 0 or B == 0 or any(part.has(unknown) for part in (A, B, C)):
        return None
    a, b, at = (number_at(part, base) for part in (A, B, unknown))
    if not math.isfinite(a * b * at) or abs(a) < _EDGE:
        return None
    shift = math.atan(b / a) + (math.pi if a < 0 else 0.0)
    swing = _acos(-C / _root_of_sum(A, B), at - shift)
    if swing is None:
        return None
    angle = swing.expression + sp.atan(B / A) + (sp.pi if a < 0 else 0)
    return Isolated(expression=angle, nonzero=(A,), positive=swing.positive)


def _root_of_sum(A: sp.Expr, B: sp.Expr) -> sp.Expr:
    squares = A**2 + B**2
    return sp.sqrt(lowest_terms(squares))


def solved_branches(expression: sp.Expr, unknown: sp.Symbol, base: Base, *, seconds: float) -> Iterator[Isolated]:
    """Those of SymPy's solutions of expression = 0 that go through the base point."""
    found = attempt(seconds, "solve", sp.solve, expression, unknown)
    if found.value is None:
        return
    program = [one for one in found.value if isinstance(one, sp.Expr) and not one.has(sp.I, sp.CRootOf)]
    for one in program:
        value = tape([one - unknown])(base)[0]
        if value.is_finite() and value.contains(0) and abs(value) < _CLOSE:
            yield Isolated(expression=one)
