"""Formulas as people read them: numbers as decimals of a few digits, or as exact decimals where they are such."""

from __future__ import annotations

from decimal import Decimal
from math import isfinite, log10

import sympy as sp
from sympy.printing.precedence import PRECEDENCE

from ulna.symbolic.formulas.text import FormulaPrinter

DIGITS = 6


_LONGEST = 15
"""Digits of a decimal that is written in place of its fraction."""


class _ExactPrinter(FormulaPrinter):
    """The formula language with every fraction that is a short decimal as that decimal: 441/250 as 1.764."""

    def _print_Rational(self, expr: sp.Rational) -> str:
        return _exact_decimal(expr) or super()._print_Rational(expr)

    def _print_Mul(self, expr: sp.Expr) -> str:
        coefficient, rest = expr.as_coeff_Mul()
        number = _exact_decimal(abs(coefficient)) if coefficient.is_Rational else ""
        if not number or rest.is_Add:  # (x + y)/250 says more than 0.004*(x + y)
            return super()._print_Mul(expr)
        text = self.parenthesize(rest, PRECEDENCE["Mul"], strict=True)
        factors = f"{number}/{text[2:]}" if text.startswith("1/") else f"{number}*{text}"
        return f"-{factors}" if coefficient.is_negative else factors

    def _print_Pow(self, expr: sp.Pow, rational: bool = False) -> str:
        if expr.exp.is_Rational and not expr.exp.is_Integer and abs(expr.exp) != sp.Rational(1, 2):
            return f"{self.parenthesize(expr.base, PRECEDENCE['Pow'])}**({expr.exp.p}/{expr.exp.q})"
        return super()._print_Pow(expr, rational=rational)


class _DecimalPrinter(FormulaPrinter):
    """The formula language with short decimals."""

    digits = DIGITS

    def _print_Float(self, expr: sp.Float) -> str:
        return f"{float(expr):.{self.digits}g}"


def exact_text(expression: sp.Expr) -> str:
    """The expression as text that is read back exactly, fractions as decimals where they are short ones.

    441*x/250 - y/3 is 1.764*x - y/3: for files that people read.
    """
    return _ExactPrinter().doprint(expression)


def decimal_text(expression: sp.Expr, digits: int = DIGITS) -> str:
    """The expression as text, every number in it a decimal of so many digits: `-0.2*i + 1.764*omega*sin(theta)`.

    Integers of fewer digits stay, and so do exponents. A fraction before a sum is multiplied into it:
    (441*x - 362*y)/250 is 1.764*x - 1.448*y. What is read back is the formula but for the digits left out.

    Args:
        expression: any; complex numbers are written with I.
        digits: significant digits, 1 to 17.
    """
    printer = _DecimalPrinter()
    printer.digits = digits
    return printer.doprint(_in_decimals(sp.sympify(expression), digits))


def _in_decimals(expression: sp.Expr, digits: int) -> sp.Expr:
    if expression.is_Integer and abs(expression) < 10**digits:
        return expression
    if expression.is_number and expression.is_finite is not False and expression.is_real:
        return _number(expression, digits)
    if expression.is_Atom:
        return expression
    if isinstance(expression, sp.Pow):
        exponent = expression.exp
        kept = exponent if exponent.is_Rational else _in_decimals(exponent, digits)
        return sp.Pow(_in_decimals(expression.base, digits), kept)
    if isinstance(expression, sp.Mul):
        return _product(expression, digits)
    if isinstance(expression, sp.Piecewise):
        # Conditions do not move.
        return sp.Piecewise(*((_in_decimals(value, digits), condition) for value, condition in expression.args))
    if isinstance(expression, sp.Add | sp.Function | sp.Max | sp.Min):
        return expression.func(*(_in_decimals(part, digits) for part in expression.args))
    return expression


def _product(expression: sp.Mul, digits: int) -> sp.Expr:
    coefficient, rest = expression.as_coeff_Mul()
    numbers = [part for part in rest.args if part.is_number and part.is_real] if rest.is_Mul else []
    coefficient = sp.Mul(coefficient, *numbers)
    factors = [part for part in sp.Mul.make_args(rest) if part not in numbers]
    if coefficient in (1, -1):
        return sp.Mul(coefficient, *(_in_decimals(part, digits) for part in factors), evaluate=True)
    place = next((k for k, part in enumerate(factors) if _has_numbers(part)), None)
    if place is not None:
        # What stands before a sum is spread over its terms: their numbers are those that are looked for.
        terms = [sp.Mul(coefficient, term) for term in factors[place].args]
        factors[place] = sp.Add(*terms)
        coefficient = sp.Integer(1)
    made = [_in_decimals(part, digits) for part in factors]
    return sp.Mul(_in_decimals(coefficient, digits), *made)


def _has_numbers(part: sp.Expr) -> bool:
    """Whether it is a sum with numbers before its terms."""
    return bool(part.is_Add) and any(abs(term.as_coeff_Mul()[0]) != 1 for term in part.args)


def _exact_decimal(value: sp.Expr) -> str:
    """The fraction as a decimal of a few digits, or nothing where it is none, or an integer."""
    if not isinstance(value, sp.Rational) or value.is_Integer or max(abs(value.p), value.q) > 10**_LONGEST:
        return ""
    places = next((places for places in range(1, _LONGEST + 1) if 10**places % value.q == 0), 0)
    return format(Decimal(int(value * 10**places)).scaleb(-places), "f") if places else ""


def _number(value: sp.Expr, digits: int) -> sp.Expr:
    number = value.evalf(30)
    if not number.is_Float or not isfinite(float(number)):
        return value
    rounded = sp.Float(f"{float(number):.{digits}g}", digits)
    whole = sp.Integer(int(rounded)) if rounded and log10(abs(float(rounded))) < digits else None
    return whole if whole is not None and whole == rounded else rounded
