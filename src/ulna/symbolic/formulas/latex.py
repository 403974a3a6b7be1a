"""LaTeX for notebooks, with a size limit: a formula nobody can read is named by its size instead."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import sympy as sp

MAX_OPERATIONS = 400
"""Expressions with more operations than this are not typeset."""


def expression_latex(expression: sp.Expr | sp.MatrixBase) -> str:
    """LaTeX of an expression or matrix, or a note of its size when it is too large to read."""
    size = int(sp.count_ops(expression))
    if size > MAX_OPERATIONS:
        return rf"\text{{(expression of {size} operations)}}"
    return sp.latex(expression)


def equation_latex(names: Sequence[sp.Symbol], expressions: sp.MatrixBase) -> str:
    """`u = …` in a display environment, without brackets where there is one."""
    if len(names) == 1:
        return f"$${sp.latex(names[0])} = {expression_latex(expressions[0])}$$"
    return f"$${sp.latex(sp.Matrix(list(names)))} = {expression_latex(expressions)}$$"


def system_latex(rates: Mapping[str, sp.Expr], readouts: Mapping[str, sp.Expr], *, discrete: bool = False) -> str:
    """The equations of a system, one line each, in a display environment."""
    left = "{}^{{+}}" if discrete else r"\dot{{{}}}"
    lines = [rf"{left.format(_name(n))} &= {expression_latex(e)}" for n, e in rates.items()]
    lines += [rf"{_name(n)} &= {expression_latex(e)}" for n, e in readouts.items()]
    return r"$$\begin{aligned}" + r" \\ ".join(lines) + r"\end{aligned}$$"


def _name(name: str) -> str:
    return sp.latex(sp.Symbol(name))
