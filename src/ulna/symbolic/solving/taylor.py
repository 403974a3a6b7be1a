"""Taylor coefficients of composite functions along a curve, by the recurrences of automatic differentiation.

Everything is exact as long as the values at the base point are; rational numbers stay rational where the functions
allow (sin, cos, exp at 0). A. Griewank and A. Walther, Evaluating Derivatives (2008), chapter 13.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import sympy as sp

Series = list[sp.Expr]


class NoSeriesError(Exception):
    """A function without a Taylor series at the point, or one that is not known here."""


def taylor_coefficients(
    expressions: Sequence[sp.Expr], curve: Mapping[sp.Symbol, Sequence[sp.Expr]], order: int
) -> list[Series]:
    """The coefficients c_0 … c_order of each expression along x(s) = Σ x_k s^k.

    Args:
        expressions: functions of the symbols in `curve`; other symbols are constants.
        curve: coefficients x_0, x_1, … of each symbol; missing ones are zero.
        order: highest power of s.

    Raises:
        NoSeriesError: for a function that is not analytic at the point or not known.
    """
    known: dict[sp.Basic, Series] = {s: _padded(c, order) for s, c in curve.items()}
    return [_series(one, known, order) for one in expressions]


def _padded(coefficients: Sequence[sp.Expr], order: int) -> Series:
    return [*coefficients[: order + 1], *[sp.Integer(0)] * (order + 1 - len(coefficients))]


def _series(one: sp.Basic, known: dict[sp.Basic, Series], order: int) -> Series:
    found = known.get(one)
    if found is None:
        found = known[one] = [_reduced(c) for c in _new_series(one, known, order)]
    return found


def _new_series(one: sp.Basic, known: dict[sp.Basic, Series], order: int) -> Series:
    if not one.args or not one.free_symbols & known.keys():
        return _padded([one], order)
    if isinstance(one, sp.Add):
        rows = [_series(a, known, order) for a in one.args]
        return [sp.Add(*column) for column in zip(*rows, strict=True)]
    if isinstance(one, sp.Mul):
        product = _series(one.args[0], known, order)
        for factor in one.args[1:]:
            product = _product(product, _series(factor, known, order))
        return product
    if isinstance(one, sp.exp):
        return _exponential(_series(one.args[0], known, order))
    if isinstance(one, sp.Pow):
        if one.exp.free_symbols & known.keys():
            raise NoSeriesError(f"{one}")
        return _power(_series(one.base, known, order), one.exp)
    if isinstance(one, sp.sin | sp.cos):
        pair = _circular(_series(one.args[0], known, order))
        return pair[0] if isinstance(one, sp.sin) else pair[1]
    if isinstance(one, sp.tan | sp.sinh | sp.cosh | sp.tanh):
        return _series(one.rewrite(sp.cos if isinstance(one, sp.tan) else sp.exp), known, order)
    if isinstance(one, sp.log | sp.atan | sp.asin | sp.acos | sp.asinh | sp.acosh | sp.atanh):
        return _by_derivative(one, known, order)
    raise NoSeriesError(f"{one}")


def _product(first: Series, second: Series) -> Series:
    size = len(first)
    return [
        _reduced(sp.Add(*(first[j] * second[k - j] for j in range(k + 1) if first[j] != 0 and second[k - j] != 0)))
        for k in range(size)
    ]


def _power(base: Series, exponent: sp.Expr) -> Series:
    size = len(base)
    if exponent.is_Integer and exponent >= 0:
        result = _padded([sp.Integer(1)], size - 1)
        for _ in range(int(exponent)):
            result = _product(result, base)
        return result
    if base[0].is_zero is not False and _reduced(base[0]) == 0:
        raise NoSeriesError(f"a power {exponent} of a function that vanishes at the point")
    result = [base[0] ** exponent]
    for k in range(1, size):
        total = sp.Add(*((exponent * j - (k - j)) * base[j] * result[k - j] for j in range(1, k + 1)))
        result.append(_reduced(total / (k * base[0])))
    return result


def _exponential(inner: Series) -> Series:
    result = [sp.exp(inner[0])]
    for k in range(1, len(inner)):
        result.append(_reduced(sp.Add(*(j * inner[j] * result[k - j] for j in range(1, k + 1))) / k))
    return result


def _circular(inner: Series) -> tuple[Series, Series]:
    sine, cosine = [sp.sin(inner[0])], [sp.cos(inner[0])]
    for k in range(1, len(inner)):
        sine.append(_reduced(sp.Add(*(j * inner[j] * cosine[k - j] for j in range(1, k + 1))) / k))
        cosine.append(_reduced(-sp.Add(*(j * inner[j] * sine[k - j] for j in range(1, k + 1))) / k))
    return sine, cosine


def _by_derivative(one: sp.Expr, known: dict[sp.Basic, Series], order: int) -> Series:
    """log and the inverse circular and hyperbolic functions: integrate outer'(inner) · inner'."""
    inner = _series(one.args[0], known, order)
    variable = sp.Dummy("w", real=True)
    outer = one.func(variable).diff(variable)
    slope = _series(outer, {variable: inner}, order)
    rate = [(k + 1) * inner[k + 1] for k in range(order)]
    product = _product([*rate, sp.Integer(0)], slope)
    return [one.func(inner[0]), *[_reduced(product[k] / (k + 1)) for k in range(order)]]


def _reduced(number: sp.Expr) -> sp.Expr:
    """Rational numbers stay as they are; others are expanded so that what cancels does so."""
    return number if number.is_Rational else sp.expand(sp.radsimp(number)) if number.is_number else sp.cancel(number)
