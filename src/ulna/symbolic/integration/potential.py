"""Potentials of closed one-forms: T with ∂T/∂xᵢ = wᵢ."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from sympy import (
    Add,
    Dummy,
    Expr,
    Integer,
    Integral,
    Ne,
    Piecewise,
    Poly,
    Rational,
    S,
    Symbol,
    exp_polar,
    fraction,
    hyper,
    integrate,
    meijerg,
    together,
)
from sympy.integrals.manualintegrate import manualintegrate

from ulna.symbolic.exact.attempts import attempt
from ulna.symbolic.exact.letters import irreducible_factors, letters, words
from ulna.symbolic.formulas.parse import is_elementary
from ulna.symbolic.integration.ansatz import LinearEquations, Span, solutions

_LARGEST_SPAN = 350
_REGULAR_VALUES = (0, 1, Rational(1, 2), 2, Rational(1, 3), 3, -1)


def potential_in_span(
    components: Sequence[Expr],
    coordinates: Sequence[Symbol],
    *,
    spectators: Sequence[Symbol] = (),
    degrees: Sequence[int] = (1, 2, 3, 4, 6, 8),
    limit: int = _LARGEST_SPAN,
) -> Expr | None:
    """A candidate T among polynomials in the letters of the form, powers and logarithms of its denominators.

    The integration of Risch and Norman with the linear algebra done modulo a prime: milliseconds, and a sum that
    reads well where it succeeds.
    """
    x = (*coordinates, *spectators)
    equations = gradient_equations(components, coordinates, spectators)
    factors = irreducible_factors((1 / fraction(together(w))[1] for w in components), x)
    alphabet = (*letters(components, x), *(1 / f for f in factors))
    for d in degrees:
        monomials = tuple(words(alphabet, d, limit + 1))
        if len(monomials) > limit:
            return None
        found = solutions(equations, Span(alphabet=alphabet, monomials=monomials, logarithms=factors))
        if found:
            return found[0]
    return None


def potentials(
    components: Sequence[Expr], coordinates: Sequence[Symbol], near: Mapping[Symbol, Expr]
) -> Iterator[Expr | None]:
    """Candidates for the potential: in a space of functions, then by quadrature."""
    yield potential_in_span(components, coordinates)
    yield potential_by_quadrature(components, coordinates, near=near)


def gradient_equations(
    components: Sequence[Expr],
    coordinates: Sequence[Symbol],
    spectators: Sequence[Symbol] = (),
    zeroth: Sequence[Expr] = (),
) -> LinearEquations:
    """∂F/∂xᵢ + θᵢ F = wᵢ; spectators may occur in F but are not differentiated by."""
    n, width = len(coordinates), len(coordinates) + len(spectators)
    unit = tuple(tuple(Integer(int(i == j)) for j in range(width)) for i in range(n))
    return LinearEquations(
        coordinates=(*coordinates, *spectators), fields=unit, zeroth=tuple(zeroth), right=tuple(components)
    )


def potential_by_quadrature(
    components: Sequence[Expr],
    coordinates: Sequence[Symbol],
    *,
    near: Mapping[Symbol, Expr] | None = None,
    seconds: float = 1.5,
) -> Expr | None:
    """A candidate T by one integration per coordinate, the easiest component first.

    What remains after ∫ wᵢ dxᵢ is taken off does not depend on xᵢ, so xᵢ is replaced by a number there instead of being
    simplified away.
    """
    rest = {x: w for x, w in zip(coordinates, components, strict=True) if w != 0}
    total: Expr = Integer(0)
    while rest:
        for x in sorted(rest, key=lambda x: (not rest[x].is_polynomial(x), rest[x].count_ops())):
            part = antiderivative(rest[x], x, seconds=seconds)
            if part is not None:
                break
        else:
            return None
        total += part
        remaining = {y: w - part.diff(y) for y, w in rest.items() if y != x}
        fixed = {y: _without(w, x, near or {}) for y, w in remaining.items()}
        if any(w is None for w in fixed.values()):
            return None
        rest = {y: w for y, w in fixed.items() if w is not None and w != 0}
    return total


def antiderivative(integrand: Expr, variable: Symbol, *, seconds: float = 1.0) -> Expr | None:
    """∫ integrand d(variable) in closed form for generic parameters, None if none is found in time.

    All symbols count as positive meanwhile: no case distinctions, roots merge; the formula is checked by its user.
    """
    positive = {s: Dummy(s.name, positive=True) for s in integrand.free_symbols | {variable}}
    back = {dummy: symbol for symbol, dummy in positive.items()}
    if integrand.is_polynomial(variable):
        terms = Poly(integrand, variable).terms()
        return Add(*(c * variable ** (k + 1) / (k + 1) for (k,), c in terms))
    integrand, variable = integrand.xreplace(positive), positive[variable]
    ways = (
        ("integrate", integrate),
        ("integrate after expansion", _integrate_expanded),
        ("integrate by rules", manualintegrate),
    )
    for what, function in ways:
        found = attempt(seconds, what, function, integrand, variable)
        value = generic_branch(found.value) if found.value is not None else None
        if value is not None and not value.has(Integral, hyper, meijerg, exp_polar, S.NaN, S.ComplexInfinity):
            return value.xreplace(back)
    return None


def antiderivative_by_rules(expanded: Expr, variable: Symbol, *, seconds: float = 0.2) -> Expr | None:
    """∫ of a sum term by term, each without the factors that do not hold the variable: those make integration slow.

    None if one term needs more than `seconds`, case distinctions or functions outside the formula language.
    """
    total: Expr = Integer(0)
    for term in Add.make_args(expanded):
        factor, rest = term.as_independent(variable, as_Add=False)
        part = attempt(seconds, "integrate by rules", manualintegrate, rest, variable).value
        if part is None or part.has(Integral, Piecewise) or not is_elementary(part):
            return None
        total += factor * part
    return total


def generic_branch(expression: Expr) -> Expr:
    """The branch of every Piecewise that holds for generic parameters (p ≠ 0 rather than p = 0)."""
    while expression.has(Piecewise):
        piece = next(iter(expression.atoms(Piecewise)))
        value = next((v for v, condition in piece.args if isinstance(condition, Ne)), piece.args[-1][0])
        expression = expression.xreplace({piece: value})
    return expression


def _integrate_expanded(integrand: Expr, variable: Symbol) -> Expr:
    return integrate(integrand.expand(), variable)


def _without(expression: Expr, variable: Symbol, near: Mapping[Symbol, Expr]) -> Expr | None:
    """The expression, known to be constant along the variable, with a regular value put in."""
    if variable not in expression.free_symbols:
        return expression
    for value in (near.get(variable, Integer(0)), *_REGULAR_VALUES):
        found = expression.subs(variable, value)
        if not found.has(S.NaN, S.ComplexInfinity, S.Infinity, S.NegativeInfinity):
            return found
    return None
