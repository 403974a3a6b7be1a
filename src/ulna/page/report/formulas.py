"""Formulas of a report, as text where they cannot be set."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import sympy as sp

from ulna.base import FormulaError, mathml
from ulna.page.report.quantities import number_text
from ulna.report import Block, Formula, Text, value_text, verbatim
from ulna.symbolic.formulas import equations_latex, expression_latex, is_longer

_SHORT = 30
"""Parts of an expression that fits into a cell of a table."""
_LONGEST = 240
"""Characters of a value that a table shows."""
_REAL = 1e-6
"""Imaginary part of a pole, of its size, that is rounding."""


def set_formulas(latex: str, caption: str = "") -> Iterator[Block]:
    """The display environments `$$…$$` of a text, or LaTeX without dollar signs."""
    for part in filter(None, latex.split("$$")):
        try:
            mathml(part, display=True)
        except FormulaError:
            yield Text(text=verbatim(part))
        else:
            yield Formula(latex=part, caption=caption)


def rows_of(rows: Mapping[str, sp.Expr], caption: str) -> Iterator[Block]:
    """Equations one below the other; left sides are LaTeX."""
    return set_formulas(equations_latex(rows.items()), caption)


def cell(value: Any) -> str:
    """A value in a cell: expressions set where they are short, else as text."""
    entries = list(value) if isinstance(value, list | tuple) else [value]
    if entries and all(isinstance(each, sp.Expr) for each in entries) and not is_longer(entries, _SHORT):
        return ", ".join(map(_set, entries))
    return cut(value_text(value))


def cut(text: str) -> str:
    """The user's text as text, as far as a table shows it."""
    return verbatim(text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…")


def _set(expression: sp.Expr) -> str:
    latex = expression_latex(expression)
    try:
        mathml(latex)
    except FormulaError:
        latex = ""
    return cut(value_text(expression)) if not latex or "$" in latex else f"${latex}$"


def numbers(values: Sequence[complex]) -> str:
    """Poles as people write them: the slowest first, a pair as one."""
    rows = sorted((p for p in values if p.imag > -_REAL * abs(p)), key=lambda p: (-p.real, abs(p.imag)))
    return ", ".join(
        f"{number_text(p.real)} ± {number_text(p.imag)}j" if p.imag > _REAL * abs(p) else number_text(p.real)
        for p in rows
    )
