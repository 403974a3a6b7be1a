"""Refuses to differentiate what has no derivative: abs, sign, min, max, Piecewise and their like, where it has none."""

from __future__ import annotations

from collections.abc import Iterable

import sympy as sp

from ulna.base import UlnaError
from ulna.symbolic.formulas import formula
from ulna.system import NON_SMOOTH


def require_smooth(expressions: Iterable[sp.Expr], asked: str) -> None:
    """Pass if every expression can be differentiated as often as wanted.

    Args:
        expressions: what is about to be differentiated.
        asked: what for, in the user's words.

    Raises:
        UlnaError: names the term that has no derivatives everywhere.
    """
    for expression in expressions:
        terms = expression.atoms(*NON_SMOOTH)
        if terms:
            shown = formula(min(terms, key=lambda term: (term.count_ops(), str(term))))
            raise UlnaError(
                asked,
                f"the term {shown} has to be differentiated, but it is not smooth.",
                "Replace it by a smooth function (tanh(x/eps) for sign(x), sqrt(x**2 + eps**2) for abs(x)), "
                "or leave it out of the model that the design uses.",
            )


def require_slopes(expression: sp.Expr, variables: Iterable[sp.Symbol], asked: str) -> None:
    """Pass if an expression has continuous slopes: w·|w| has them, |w| has not.

    Raises:
        UlnaError: names the term without.
    """
    if not expression.has(*NON_SMOOTH):
        return
    plain = expression.rewrite(sp.Abs) if expression.has(sp.Min, sp.Max) else expression
    slopes = [without_signs(plain.diff(x)) for x in variables]
    if any(slope.has(*_JUMPS) for slope in slopes):
        require_smooth([expression], asked)


def without_signs(expression: sp.Expr) -> sp.Expr:
    """The expression with |a| for a·sign(a) and a for |a|·sign(a), which are continuous."""
    for sign in sorted(expression.atoms(sp.sign), key=str):
        inner = sign.args[0]
        mark = sp.Dummy(real=True)
        marked = expression.xreplace({sign: mark, sp.Abs(inner): inner * mark})
        if not marked.is_polynomial(mark):
            continue  # within another function
        powers = sp.Poly(marked, mark).terms()
        even, odd = (sp.expand(sum((c for (k,), c in powers if k % 2 == side), sp.Integer(0))) for side in (0, 1))
        share = sp.cancel(odd / inner)
        if not sp.denom(sp.together(share)).free_symbols & inner.free_symbols:
            expression = even + share * sp.Abs(inner)
    return expression


_JUMPS = (sp.sign, sp.Heaviside, sp.DiracDelta, sp.Derivative, sp.Subs, sp.floor, sp.ceiling, sp.Piecewise)
