"""`html_table`: the one writer of the tables that values show in a notebook; every text is escaped."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from numbers import Complex
from typing import TypeGuard

from markupsafe import Markup, escape

from ulna.base.errors import FormulaError
from ulna.base.formula_element import mathml

_LEFT = ' style="text-align:left"'
_RIGHT = ' style="text-align:right"'
LONGEST = 300
"""Characters of a text in a cell; what is longer is cut and its length told."""


def html_table(
    rows: Iterable[Sequence[object]], *, title: str = "", headings: Sequence[str] = (), below: Sequence[object] = ()
) -> str:
    """An HTML table, the first cell of each row its heading.

    Args:
        rows: cells: numbers are shown with six digits and stand to the right, texts are escaped; what has an `__html__`
            (a formula) is put in as it is.
        title: stands above the table. headings: of the columns. below: further lines under the table, escaped too.
    """
    rows = [tuple(row) for row in rows]
    sides = [_RIGHT if rows and k and _is_number(rows[0][k]) else _LEFT for k in range(len(headings))]
    head = "".join(f"<th{side}>{escape(text)}</th>" for side, text in zip(sides, headings, strict=True))
    body = "".join(f"<tr>{''.join(_cell(k, cell) for k, cell in enumerate(row))}</tr>" for row in rows)
    caption = f'<caption style="text-align:left;white-space:nowrap"><b>{escape(title)}</b></caption>' if title else ""
    lines = "".join(f"<div>{escape(_shown(line))}</div>" for line in below)
    return f"<table>{caption}{f'<thead><tr>{head}</tr></thead>' if head else ''}<tbody>{body}</tbody></table>{lines}"


def number_text(value: Complex | complex) -> str:
    """A number with six digits: `0.467413`, `-2 + 3.4641 j`, `∞`, `nan`."""
    if isinstance(value, bool | int):
        return str(value)
    number = complex(value)
    if number.imag == 0.0:
        return f"{number.real:.6g}".replace("inf", "∞")
    sign = "-" if number.imag < 0 else "+"
    return f"{number.real:.6g} {sign} {abs(number.imag):.6g} j"


def _shown(value: object) -> object:
    """A value as its text, cut where it is long; formulas set where they are short; what brings its own HTML stays."""
    if hasattr(value, "__html__"):
        return value
    text = str(value)
    if len(text) > LONGEST:
        return f"{text[:LONGEST]}… ({len(text)} characters)"
    latex = getattr(value, "_repr_latex_", None)
    if latex is not None:
        try:
            return Markup(mathml(latex().strip("$").removeprefix(r"\displaystyle")))  # noqa: S704
        except FormulaError:
            return text
    return text


def _is_number(cell: object) -> TypeGuard[Complex]:
    return isinstance(cell, Complex) and not isinstance(cell, bool)


def _cell(column: int, cell: object) -> str:
    if _is_number(cell):
        return f"<td{_RIGHT}>{number_text(cell)}</td>"
    tag = "th" if column == 0 else "td"
    return f"<{tag}{_LEFT}>{escape('' if cell is None else _shown(cell))}</{tag}>"
