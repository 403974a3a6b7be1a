"""Integrating factors of a one-form w: μ with d(μ w) = 0, sought in spaces of functions.

With a component w_p ≠ 0 and the fields Z_j = w_p ∂_j − w_j ∂_p, which span the kernel of w, and the numbers
k_j = ∂_p w_j − ∂_j w_p, the condition reads Z_j ln μ = k_j: linear in ln μ. So exponents of candidate factors are found
by linear algebra instead of trial. The reciprocal M = 1/μ obeys Z_j M + k_j M = 0, linear as well; symmetries of the
form give such M = w(S) (Lie). The quotient of two different M is constant along the kernel.
"""

from __future__ import annotations

from collections.abc import Sequence

from sympy import Add, Expr, Integer, Symbol, exp, gcd_terms, log

from ulna.symbolic.exact.letters import irreducible_factors, letters, words
from ulna.symbolic.integration.ansatz import LinearEquations, Span, solutions

_LARGEST_SPAN = 350


def pivot_of(components: Sequence[Expr]) -> int:
    """The index of the simplest nonzero component; a nonzero constant is the best."""
    return min(
        (i for i, w in enumerate(components) if w != 0),
        key=lambda i: (bool(components[i].free_symbols), components[i].count_ops(), i),
    )


def kernel_equations(
    components: Sequence[Expr],
    coordinates: Sequence[Symbol],
    spectators: Sequence[Symbol] = (),
    *,
    reciprocal: bool = False,
    factor: bool = False,
) -> LinearEquations:
    """Equations for a function constant along the kernel, or for ln μ (`factor`), or for 1/μ (`reciprocal`).

    Spectators are held fixed: the functions may contain them, but are not differentiated by them.
    """
    p, n = pivot_of(components), len(components)
    fields, slopes = [], []
    for j in range(n):
        if j == p:
            continue
        row = [Integer(0)] * n
        row[j], row[p] = components[p], -components[j]
        fields.append((*row, *(Integer(0) for _ in spectators)))
        if reciprocal or factor:
            slopes.append(components[j].diff(coordinates[p]) - components[p].diff(coordinates[j]))
    return LinearEquations(
        coordinates=(*coordinates, *spectators),
        fields=tuple(fields),
        zeroth=tuple(slopes) if reciprocal else (),
        right=tuple(slopes) if factor else (),
    )


def factor_from_products(
    components: Sequence[Expr],
    coordinates: Sequence[Symbol],
    hints: Sequence[Expr] = (),
    *,
    spectators: Sequence[Symbol] = (),
    degree: int = 2,
    limit: int = _LARGEST_SPAN,
) -> Expr | None:
    """A candidate μ = Π pₖ^cₖ · exp(polynomial in the letters).

    The pₖ are the irreducible factors of the components and of the hints; all exponents are found at once, and may
    depend on parameters.
    """
    x = (*coordinates, *spectators)
    alphabet = letters((*components, *hints), x)
    own = set(x)
    extra = [letter for letter in alphabet if letter not in own and not isinstance(letter, exp)]
    # A function brings the factors of its derivative: 1 + u² for atan u, u for log u.
    slopes = [letter.diff(c) for letter in extra for c in letter.free_symbols & own]
    factors = dict.fromkeys((*irreducible_factors((*components, *hints, *slopes), x), *x, *extra))
    equations = kernel_equations(components, coordinates, spectators, factor=True)
    for d in range(1, degree + 1):
        monomials = tuple(words(alphabet, d, limit + 1))
        if len(monomials) > limit:
            return None
        found = solutions(equations, Span(alphabet=alphabet, monomials=monomials, logarithms=tuple(factors)))
        if found:
            return exponential(found[0])
    return None


def reciprocal_factors(
    components: Sequence[Expr],
    coordinates: Sequence[Symbol],
    *,
    spectators: Sequence[Symbol] = (),
    degrees: Sequence[int] = (1, 2, 3, 4, 6, 8),
    limit: int = _LARGEST_SPAN,
) -> list[Expr]:
    """Candidates M with d(w / M) = 0 among polynomials in the letters, of the lowest degree that has any."""
    alphabet = letters(components, (*coordinates, *spectators))
    equations = kernel_equations(components, coordinates, spectators, reciprocal=True)
    constant = (0,) * len(alphabet)
    for d in degrees:
        monomials = (constant, *words(alphabet, d, limit + 1))
        if len(monomials) > limit:
            return []
        found = solutions(equations, Span(alphabet=alphabet, monomials=monomials))
        if found:
            return found
    return []


def exponential(exponent: Expr) -> Expr:
    """exp(Σ c log p + rest) as Π p^c · exp(rest)."""
    product, rest = Integer(1), []
    for term in Add.make_args(exponent):
        logs = [f for f in term.args if isinstance(f, log)] if term.is_Mul else [term] * isinstance(term, log)
        if len(logs) == 1:
            product *= logs[0].args[0] ** (term / logs[0])
        else:
            rest.append(term)
    return product * exp(gcd_terms(Add(*rest))) if rest else product
