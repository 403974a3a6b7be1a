"""Printed formulas as data: read by Python's own grammar, never run; numbers keep the digits they are printed with."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from types import MappingProxyType
from typing import Any, Final

import sympy as sp

from ulna.base import FormulaError

_BINARY: Final[dict[type[ast.operator], Callable[[Any, Any], Any]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_FUNCTIONS: Final[Mapping[str, Any]] = MappingProxyType({"cos": sp.cos, "sin": sp.sin})
_LONGEST: Final = 2000
_HIGHEST_POWER: Final = 9


@dataclass(frozen=True, slots=True, kw_only=True)
class Digits:
    """A number as printed.

    Attributes:
        text: its digits, without sign (`"34.59"`).
        value: the exact rational number they say.
        step: one unit of the last digit (`1/100`).
    """

    text: str
    value: sp.Rational
    step: sp.Rational


@dataclass(frozen=True, slots=True, kw_only=True)
class Printed:
    """A printed formula with a mark in place of each of its numbers.

    Attributes:
        text: as it stands in the data file.
        expression: with marks; exponents are not printed numbers and stay.
        marks: mark → its number.
    """

    text: str
    expression: sp.Expr
    marks: Mapping[sp.Symbol, Digits]

    @property
    def value(self) -> sp.Expr:
        """The formula with its printed numbers, taken as exact."""
        return self.expression.xreplace({mark: digits.value for mark, digits in self.marks.items()})


def read_digits(text: str) -> Digits:
    """Return an unsigned printed number with its digits.

    >>> read_digits("34.59").step
    1/100

    Raises:
        FormulaError: not a plain decimal number.
    """
    whole, point, part = text.partition(".")
    if not whole.isascii() or not whole.isdigit() or (point and not (part.isascii() and part.isdigit())):
        raise FormulaError(f"the printed number '{text}'", "it is not a plain decimal number.")
    exact = Fraction(Decimal(text))
    value = sp.Rational(exact.numerator, exact.denominator)
    return Digits(text=text, value=value, step=sp.Rational(1, 10 ** len(part)))


def read_formula(text: str, names: Mapping[str, Any] | None = None) -> Any:
    """Return what the formula says, with its numbers as exact rationals.

    Args:
        text: names, numbers, `+ - * / **`, brackets, calls of known functions.
        names: what names and further functions stand for; any other name is a real symbol.

    Raises:
        FormulaError: anything else in the text, or operands that do not fit together.
    """
    return _read(text, names or {}, lambda digits: digits.value)


def read_printed(text: str, names: Mapping[str, Any] | None = None) -> Printed:
    """Return the formula with its numbers marked; see `read_formula`.

    Raises:
        FormulaError: as `read_formula`.
    """
    marks: dict[sp.Symbol, Digits] = {}

    def mark(digits: Digits) -> sp.Symbol:
        symbol = sp.Dummy(f"printed_{digits.text}", positive=True)
        marks[symbol] = digits
        return symbol

    expression = _read(text, names or {}, mark)
    return Printed(text=text, expression=expression, marks=MappingProxyType(marks))


def _read(text: str, names: Mapping[str, Any], number: Callable[[Digits], Any]) -> Any:
    if len(text) > _LONGEST:
        raise FormulaError("a printed formula", f"it has {len(text)} characters, more than {_LONGEST}.")
    try:
        tree = ast.parse(text, mode="eval")
    except (SyntaxError, ValueError) as error:
        raise FormulaError(f"the printed formula '{text}'", f"it cannot be read: {error}.") from error
    try:
        return _value(tree.body, text, names, number)
    except (TypeError, sp.ShapeError, ZeroDivisionError) as error:
        raise FormulaError(f"the printed formula '{text}'", f"its parts do not fit together: {error}.") from error


def _value(node: ast.expr, text: str, names: Mapping[str, Any], number: Callable[[Digits], Any]) -> Any:
    def inner(part: ast.expr) -> Any:
        return _value(part, text, names, number)

    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return number(read_digits(ast.get_source_segment(text, node) or ""))
    if isinstance(node, ast.Name):
        return names[node.id] if node.id in names else sp.Symbol(node.id, real=True)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return -inner(node.operand)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
        return inner(node.left) ** _exponent(node.right, text)
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        return _BINARY[type(node.op)](inner(node.left), inner(node.right))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        function = names.get(node.func.id, _FUNCTIONS.get(node.func.id))
        if callable(function):
            return function(*(inner(argument) for argument in node.args))
    raise FormulaError(f"the printed formula '{text}'", f"'{ast.get_source_segment(text, node)}' cannot be read here.")


def _exponent(node: ast.expr, text: str) -> int:
    if isinstance(node, ast.Constant) and type(node.value) is int and 0 <= node.value <= _HIGHEST_POWER:
        return node.value
    raise FormulaError(f"the printed formula '{text}'", f"a power is not a whole number up to {_HIGHEST_POWER}.")
