"""Integrals of rational functions of sin y and cos y by Bioche's rules: u = cos y, sin y or tan y."""

from __future__ import annotations

from sympy import Dummy, Expr, Mul, Symbol, cancel, cos, cot, csc, sec, sin, tan

from ulna.symbolic.exact.attempts import attempt
from ulna.symbolic.integration.potential import antiderivative, potential_in_span


def antiderivative_by_substitution(integrand: Expr, variable: Symbol, *, seconds: float = 1.0) -> Expr | None:
    """∫ integrand d(variable) where the integrand is rational in sin and cos of the variable; None if it is not.

    Bioche: an integrand odd in sin is one in u = cos, odd in cos one in u = sin, unchanged under a change of both signs
    one in u = tan. Each leaves a rational function of u.
    """
    if not integrand.has(sin, cos, tan, cot, sec, csc):
        return None
    return attempt(seconds, "circular substitution", _substituted, integrand, variable).value


def _substituted(integrand: Expr, variable: Symbol) -> Expr | None:
    S, C, t = Dummy("S"), Dummy("C"), Dummy("t", real=True)
    plain = integrand
    for kind, written in ((tan, S / C), (cot, C / S), (sec, 1 / C), (csc, 1 / S), (sin, S), (cos, C)):
        plain = plain.xreplace({kind(variable): written})
    plain = cancel(plain)
    if plain.has(variable) or not plain.is_rational_function(S, C):
        return None
    if cancel(plain.xreplace({S: -S}) + plain) == 0:
        rational, new = -cancel(plain / S), cos(variable)
        rational = _even(rational, S, 1 - t**2).xreplace({C: t})
    elif cancel(plain.xreplace({C: -C}) + plain) == 0:
        rational, new = cancel(plain / C), sin(variable)
        rational = _even(rational, C, 1 - t**2).xreplace({S: t})
    elif cancel(plain.xreplace({S: -S, C: -C}) - plain) == 0:
        rational, new = _even(cancel(plain.xreplace({S: t * C})), C, 1 / (1 + t**2)) / (1 + t**2), tan(variable)
    else:
        return None
    rational = cancel(rational)
    if rational.has(S, C):
        return None
    found = potential_in_span((rational,), (t,)) or antiderivative(rational, t)
    return None if found is None else found.xreplace({t: new})


def _even(expression: Expr, symbol: Symbol, square: Expr) -> Expr:
    """The expression with the even powers of a symbol written in its square."""
    return expression.replace(
        lambda e: e.is_Pow and e.base == symbol and e.exp.is_Integer and e.exp % 2 == 0,
        lambda e: Mul(square ** (e.exp / 2)),
    )
