"""The alphabet of a set of expressions: coordinates, function values and irreducible factors, and words over it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations_with_replacement

from sympy import Add, Expr, Mul, Poly, Pow, Rational, Symbol, atan, cos, cot, exp, log, sin, sqrt, tan
from sympy.core.function import AppliedUndef, Function

from ulna.symbolic.exact.quotients import normal

_PARTNER = {sin: cos, cos: sin}


def letters(expressions: Iterable[Expr], coordinates: Sequence[Symbol]) -> tuple[Expr, ...]:
    """Coordinates and function values over which the expressions are rational, simple ones first.

    A sine brings its cosine and the other way round; tan u is written with both; u^(p/q) brings u^(1/q). Functions
    of parameters alone are left out.
    """
    found: dict[Expr, None] = dict.fromkeys(coordinates)
    own = set(coordinates)
    for expression in expressions:
        for node in _nodes(expression):
            if not own & node.free_symbols:
                continue
            for letter in _letters_of(node):
                found.setdefault(letter)
    return tuple(_primitive_exponentials(found))


def _nodes(expression: Expr) -> list[Expr]:
    nodes = [*expression.atoms(Function, AppliedUndef), *expression.atoms(Pow)]
    return sorted(nodes, key=lambda e: (e.count_ops(), str(e)))


def _letters_of(node: Expr) -> tuple[Expr, ...]:
    if isinstance(node, Pow) and not isinstance(node, exp):
        if node.exp.is_Integer:
            return ()
        if node.exp.is_Rational:
            return (Pow(node.base, Rational(1, node.exp.q)),)
        return (node,)
    if node.func in _PARTNER:
        return (node, _PARTNER[node.func](*node.args))
    if node.func in (tan, cot):
        return (sin(*node.args), cos(*node.args))
    return (node,)


def _primitive_exponentials(found: Iterable[Expr]) -> list[Expr]:
    """Of exp(2a), exp(−3a) only exp(a) is kept: the largest argument of which all are integer multiples."""
    kept: list[Expr] = []
    arguments: dict[Expr, list[Expr]] = {}
    for letter in found:
        if isinstance(letter, exp):
            coefficient, monomial = letter.args[0].as_coeff_Mul()
            arguments.setdefault(monomial, []).append(coefficient)
        else:
            kept.append(letter)
    for monomial, coefficients in arguments.items():
        step = coefficients[0]
        for c in coefficients[1:]:
            step = c.gcd(step) if c.is_Rational and step.is_Rational else step
        kept.append(exp(abs(step) * monomial if step.is_Rational else step * monomial))
    return kept


def irreducible_factors(expressions: Iterable[Expr], coordinates: Sequence[Symbol]) -> tuple[Expr, ...]:
    """The distinct irreducible factors, over the letters, of numerators and denominators; constants left out."""
    own = set(coordinates)
    found: dict[Expr, None] = {}
    for expression in expressions:
        for factor in Mul.make_args(normal(expression)):
            base = factor.as_base_exp()[0]
            base = -base if isinstance(base, Add) and base.could_extract_minus_sign() else base
            if own & base.free_symbols and not isinstance(factor, exp):
                found.setdefault(base)
    return tuple(sorted(found, key=lambda e: (e.count_ops(), str(e))))


def wide_letters(expressions: Sequence[Expr], coordinates: Sequence[Symbol]) -> tuple[Expr, ...]:
    """The letters, and what differentiation may have turned into their factors p: log p, 1/p, and atan for 1 + x²."""
    plain = letters(expressions, coordinates)
    slopes = [letter.diff(c) for letter in plain for c in letter.free_symbols & set(coordinates)]
    found: dict[Expr, None] = dict.fromkeys(plain)
    for factor in irreducible_factors((*expressions, *slopes), coordinates):
        for letter in (log(factor), *_arctangents(factor, coordinates), 1 / factor):
            found.setdefault(letter)
    return tuple(found)


def _arctangents(factor: Expr, coordinates: Sequence[Symbol]) -> tuple[Expr, ...]:
    """atan((2ax + b)/√(4ac − b²)) for a factor ax² + bx + c with numbers a, b, c and no real root."""
    own = factor.free_symbols & set(coordinates)
    if len(own) != 1:
        return ()
    x = own.pop()
    if not factor.is_polynomial(x) or Poly(factor, x).degree() != 2:
        return ()
    a, b, c = Poly(factor, x).all_coeffs()
    root = sqrt(4 * a * c - b**2)
    return (atan((2 * a * x + b) / root),) if root.is_Rational else ()


def words(alphabet: Sequence[Expr], degree: int, limit: int) -> list[tuple[int, ...]]:
    """Exponent vectors of the monomials of total degree 1…degree over the alphabet, by degree, at most `limit`.

    Squares of sines are left out: sin² = 1 − cos².
    """
    found: list[tuple[int, ...]] = []
    for d in range(1, degree + 1):
        for chosen in combinations_with_replacement(range(len(alphabet)), d):
            exponents = tuple(chosen.count(i) for i in range(len(alphabet)))
            if any(e > 1 and isinstance(alphabet[i], sin) for i, e in enumerate(exponents)):
                continue
            found.append(exponents)
            if len(found) >= limit:
                return found
    return found


def word(alphabet: Sequence[Expr], exponents: Sequence[int]) -> Expr:
    """The monomial with these exponents."""
    return Mul(*(Pow(letter, e) for letter, e in zip(alphabet, exponents, strict=True) if e))


def logarithm(factor: Expr) -> Expr:
    """log |factor| in the plain form log(factor)."""
    return log(factor)
