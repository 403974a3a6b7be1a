"""Roots: elimination down to one equation, all its real roots in a range by interval arithmetic, bounded solving."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
import sympy as sp

from ulna.base import Verdict
from ulna.symbolic.exact.attempts import attempt

_SMALLEST_PIECE = 1e-9
_MAX_PIECES = 20_000


@dataclass(frozen=True, slots=True, kw_only=True)
class RealRoots:
    """Real roots of an equation in a range.

    Attributes:
        values: in ascending order.
        pieces: intervals looked at; unresolved: those where nothing could be decided.
    """

    values: tuple[float, ...]
    pieces: int
    unresolved: tuple[tuple[float, float], ...]

    def complete(self, claim: str) -> Verdict:
        """Whether these are all the roots, said as `claim`."""
        if self.unresolved:
            return Verdict.undecided(claim, unresolved=[f"[{a:g}, {b:g}]" for a, b in self.unresolved[:3]])
        return Verdict.proved(claim, method="interval arithmetic", pieces=self.pieces)


def solutions(
    equations: Sequence[sp.Expr], unknowns: Sequence[sp.Symbol], *, seconds: float = 2.0
) -> list[dict[sp.Symbol, sp.Expr]]:
    """What SymPy's `solve` finds within the time; empty when it finds nothing or runs out."""
    return solutions_in_time(equations, unknowns, seconds=seconds) or []


def solutions_in_time(
    equations: Sequence[sp.Expr], unknowns: Sequence[sp.Symbol], *, seconds: float
) -> list[dict[sp.Symbol, sp.Expr]] | None:
    """The same; None where the time ran out."""
    found = attempt(seconds, "solve", sp.solve, list(equations), list(unknowns), dict=True)
    return None if found.ran_out else found.value or []


def eliminate(
    rates: list[sp.Expr], unknown: sp.Symbol, others: list[sp.Symbol]
) -> tuple[sp.Expr, dict[sp.Symbol, sp.Expr]] | None:
    """One equation in `unknown` and the others as expressions in it, each taken from an equation linear in it.

    None where that does not work out.
    """
    equations, rest, left = [r for r in rates if r != 0], {}, list(others)
    while left:
        for symbol in left:
            usable = next((e for e in equations if e.has(symbol) and not e.diff(symbol).has(*left)), None)
            if usable is not None:
                break
        else:
            return None
        solution = sp.simplify(-usable.subs(symbol, 0) / usable.diff(symbol))
        equations = [sp.simplify(e.subs(symbol, solution)) for e in equations if e is not usable]
        equations = [e for e in equations if e != 0]
        rest = {s: e.subs(symbol, solution) for s, e in rest.items()} | {symbol: solution}
        left.remove(symbol)
    numerators = [sp.fraction(sp.together(e))[0] for e in equations if e.has(unknown)]
    return (numerators[0], rest) if len(numerators) == 1 and len(equations) == 1 else None


def real_roots(equation: sp.Expr, unknown: sp.Symbol, lower: float, upper: float) -> RealRoots:
    """All roots in [lower, upper]: pieces on which an interval excludes a root or a monotone slope shows one."""
    context = mpmath.iv
    value = sp.lambdify(unknown, equation, modules=[_interval_functions(context), "mpmath"])
    slope = sp.lambdify(unknown, sp.diff(equation, unknown), modules=[_interval_functions(context), "mpmath"])
    exact_value = sp.lambdify(unknown, equation, "mpmath")
    pieces, roots, doubtful, seen = [(lower, upper)], [], [], 0
    while pieces and seen < _MAX_PIECES:
        left, right = pieces.pop()
        seen += 1
        piece = context.mpf([left, right])
        if 0 not in context.mpf(value(piece)):
            continue
        if 0 not in context.mpf(slope(piece)):
            ends = exact_value(mpmath.mpf(left)), exact_value(mpmath.mpf(right))
            if ends[0] * ends[1] <= 0:
                roots.append(float(mpmath.findroot(exact_value, (left, right), solver="anderson", tol=1e-28)))
            continue
        if right - left < _SMALLEST_PIECE:
            doubtful.append((left, right))
            continue
        # Cut off the middle so that a root at a round number does not sit on a seam.
        middle = left + 0.4871 * (right - left)
        pieces += [(left, middle), (middle, right)]
    roots = sorted(roots)
    distinct = [r for k, r in enumerate(roots) if k == 0 or r - roots[k - 1] > 1e-12 * max(1.0, abs(r))]
    return RealRoots(values=tuple(distinct), pieces=seen, unresolved=tuple(pieces + doubtful))


def _interval_functions(context: Any) -> dict[str, Any]:
    def tan(x: Any) -> Any:
        return context.sin(x) / context.cos(x)

    return {
        "sin": context.sin,
        "cos": context.cos,
        "exp": context.exp,
        "log": context.log,
        "sqrt": context.sqrt,
        "tan": tan,
    }
