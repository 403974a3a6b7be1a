"""Refuses to differentiate what has no derivative: abs, sign, min, max, Piecewise and their like."""

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
