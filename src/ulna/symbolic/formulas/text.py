"""Expressions as formula text that the formula parser reads back, and numbers as exact rationals."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from decimal import Decimal
from fractions import Fraction
from itertools import islice
from math import isfinite
from typing import Any

import sympy as sp
from sympy.printing.str import StrPrinter

MOST_DIGITS = 4000
"""Of a number that is meant; Python prints no integer of more than 4300."""
_MOST = 10**MOST_DIGITS


class FormulaPrinter(StrPrinter):
    """SymPy's text with the few names that differ from the formula language of plants."""

    def _print_Exp1(self, expr: sp.Expr) -> str:  # noqa: ARG002  (the printer's signature)
        return "exp(1)"

    def _print_Abs(self, expr: sp.Expr) -> str:
        return f"abs({self._print(expr.args[0])})"

    def _print_Min(self, expr: sp.Expr) -> str:
        return f"min({self.stringify(expr.args, ', ')})"

    def _print_Max(self, expr: sp.Expr) -> str:
        return f"max({self.stringify(expr.args, ', ')})"

    def _print_Heaviside(self, expr: sp.Expr) -> str:
        return f"heaviside({self._print(expr.args[0])})"


def formula(expression: sp.Expr) -> str:
    """The expression as text in the formula language (`symbolic.parse` reads it back)."""
    return FormulaPrinter().doprint(expression)


def is_longer(value: Any, parts: int) -> bool:
    """Whether expressions, or lists and mappings of them, have more parts than that; nothing is printed to find out."""
    whole = list(value.values()) if isinstance(value, Mapping) else value
    return sum(1 for _ in islice(sp.preorder_traversal(whole), parts + 1)) > parts


def excerpt(expression: sp.Expr, parts: int) -> str:
    """`formula`, or how long it would be: millions of characters cost a minute and nobody reads them."""
    return f"an expression of more than {parts} parts" if is_longer(expression, parts) else formula(expression)


def listing(title: str, rows: Iterable[tuple[str, sp.Expr]], *, limit: int = 160) -> str:
    """A title and one indented equation a line, long right-hand sides cut: what objects show in a terminal."""
    lines = [title]
    for name, value in rows:
        text = excerpt(value, 2_000)
        lines.append(f"  {name} = {text if len(text) <= limit else f'{text[:limit]}… ({len(text)} characters)'}")
    return "\n".join(lines)


def exact(value: Any) -> sp.Expr:
    """An exact number: what the decimal text of `value` says, never its binary neighbour (0.1 → 1/10).

    Raises:
        ValueError: for NaN, infinity and what is no number.
    """
    if isinstance(value, sp.Expr):
        number = value
    elif isinstance(value, bool):
        raise ValueError(f"{value} is not a number")
    elif isinstance(value, Decimal | float):
        if not isfinite(value):
            raise ValueError(f"{value} is not a finite number")
        number = decimal(str(value))
    elif isinstance(value, str):
        number = sp.Rational(*(decimal(part) for part in value.split("/", 1)))
    elif isinstance(value, int | Fraction):
        if abs(value) > _MOST:
            raise ValueError("the number has thousands of digits")
        number = sp.Rational(value)
    else:
        number = decimal(str(float(value)))  # NumPy scalars
    if not number.is_number or number.is_finite is False:
        raise ValueError(f"{value} is not a finite number")
    return sp.nsimplify(number, rational=True) if number.has(sp.Float) else number


def decimal(text: str) -> sp.Rational:
    """The number that a decimal text says, exactly.

    Raises:
        ValueError: for what is no number, or one of thousands of digits.
    """
    exponent = re.search(r"[eE]([+-]?\d+)", text)
    if len(text) > MOST_DIGITS or (exponent and abs(int(exponent.group(1)[:8])) > MOST_DIGITS):
        raise ValueError(f"{text[:70]} has too many digits")
    return sp.Rational(text)
