"""Shorter forms for reading, in bounded time; the value never changes."""

from __future__ import annotations

from collections.abc import Callable

import sympy as sp

from ulna.base import Status
from ulna.symbolic.budget import attempt
from ulna.symbolic.embed import embed
from ulna.symbolic.zero import SampledZero

_LARGE = 400
"""Operations above which only the cheap rewritings are tried."""


def tidy(expression: sp.Expr, *, seconds: float = 0.5) -> sp.Expr:
    """The shortest form found within the time, or the expression itself.

    Tried from cheap to dear: common factors, one fraction, cancelled fraction, factors, trigonometric identities,
    SymPy's `simplify`; each on the shortest form so far. Every new form is compared with the input at random
    points, because some of SymPy's rewritings hold on part of the domain only.

    Args:
        expression: any expression.
        seconds: s, for all rewritings together.
    """
    best = sp.sympify(expression)
    if best.is_Atom or seconds <= 0:
        return best
    found: list[sp.Expr] = [best]
    # The candidates survive in `found` when the time is spent in the middle.
    attempt(seconds, "tidy", _collect_forms, best, found)
    shortest = min(found, key=_length)
    if shortest is not best and _agree(best, shortest):
        return shortest
    return best


def _collect_forms(expression: sp.Expr, found: list[sp.Expr]) -> None:
    if SampledZero()(expression).status is Status.PROVED:
        found.append(sp.S.Zero)
        return
    exact = attempt(1.0, "normal form", normal_form, expression)
    # A sign function that was not there before reads worse than the root or modulus it came from.
    if exact.value is not None and not exact.value.has(sp.sign):
        found.append(exact.value)
    cheap: list[Callable[[sp.Expr], sp.Expr]] = [sp.factor_terms, sp.together, sp.expand]
    dear: list[Callable[[sp.Expr], sp.Expr]] = [sp.cancel, sp.trigsimp, sp.simplify]
    for rewrite in cheap + (dear if sp.count_ops(expression) <= _LARGE else []):
        best = min(found, key=_length)
        if _length(best)[0] <= 2:
            return
        for start in dict.fromkeys((best, expression)):
            found.append(rewrite(start))


def normal_form(expression: sp.Expr) -> sp.Expr:
    """One fraction in lowest terms and irreducible factors, over sines, exponentials, logarithms and roots.

    Raises:
        NotEmbeddableError, TooLargeError, ZeroDivisionError: see `ulna.symbolic.embed.embed`.
    """
    ring, [element] = embed([expression])
    return ring.factored(ring.make(*element))


def _length(expression: sp.Expr) -> tuple[int, int]:
    return int(sp.count_ops(expression)), len(str(expression))


def _agree(first: sp.Expr, second: sp.Expr) -> bool:
    return SampledZero(points=4, seconds=0)(first - second).holds
