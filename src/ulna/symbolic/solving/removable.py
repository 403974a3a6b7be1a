"""Removable singularities: sin(x)/x, (1 - cos(x))/x**2 and V/(exp(V) - 1) have a value where they read 0/0."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

import sympy as sp

from ulna.symbolic.formulas import put_in
from ulna.symbolic.solving.taylor import NoSeriesError, taylor_coefficients

_NOTHING = (sp.nan, sp.zoo, sp.oo, -sp.oo)
_ORDER = 6
"""Of the zero of a denominator, at most."""
_TERMS = 24
"""Powers of the distance that stand for a quotient near its hole."""
_ROUNDING = 1e-17
_LONG = 400
"""Operations beyond which a quotient is left as it is."""
_DIRECTIONS = ((1, 1), (-2, 3))


def limit_at(expression: sp.Expr, values: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
    """The expression with the values in it; where that is 0/0, the limit, if it is the same from several directions.

    A quotient of polynomials alone has none: whoever divides by x there means the pole, and a run has no value either.
    """
    value = put_in(expression, values)
    if not value.has(*_NOTHING):
        return value
    moving = sorted((s for s in expression.free_symbols if s in values), key=str)
    if not _has_function_in(_without_value(expression, values), moving):
        return value
    lines = [{s: [values[s], sp.Rational(*d) + k] for k, s in enumerate(moving)} for d in _DIRECTIONS]
    first, second = (_limit(expression, line) for line in lines)
    if first is None or second is None or sp.simplify(first - second) != 0:
        return value
    return first


def _without_value(expression: sp.Expr, values: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
    """The sum of the terms that have no value there."""
    return sp.Add(*(t for t in sp.Add.make_args(expression) if put_in(t, values).has(*_NOTHING)))


def _has_function_in(expression: sp.Expr, symbols: Collection[sp.Symbol]) -> bool:
    return any(f.has(*symbols) for f in expression.atoms(sp.Function)) if symbols else False


def _limit(expression: sp.Expr, curve: Mapping[sp.Symbol, list[sp.Expr]]) -> sp.Expr | None:
    """The limit along a line, None where there is none."""
    numerator, denominator = sp.fraction(sp.together(expression))
    try:
        above, below = taylor_coefficients([numerator, denominator], curve, _ORDER)
    except (NoSeriesError, ZeroDivisionError):
        return None
    order = next((k for k, c in enumerate(below) if sp.simplify(c) != 0), None)
    if order is None or any(sp.simplify(c) != 0 for c in above[:order]):
        return None
    limit = above[order] / below[order]
    return None if limit.has(*_NOTHING) else limit


def without_holes(expression: sp.Expr, moving: Collection[sp.Symbol], numbers: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
    """The expression with a power series in place of quotients that read 0/0, near where they do.

    Args:
        expression: what is computed at many points.
        moving: the symbols that change. numbers: of others, where they have some: how far a series holds.
    """
    for symbol, place in sorted(set(_holes(expression, moving)), key=str):
        expression = _filled(expression, symbol, place, numbers)
    return expression


def _holes(expression: sp.Expr, moving: Collection[sp.Symbol]) -> Iterator[tuple[sp.Symbol, sp.Expr]]:
    """Where a denominator in one moving symbol vanishes: a power of x + a, or exp(a x + b) - 1 and the like."""
    for power in expression.atoms(sp.Pow):
        base = power.base
        inside = base.free_symbols & set(moving)
        if not (power.exp.is_Integer and power.exp.is_negative and len(inside) == 1):
            continue
        (symbol,) = inside
        distance = base
        exponentials = base.atoms(sp.exp)
        if len(exponentials) == 1:
            (grown,) = exponentials
            mark = sp.Dummy()
            marked = sp.expand(base.xreplace({grown: mark}))
            if marked.coeff(mark, 0) != -marked.coeff(mark, 1) or marked.has(symbol):
                continue
            distance = grown.args[0]
        slope = distance.diff(symbol)
        if slope != 0 and not slope.has(symbol):
            yield symbol, sp.simplify(symbol - distance / slope)


def _filled(expression: sp.Expr, symbol: sp.Symbol, place: sp.Expr, numbers: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
    whole = _without_value(expression, {symbol: place})
    if not _has_function_in(whole, [symbol]) or whole.count_ops() > _LONG or whole.has(sp.Piecewise):
        return expression
    coefficients = _coefficients(whole, symbol, place)
    if coefficients is None:
        return expression
    away = symbol - place
    reach = _reach([c.xreplace(dict(numbers)) for c in coefficients])
    series = _nested(coefficients, away)
    near = sp.Piecewise((series, away**2 < sp.Float(reach) ** 2), (whole, True))
    return sp.Add(expression, -whole, near)


def _coefficients(whole: sp.Expr, symbol: sp.Symbol, place: sp.Expr) -> list[sp.Expr] | None:
    """Of the powers of the distance, where the negative ones vanish."""
    numerator, denominator = sp.fraction(sp.together(whole))
    if sp.expand(put_in(numerator, {symbol: place})) != 0:
        return None
    try:
        above, below = taylor_coefficients([numerator, denominator], {symbol: [place, sp.Integer(1)]}, _TERMS + _ORDER)
    except (NoSeriesError, ZeroDivisionError):
        return None
    order = next((k for k, c in enumerate(below) if sp.expand(c) != 0), None)
    if order is None or order > _ORDER or any(sp.expand(c) != 0 for c in above[:order]):
        return None
    above, below, found = above[order:], below[order:], []
    for k in range(_TERMS):
        known = sp.Add(*(found[j] * below[k - j] for j in range(k)))
        found.append(sp.expand((above[k] - known) / below[0]))
    return found


def _nested(coefficients: list[sp.Expr], away: sp.Expr) -> sp.Expr:
    total = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        total = coefficient + away * total
    return total


def _reach(coefficients: list[sp.Expr]) -> float:
    """How far the series is exact to rounding, in numbers of any size for what has none."""
    put = {s: sp.Integer(1) for c in coefficients for s in c.free_symbols}
    sizes = [abs(float(sp.N(c.xreplace(put)))) for c in coefficients]
    most = max(sizes)
    reaches = [(_ROUNDING * most / size) ** (1.0 / k) for k, size in enumerate(sizes) if k > _TERMS // 2 and size > 0.0]
    return float(f"{min(reaches, default=1.0):.3g}")
