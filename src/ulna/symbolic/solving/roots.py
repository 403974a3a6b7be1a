"""Roots: elimination down to one equation, bounded solving."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from ulna.symbolic.exact.attempts import attempt


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
