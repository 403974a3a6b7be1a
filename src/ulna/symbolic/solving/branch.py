"""Formulas on one branch: what |p|, sqrt(p²) or asin(sin(p)) is near a given point, written without them."""

from __future__ import annotations

import math
from collections.abc import Callable

import sympy as sp

from ulna.symbolic.solving.isolate import Base, number_at

Rule = Callable[[sp.Expr, Base], sp.Expr | None]
"""(argument, base) -> the function of the argument without the function; None to leave it."""

_EDGE = 1e-9
"""Distance from the end of a branch, relative to its width, within which a point counts as lying on it."""


def on_branch(expression: sp.Expr, base: Base) -> sp.Expr:
    """The expression as it is near the base point, with moduli, signs and inverses of functions taken off.

    |p| and sign(p) become ±p and ±1, (p^a)^b one power, asin(sin(p)) and its like p or its reflection. What lies at
    the end of a branch there stays as it is.

    Args:
        expression: any expression.
        base: a value for every symbol in it.
    """
    if expression.is_Atom or not expression.has(*_RULES, sp.Pow):
        return expression
    inner = [on_branch(part, base) for part in expression.args]
    node = expression if tuple(inner) == expression.args else expression.func(*inner)
    if node.is_Pow:
        return _power(node, base)
    rule = _RULES.get(node.func)
    return node if rule is None else rule(node.args[0], base) or node


def defined_near(expression: sp.Expr, base: Base) -> sp.Expr:
    """The expression up to a constant, atan(p/q) with q = 0 at the base point as −atan(q/p), which is smooth there.

    Args:
        expression: a function that matters up to a constant, the sum of such functions.
        base: a value for every symbol in it.
    """

    def turned(quotient: sp.Expr) -> sp.Expr:
        above, below = sp.fraction(sp.together(quotient))
        pole = below.has(sp.Symbol) and abs(number_at(below, base)) < _EDGE < abs(number_at(above, base))
        return -sp.atan(below / above) if pole else sp.atan(quotient)

    return expression.replace(sp.atan, turned)


def real_odd_roots(expression: sp.Expr) -> sp.Expr:
    """The expression with sign(w) |w|^(k/n) for w^(k/n), n odd: powers of negative numbers are complex otherwise."""

    def odd(node: sp.Expr) -> bool:
        power = node.exp if node.is_Pow else sp.Integer(0)
        return bool(power.is_Rational and not power.is_Integer and power.q % 2 and not node.base.is_number)

    return expression.replace(odd, lambda e: sp.sign(e.base) ** (e.exp.p % 2) * sp.Abs(e.base) ** e.exp)


def _power(node: sp.Expr, base: Base) -> sp.Expr:
    """(p^a)^b and (p^a q)^b, b not whole, with p^(a b) taken out as its sign at the base point allows."""
    body, outer = node.as_base_exp()
    if body is sp.E or outer.is_Integer or not outer.is_Rational:
        return node
    taken, left = sp.S.One, sp.S.One
    for factor in sp.Mul.make_args(body):
        root, power = factor.as_base_exp()
        side = _side(root, base) if factor.is_Pow and root is not sp.E and power.is_Rational else 0
        if side > 0 or (side < 0 and power.is_Integer and power % 2 == 0):
            taken *= (side * root) ** (power * outer)
        else:
            left *= factor
    return node if taken == 1 else taken * left**outer


def _side(p: sp.Expr, base: Base) -> int:
    value = number_at(p, base)
    return 0 if math.isnan(value) or abs(value) < _EDGE else 1 if value > 0 else -1


def _modulus(p: sp.Expr, base: Base) -> sp.Expr | None:
    side = _side(p, base)
    return side * p if side else None


def _sign(p: sp.Expr, base: Base) -> sp.Expr | None:
    side = _side(p, base)
    return sp.Integer(side) if side else None


def _unwound(
    function: type, other: type, offset: float, *, mirrored: bool
) -> Callable[[sp.Expr, Base], sp.Expr | None]:
    """The rule for the inverse of a function whose branches begin at (k − offset) π; `other` is its cofunction."""

    def rule(p: sp.Expr, base: Base) -> sp.Expr | None:
        if not isinstance(p, function | other):
            return None
        angle = p.args[0] if isinstance(p, function) else sp.pi / 2 - p.args[0]
        turns = number_at(angle, base) / math.pi + offset
        if math.isnan(turns) or abs(turns - round(turns)) < _EDGE:
            return None
        k = math.floor(turns)
        if not mirrored or k % 2 == 0:
            return angle - k * sp.pi
        return (k + 1 if function is sp.cos else k) * sp.pi - angle

    return rule


_RULES: dict[type, Rule] = {
    sp.Abs: _modulus,
    sp.sign: _sign,
    sp.asin: _unwound(sp.sin, sp.cos, 0.5, mirrored=True),
    sp.acos: _unwound(sp.cos, sp.sin, 0.0, mirrored=True),
    sp.atan: _unwound(sp.tan, sp.cot, 0.5, mirrored=False),
}
