"""Series of inverse functions against SymPy's own."""

from __future__ import annotations

import pytest
import sympy as sp

from ulna.symbolic.solving.taylor import taylor_coefficients

X = sp.Symbol("x", real=True)


@pytest.mark.parametrize(
    ("function", "start"), [(sp.asinh, 0), (sp.atanh, 0), (sp.acosh, 2), (sp.acos, 0), (sp.asinh, sp.Rational(3, 4))]
)
def test_inverse_functions_have_series(function: type[sp.Function], start: sp.Expr | int) -> None:
    [found] = taylor_coefficients([function(X)], {X: [sp.Integer(0) + start, sp.Integer(1)]}, 4)
    for k, coefficient in enumerate(found):
        assert sp.simplify(coefficient - function(X).diff(X, k).subs(X, start) / sp.factorial(k)) == 0
