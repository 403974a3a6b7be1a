"""Equations of rest made fewer: what follows linearly from the others is put in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np
import sympy as sp

from ulna.symbolic.formulas import put_in
from ulna.symbolic.solving import nowhere_zero

Box: TypeAlias = Mapping[sp.Symbol, tuple[float, float]]
"""(lower, upper) by unknown."""


def reduced(
    rates: Sequence[sp.Expr], unknowns: Sequence[sp.Symbol], box: Box
) -> tuple[list[sp.Expr], dict[sp.Symbol, sp.Expr]]:
    """What is left of the equations when states that follow linearly are put in, and those as expressions of the rest.

    A state is taken from an equation that is linear in it with a factor that vanishes nowhere in the box.
    """
    equations, rest = [r for r in rates if r != 0], dict[sp.Symbol, sp.Expr]()
    bounded = {s: sides for s, sides in box.items() if np.isfinite(sides).all()}
    going = True
    while going:
        going = False
        for symbol in sorted((u for u in unknowns if u not in rest), key=lambda s: s in box):
            for equation in equations:
                factor = equation.diff(symbol)
                if not equation.has(symbol) or factor.has(symbol) or not nowhere_zero(factor, bounded):
                    continue
                solution = put_in(equation, {symbol: sp.Integer(0)}) / -factor
                equations = [
                    e for other in equations if other is not equation and (e := _with(other, symbol, solution))
                ]
                rest = {s: e.xreplace({symbol: solution}) for s, e in rest.items()} | {symbol: solution}
                going = True
                break
            if going:
                break
    return equations, rest


def _with(equation: sp.Expr, symbol: sp.Symbol, solution: sp.Expr) -> sp.Expr:
    """The equation with a solution put in; nothing if that leaves zero."""
    if not equation.has(symbol):
        return equation
    changed = equation.xreplace({symbol: solution})
    return sp.Integer(0) if sp.expand(changed) == 0 else changed
