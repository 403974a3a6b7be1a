"""Shorter forms for reading, in bounded time; the value never changes, or for `zero_set` the zeros."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache

import sympy as sp
from sympy.functions.elementary.hyperbolic import HyperbolicFunction
from sympy.functions.elementary.trigonometric import TrigonometricFunction
from sympy.simplify.fu import TR2i

from ulna.base import Status
from ulna.symbolic.exact.angles import over_relative_angles
from ulna.symbolic.exact.attempts import attempt
from ulna.symbolic.exact.embed import attempt_exactly
from ulna.symbolic.exact.quotients import lowest_terms
from ulna.symbolic.exact.zero import SampledZero

_LARGE = 400
"""Operations above which only the cheap rewritings are tried."""

_FEW = 12
"""Operations below which nothing is gained by other angles."""

_CIRCULAR = 3
"""Different sines and cosines from which on other angles are tried."""

_MIDDLING = 120
"""Operations above which SymPy's `simplify` is left out: it takes seconds and seldom finds more."""


def tidy(expression: sp.Expr, *, seconds: float = 0.5) -> sp.Expr:
    """The shortest form found within the time, or the expression itself.

    Tried from cheap to dear: zero, the exact normal form in factors, common factors, one fraction, expansion; where
    several sines meet, trigonometric identities; where there are functions, SymPy's `simplify`. Every new form is
    compared with the input at random points, because some of SymPy's rewritings hold on part of the domain only.

    Args:
        expression: any expression.
        seconds: s, for all rewritings together.
    """
    return _shortest(expression, _collect_forms, seconds)


def shortened(expression: sp.Expr, *, seconds: float = 0.2) -> sp.Expr:
    """As `tidy`, by the cheap rewritings only: for results in the middle of a computation."""
    return _shortest(expression, _collect_cheap_forms, seconds)


def _shortest(expression: sp.Expr, collect: Callable[[sp.Expr, list[sp.Expr]], None], seconds: float) -> sp.Expr:
    if expression.is_Atom or seconds <= 0:
        return expression
    found: list[sp.Expr] = [expression]
    # The candidates survive in `found` when the time is spent in the middle.
    attempt_exactly(seconds, "tidy", collect, expression, found)
    for form in sorted(found, key=_length):
        if form == expression or _agree(expression, form):
            return form
    return expression


def _collect_cheap_forms(expression: sp.Expr, found: list[sp.Expr]) -> None:
    if SampledZero(points=2)(expression).status is Status.PROVED:
        found.append(sp.S.Zero)
        return
    exact = lowest_terms(expression, seconds=math.inf)
    found.append(exact)
    for one in dict.fromkeys((exact, expression)):
        _rewrite(sp.factor_terms, one, found)
    for one in tuple(found):
        if one.has(sp.sin):
            _rewrite(TR2i, one, found)
    if sp.count_ops(expression) <= _LARGE:
        _rewrite(sp.expand, expression, found)


def _collect_forms(expression: sp.Expr, found: list[sp.Expr]) -> None:
    _collect_cheap_forms(expression, found)
    if sp.count_ops(expression) > _LARGE:
        return
    if _collect_over_relative_angles(expression, found):
        return
    rewritings: list[Callable[[sp.Expr], sp.Expr]] = [sp.together]
    identities = _circular_degree(min(found, key=_length)) > 1
    if identities:
        rewritings.append(sp.trigsimp)
    if (identities or expression.has(sp.exp, sp.log, HyperbolicFunction)) and sp.count_ops(expression) <= _MIDDLING:
        rewritings.append(sp.simplify)
    for rewrite in rewritings:
        best = min(found, key=_length)
        if _length(best)[0] <= 2:
            return
        for start in dict.fromkeys((best, expression)):
            _rewrite(rewrite, start, found)


def _circular_degree(expression: sp.Expr) -> int:
    """How many sines and cosines multiply each other; what is linear in them obeys no identity that shortens it."""
    if not expression.has(TrigonometricFunction):
        return 0
    parts = [_circular_degree(part) for part in expression.args]
    if expression.is_Add:
        return max(parts)
    if expression.is_Mul:
        return sum(parts)
    return 1 if isinstance(expression, TrigonometricFunction) and not max(parts) else 2


def _collect_over_relative_angles(expression: sp.Expr, found: list[sp.Expr]) -> bool:
    """Adds forms over the difference or sum of two angles from which an angle vanishes; whether there is one."""
    if _length(min(found, key=_length))[0] < _FEW or len(expression.atoms(sp.sin, sp.cos, sp.tan)) < _CIRCULAR:
        return False
    for over, relative, meaning in over_relative_angles(expression):
        form = lowest_terms(over, seconds=math.inf)
        if len(form.free_symbols) < len(expression.free_symbols):
            found.append(form.xreplace({relative: meaning}))
            return True
    return False


def _rewrite(rewrite: Callable[[sp.Expr], sp.Expr], expression: sp.Expr, found: list[sp.Expr]) -> None:
    """Add the rewritten expression; SymPy's rewritings may fail in any way, the time is the caller's."""
    form = attempt(math.inf, "rewrite", rewrite, expression).value
    if form is not None:
        found.append(form)


def zero_set(expression: sp.Expr, variables: Sequence[sp.Symbol], *, seconds: float = 1.0) -> sp.Expr:
    """An expression that vanishes where the given one does, as the variables move.

    Denominators, constant factors, factors of parameters alone, and multiplicities are left out.

    Args:
        expression: any expression.
        variables: what moves; every other symbol is a generic constant.
        seconds: time for factoring.
    """
    whole = tidy(expression, seconds=seconds / 2)
    factored = attempt(seconds / 2, "factor", sp.factor, sp.numer(sp.together(whole))).value
    numerator = whole if factored is None else factored
    moving = dict.fromkeys(_moving_factors(numerator, set(variables)))
    return sp.Mul(*moving) if moving else sp.Integer(1)


def _moving_factors(product: sp.Expr, variables: set[sp.Symbol]) -> Iterator[sp.Expr]:
    """The factors that can vanish as the variables move, those under a root among them, each to the first power."""
    for factor in sp.Mul.make_args(product):
        base, exponent = factor.as_base_exp()
        bare = base if exponent.is_positive else factor
        if exponent.is_negative or isinstance(factor, sp.exp) or not bare.free_symbols & variables:
            continue
        if bare.is_Mul:
            yield from _moving_factors(bare, variables)
        else:
            yield bare


@lru_cache(maxsize=1024)
def _length(expression: sp.Expr) -> tuple[int, int]:
    return int(sp.count_ops(expression)), sum(1 for _ in sp.preorder_traversal(expression))


def _agree(first: sp.Expr, second: sp.Expr) -> bool:
    return SampledZero(points=4, seconds=0)(first - second).holds
