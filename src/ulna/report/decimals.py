"""Fractions as decimals, for reading."""

from __future__ import annotations

import sympy as sp


def with_decimals(expression: sp.Expr | sp.MatrixBase, digits: int) -> sp.Expr | sp.MatrixBase:
    """Return the expression with fractions as decimals of `digits` digits, for reading; integers and exponents stay."""
    if isinstance(expression, sp.MatrixBase):
        return expression.applyfunc(lambda entry: with_decimals(entry, digits))
    if expression.is_Rational and not expression.is_Integer:
        return sp.Float(expression, digits)
    if expression.is_Pow:
        base, exponent = expression.as_base_exp()
        if base.is_Integer and exponent.is_negative:
            return sp.Float(expression, digits)
        return sp.Pow(with_decimals(base, digits), exponent)
    if not expression.args:
        return expression
    return expression.func(*(with_decimals(part, digits) for part in expression.args))
