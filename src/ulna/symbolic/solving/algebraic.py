"""Solves one equation in closed form where the unknown stands in several places: quadratics and x exp(c x^b) = w.

The branch is the one through a base point; R. M. Corless et al., "On the Lambert W function", Adv. Comput. Math. 5
(1996), for the second.
"""

from __future__ import annotations

import math
from functools import reduce

import sympy as sp

from ulna.symbolic.exact.attempts import attempt
from ulna.symbolic.exact.ball import tape
from ulna.symbolic.exact.simplify import shortened
from ulna.symbolic.solving.isolate import Base, Isolated, number_at, outer_layers, root

_SECONDS = 0.4
_TINY = 1e-12


def algebraic(equation: sp.Expr, unknown: sp.Symbol, base: Base) -> Isolated | None:
    """The solution of equation = 0 on the branch through the base point, if it is of one of these kinds.

    Under functions that can be inverted: A t² + B t + C = 0 with t = x^k, after clearing denominators; or
    a x exp(c x^b) = w.
    """
    outer = outer_layers(equation, unknown, base)
    if outer is None:
        return None
    core = outer.inner - outer.solved.expression
    inner = _quadratic(core, unknown, base) or _lambert(core, unknown, base)
    return inner and Isolated(
        expression=inner.expression,
        nonzero=outer.solved.nonzero + inner.nonzero,
        positive=outer.solved.positive + inner.positive,
    )


def _quadratic(equation: sp.Expr, unknown: sp.Symbol, base: Base) -> Isolated | None:
    found = attempt(_SECONDS, "collect powers", _coefficients, equation, unknown, base).value
    if found is None:
        return None
    power, coefficients = found
    coefficients = {k: shortened(e) for k, e in coefficients.items()}
    A, B, C = (coefficients.get(k, sp.S.Zero) for k in (2, 1, 0))
    if A == 0:
        if B == 0:
            return None
        return _rooted(Isolated(expression=-C / B, nonzero=() if B.is_number else (B,)), unknown, power, base)
    square = unknown**power
    slope = number_at(2 * A * square + B, base)
    if math.isnan(slope) or abs(slope) < _TINY:
        return None
    side = 1 if slope > 0 else -1
    under = shortened(B**2 - 4 * A * C)
    spread = side * sp.sqrt(under)
    if A.is_number or abs(number_at(A, base)) > _TINY:
        t, below = (-B + spread) / (2 * A), A
    else:
        # Where A vanishes at the base point the other form of the root stays finite.
        t, below = -2 * C / (B + spread), B + spread
    solved = Isolated(expression=t, nonzero=() if below.is_number else (below,), positive=(under,))
    return _rooted(solved, unknown, power, base)


def _coefficients(equation: sp.Expr, unknown: sp.Symbol, base: Base) -> tuple[int, dict[int, sp.Expr]] | None:
    """k and the coefficients of 1, x^k, x^2k in the factor of the numerator that vanishes at the base point.

    None if there are other powers or functions of x.
    """
    numerator = sp.numer(sp.together(equation))
    if not numerator.is_polynomial(unknown):
        return None
    factors = [one for one, _ in sp.factor_list(numerator)[1] if one.has(unknown)]
    if not factors:
        return None
    vanishing = min(factors, key=lambda one: abs(number_at(one, base)))
    terms = sp.Poly(vanishing, unknown).as_dict()
    powers = [exponent for (exponent,) in terms if exponent]
    if not powers:
        return None
    power = reduce(math.gcd, powers)
    return None if max(powers) > 2 * power else (power, {k // power: e for (k,), e in terms.items()})


def _rooted(solved: Isolated, unknown: sp.Symbol, power: int, base: Base) -> Isolated | None:
    """X from x^k."""
    if power == 1:
        return solved
    last = root(unknown, sp.Integer(power), solved.expression, base)
    return last and Isolated(
        expression=last.expression, nonzero=solved.nonzero + last.nonzero, positive=solved.positive + last.positive
    )


def _lambert(equation: sp.Expr, unknown: sp.Symbol, base: Base) -> Isolated | None:
    """X = w exp(−W(b c w^b) / b) for x exp(c x^b) = w, on the principal branch of W."""
    rest, inner = equation.as_independent(unknown, as_Add=True)
    factor, product = inner.as_independent(unknown, as_Add=False)
    if not isinstance(product, sp.Mul) or unknown not in product.args or len(product.args) != 2:
        return None
    exponential = next(one for one in product.args if one != unknown)
    if not isinstance(exponential, sp.exp):
        return None
    c, monomial = exponential.args[0].as_independent(unknown, as_Add=False)
    variable, b = monomial.as_base_exp()
    if variable != unknown or not b.is_Integer or b < 1:
        return None
    # Beyond −1 lies the other real branch of W.
    place = tape([b * c * unknown**b + 1])(base)[0]
    if not place > 0:
        return None
    w = -rest / factor
    solution = w * sp.exp(-sp.LambertW(b * c * w**b) / b)
    # W is real and on this branch where its argument exceeds −1/e.
    conditions = (b * c * w**b + sp.exp(-1),)
    return Isolated(expression=solution, nonzero=() if factor.is_number else (factor,), positive=conditions)
