"""Formulas for notebooks, as LaTeX and as elements of a page; one that is too long to read is named by its size."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import sympy as sp
from markupsafe import Markup, escape

from ulna.base import LETTERS, FormulaError, mathml, number_text
from ulna.symbolic.formulas.text import excerpt

_BREAK, _COMMA = Markup("<br>"), Markup(", ")
LONGEST_NUMBER = 9
"""Characters of an exact number that is shown as it is."""
MAX_OPERATIONS = 400
"""Expressions with more operations than this are not typeset."""


def expression_latex(expression: sp.Expr | sp.MatrixBase) -> str:
    """LaTeX of an expression or matrix, or a note of its size when it is too large to read."""
    size = int(sp.count_ops(expression))
    if size > MAX_OPERATIONS:
        return rf"\text{{(expression of {size} operations)}}"
    names = {s: name_latex(s.name) for s in expression.free_symbols}
    return sp.latex(_readable(expression), symbol_names=names, full_prec=False)


def equation_latex(names: Sequence[sp.Symbol], expressions: sp.MatrixBase) -> str:
    """`u = …` in a display environment, without brackets where there is one."""
    if len(names) == 1:
        return f"$${name_latex(names[0].name)} = {expression_latex(expressions[0])}$$"
    return f"$${expression_latex(sp.Matrix(list(names)))} = {expression_latex(expressions)}$$"


def equations_latex(rows: Iterable[tuple[str, sp.Expr]], note: str = "") -> str:
    """Equations one below the other in a display environment, then a line of LaTeX; left sides are LaTeX already."""
    lines = [rf"{left} &= {expression_latex(right)}" for left, right in rows]
    lines += [rf"& {note}"] if note else []
    return r"$$\begin{aligned}" + r" \\ ".join(lines) + r"\end{aligned}$$"


def name_latex(name: str) -> str:
    r"""A name as LaTeX: `theta_hat` a theta with a hat, `m1` an m with an index, a word upright: `y_ref`, `speed`."""
    stem, *rest = name.split("_")
    digits = stem[len(stem.rstrip("0123456789")) :]
    if not stem or digits == stem:
        return rf"\mathrm{{{name.replace('_', ' ')}}}"
    base = _word_latex(stem.removesuffix(digits))
    if "hat" in rest:
        rest.remove("hat")
        base = rf"\hat{{{base}}}"
    below = [digits] * bool(digits) + [_word_latex(part) for part in rest if part]
    return f"{base}_{{{','.join(below)}}}" if below else base


def formula_html(expression: sp.Expr | sp.MatrixBase) -> Markup:
    """An expression or matrix as an element of a page that needs no network; as text where it cannot be set."""
    try:
        return Markup(mathml(expression_latex(expression)))  # noqa: S704 (mathml escapes)
    except FormulaError:
        return escape(excerpt(expression, 500) if isinstance(expression, sp.Expr) else str(expression))


def display_html(latex: str) -> Markup:
    """Display environments (`$$…$$`) as elements of a page that needs no network; as LaTeX where they cannot be set."""
    try:
        return Markup("".join(mathml(part, display=True) for part in latex.split("$$") if part))  # noqa: S704
    except FormulaError:
        return escape(latex)


def value_html(value: object) -> object:
    """What a cell of a table shows of a value: formulas set, of lists and mappings each entry; the rest as it is."""
    if isinstance(value, sp.Expr | sp.MatrixBase):
        return formula_html(value)
    if isinstance(value, Mapping):
        told = {key: each for key, each in value.items() if each is not None and not _is_empty(each)}
        rows = [Markup("{} = {}").format(value_html(key), _inner(each)) for key, each in told.items()]
        return (_BREAK if any(isinstance(each, Mapping) for each in value.values()) else _COMMA).join(rows)
    if isinstance(value, list | tuple):
        return (_BREAK if any(isinstance(each, Mapping) for each in value) else _COMMA).join(
            escape(_inner(each)) for each in value
        )
    if isinstance(value, bool):
        return "yes" if value else "no"
    return number_text(value) if isinstance(value, float | complex) else value


def _is_empty(value: object) -> bool:
    return isinstance(value, Mapping | list | tuple) and not value


def _inner(value: object) -> object:
    """A value inside another one: what has several entries in brackets."""
    shown = value_html(value)
    return Markup("({})").format(shown) if isinstance(value, Mapping | list | tuple) and len(value) > 1 else shown


def _readable(expression: sp.Expr | sp.MatrixBase) -> sp.Expr | sp.MatrixBase:
    """The expression with decimals and long fractions rounded to six digits: nobody reads 54072450001/5000000000."""
    numbers = expression.atoms(sp.Float) | {n for n in expression.atoms(sp.Rational) if len(str(n)) > LONGEST_NUMBER}
    return expression.xreplace({n: sp.Float(n, 6) for n in numbers})


def _word_latex(word: str) -> str:
    if word in LETTERS:
        return f"\\{word}"
    return word if len(word) == 1 or word.isdigit() else rf"\mathrm{{{word}}}"
