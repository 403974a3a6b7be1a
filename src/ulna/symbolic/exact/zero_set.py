"""The zero set of an expression, written as the shortest expression with the same zeros."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from ulna.symbolic.exact.budget import attempt
from ulna.symbolic.exact.simplify import tidy


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
    moving = []
    for factor in sp.Mul.make_args(numerator):
        base, exponent = factor.as_base_exp()
        bare = base if exponent.is_positive else factor
        if exponent.is_negative or isinstance(factor, sp.exp) or not bare.free_symbols & set(variables):
            continue
        moving.append(bare)
    return sp.Mul(*dict.fromkeys(moving)) if moving else sp.Integer(1)
