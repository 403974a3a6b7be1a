"""Numbers put into expressions that may have no value there."""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp


def put_in(expression: sp.Expr, values: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
    """The expression with the values in it; NaN where SymPy raises: a minimum, a comparison of what is infinite."""
    try:
        return expression.subs(dict(values))
    except (ArithmeticError, TypeError, ValueError):
        return sp.nan
