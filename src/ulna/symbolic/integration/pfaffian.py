"""Pfaffian equations w = 0: functions T constant along the kernel of an integrable one-form w.

Everything here returns candidates; the caller differentiates them back.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from sympy import Dummy, Eq, Expr, Function, Integer, S, Symbol, fraction, solve, together
from sympy import exp as exponential_of
from sympy.solvers.ode import classify_ode, dsolve

from ulna.symbolic.exact.attempts import attempt
from ulna.symbolic.exact.letters import irreducible_factors, letters, words
from ulna.symbolic.exact.quotients import normal
from ulna.symbolic.exact.relations import constant_relations
from ulna.symbolic.exact.zero import vanishes
from ulna.symbolic.integration.ansatz import Span, solutions
from ulna.symbolic.integration.integrating_factor import kernel_equations, pivot_of
from ulna.symbolic.integration.potential import gradient_equations, potential_by_quadrature, potential_in_span

_LARGEST_SPAN = 350
_HINTS = (
    "separable",
    "1st_linear",
    "Bernoulli",
    "1st_exact",
    "1st_homogeneous_coeff_best",
    "almost_linear",
    "separable_reduced",
    "linear_coefficients",
    "1st_rational_riccati",
    "lie_group",
)


def constant_in_span(
    components: Sequence[Expr],
    coordinates: Sequence[Symbol],
    *,
    spectators: Sequence[Symbol] = (),
    degrees: Sequence[int] = (1, 2),
    limit: int = _LARGEST_SPAN,
) -> Expr | None:
    """A polynomial in the letters that is constant along the kernel, of the lowest degree."""
    x = tuple(coordinates)
    alphabet = letters(components, (*x, *spectators))
    equations = kernel_equations(components, x, spectators)
    for d in degrees:
        monomials = tuple(words(alphabet, d, limit + 1))
        if len(monomials) > limit:
            return None
        for found in solutions(equations, Span(alphabet=alphabet, monomials=monomials)):
            if any(not vanishes(found.diff(c)) for c in x):
                return found
    return None


def potential_of_product(
    factor: Expr,
    components: Sequence[Expr],
    coordinates: Sequence[Symbol],
    *,
    spectators: Sequence[Symbol] = (),
    near: Mapping[Symbol, Expr] | None = None,
    seconds: float = 1.5,
) -> Expr | None:
    """T with dT = μ w for a closed product: first T = μ G with G polynomial in the letters, then by integration."""
    x, w = tuple(coordinates), tuple(components)
    slopes = tuple(normal(factor.diff(c) / factor) for c in x)
    equations = gradient_equations(w, x, spectators, zeroth=slopes)
    everything = (*x, *spectators)
    denominators = irreducible_factors((1 / fraction(together(v))[1] for v in w), everything)
    alphabet = (*letters((*w, *slopes), everything), *(1 / f for f in denominators))
    for degree in (1, 2, 3, 4):
        monomials = ((0,) * len(alphabet), *words(alphabet, degree, _LARGEST_SPAN))
        if len(monomials) >= _LARGEST_SPAN:
            break
        found = solutions(equations, Span(alphabet=alphabet, monomials=monomials))
        if found:
            return factor * found[0]
    product = [normal(factor * v) for v in w]
    found = potential_in_span(product, x, spectators=spectators)
    return found if found is not None else potential_by_quadrature(product, x, near=near, seconds=seconds)


def affine_in_one_coordinate(
    components: Sequence[Expr],
    coordinates: Sequence[Symbol],
    *,
    near: Mapping[Symbol, Expr] | None = None,
    seconds: float = 1.5,
) -> Iterator[Expr]:
    """Candidates T = φ(x_p) e^P + Q with P, Q free of x_p, for every coordinate x_p that allows it.

    Divided by w_p the form is dx_p + Σ b_j dx_j. If the b_j as functions of x_p span {s}, the variables separate.
    If they span {s, t} with the Wronskian s' t − s t' proportional to s, then y = t/s turns the form into
    dy + Σ (a_j + c_j y) dx_j with a_j, c_j free of x_p: linear, with factor e^P, dP = Σ c_j dx_j closed.
    In the plane these are the separable, linear and Bernoulli equations; the same works in any dimension.
    """
    for p, w in enumerate(components):
        if w == 0:
            continue
        split = _separated([normal(v / w) for i, v in enumerate(components) if i != p], coordinates[p])
        if split is None:
            continue
        others = [x for i, x in enumerate(coordinates) if i != p]
        found = _affine(split, coordinates[p], others, near or {}, seconds)
        if found is not None:
            yield found


Separated = list[dict[Expr, Expr]]
"""For every b_j: {function of x_p: coefficient free of x_p}."""


def _separated(slopes: Sequence[Expr], variable: Symbol) -> Separated | None:
    result: Separated = []
    for slope in slopes:
        numerator, denominator = fraction(together(slope))
        outer, inner = denominator.factor().as_independent(variable, as_Add=False)
        if (inner.free_symbols - {variable}) and inner != 1:
            return None
        parts: dict[Expr, Expr] = {}
        for term in numerator.expand(trig=True).as_ordered_terms():
            rest, own = term.as_independent(variable, as_Add=False)
            key = (own / inner).powsimp()
            if key.free_symbols - {variable}:
                return None
            parts[key] = parts.get(key, Integer(0)) + rest / outer
        result.append({k: v for k, v in parts.items() if not vanishes(v)})
    return result


def _affine(
    split: Separated, variable: Symbol, others: Sequence[Symbol], near: Mapping[Symbol, Expr], seconds: float
) -> Expr | None:
    basis = list(dict.fromkeys(key for parts in split for key in parts))
    if len(basis) == 1:
        s = basis[0]
        first = potential_by_quadrature([1 / s], [variable], near=near, seconds=seconds)
        rest = [parts.get(s, Integer(0)) for parts in split]
        second = _potential(rest, others, near, seconds)
        return None if first is None or second is None else first + second
    if len(basis) != 2:
        return None
    found = _linearising(basis[0], basis[1], variable)
    if found is None:
        return None
    first, second, matrix = found  # basis[i] = matrix[i][0] s + matrix[i][1] t
    a, c = [], []
    for parts in split:
        values = [parts.get(key, Integer(0)) for key in basis]
        a.append(values[0] * matrix[0][0] + values[1] * matrix[1][0])
        c.append(values[0] * matrix[0][1] + values[1] * matrix[1][1])
    y = normal(second / first)
    scale = normal(y.diff(variable) * first)  # y' = scale / s with a constant scale
    exponent = _potential([scale * v for v in c], others, near, seconds)
    if exponent is None:
        return None
    factor = exponential_of(exponent)
    rest = _potential([scale * factor * v for v in a], others, near, seconds)
    return None if rest is None else y * factor + rest


def _linearising(
    first: Expr, second: Expr, variable: Symbol
) -> tuple[Expr, Expr, tuple[tuple[Expr, Expr], tuple[Expr, Expr]]] | None:
    """s and t of the span with s' t − s t' = const·s, and the old basis over them."""
    wronskian = normal(first.diff(variable) * second - first * second.diff(variable))
    parameters = sorted((first.free_symbols | second.free_symbols) - {variable}, key=str)
    functions = [first, second, wronskian]
    relations = constant_relations(lambda sample: sample.table(functions)[:, None, :], 3, 1, parameters)
    relation = next((r for r in relations if 2 in r), None)
    if relation is None:
        return None
    alpha = -relation.get(0, Integer(0)) / relation[2]
    beta = -relation.get(1, Integer(0)) / relation[2]
    one, none = Integer(1), Integer(0)
    if beta != 0:  # s = α f₁ + β f₂, t = f₁
        return alpha * first + beta * second, first, ((none, one), (one / beta, -alpha / beta))
    return alpha * first, second, ((one / alpha, none), (none, one))


def _potential(
    components: Sequence[Expr], coordinates: Sequence[Symbol], near: Mapping[Symbol, Expr], seconds: float
) -> Expr | None:
    components = [Integer(0) if vanishes(v) else normal(v) for v in components]
    if all(v == 0 for v in components):
        return Integer(0)
    found = potential_in_span(components, coordinates, degrees=(1, 2, 3))
    if found is not None:
        return found
    return potential_by_quadrature(components, coordinates, near=near, seconds=seconds)


def solve_in_the_plane(
    components: Sequence[Expr], coordinates: Sequence[Symbol], *, seconds: float = 1.0
) -> Iterator[Expr]:
    """Candidates T(x, y) from w₁ dx + w₂ dy = 0 read as dy/dx = −w₁/w₂ and as dx/dy = −w₂/w₁, by `sympy.dsolve`.

    Args:
        components: w₁, w₂.
        coordinates: x, y.
        seconds: s, for each equation and each kind of equation.
    """
    for i, j in ((0, 1), (1, 0)):
        if components[j] == 0:
            continue
        variable, unknown = Symbol(f"t_{i}", real=True), Function("y")
        slope = -(components[i] / components[j])
        slope = normal(slope).subs(coordinates[i], variable).subs(coordinates[j], unknown(variable))
        equation = Eq(unknown(variable).diff(variable), slope)
        kinds = attempt(seconds, "classify", classify_ode, equation, unknown(variable)).value or ()
        for hint in _HINTS:
            if hint not in kinds:
                continue
            found = attempt(seconds, hint, dsolve, equation, unknown(variable), hint=hint)
            if found.value is None:
                continue
            answers = found.value if isinstance(found.value, list) else [found.value]
            for answer in answers[:1]:
                back = {variable: coordinates[i], unknown(variable): coordinates[j]}
                yield from _constant_of(answer, back, seconds)


def _constant_of(answer: Eq, back: Mapping[Expr, Expr], seconds: float) -> Iterator[Expr]:
    relation = (answer.lhs - answer.rhs).doit()
    constant = next((s for s in relation.free_symbols if s.name == "C1"), None)
    if constant is None:
        return
    relation = relation.subs(dict(sorted(back.items(), key=lambda item: -item[0].count_ops())))
    if relation.has(Function("y")):
        return
    found = attempt(seconds, "solve for the constant", solve, relation, constant)
    yield from (found.value or [])[:1]


def reduced_by_mayer(
    components: Sequence[Expr],
    coordinates: Sequence[Symbol],
    *,
    near: Mapping[Symbol, Expr] | None = None,
    seconds: float = 1.0,
) -> Iterator[Expr]:
    """Candidates T by the method of Mayer and Natani.

    The equation is solved in two variables, the others held fixed; then the constant of integration varies with
    them, which leaves a form with one variable less.
    """
    x, w = list(coordinates), list(components)
    nonzero = [i for i, v in enumerate(w) if v != 0]
    if len(nonzero) == 1:
        yield x[nonzero[0]]
        return
    if len(nonzero) == 2:
        pair = [w[i] for i in nonzero], [x[i] for i in nonzero]
        yield from affine_in_one_coordinate(*pair, near=near, seconds=seconds)
        yield from solve_in_the_plane(*pair, seconds=seconds)
        return
    p = pivot_of(w)
    for q in sorted((i for i in nonzero if i != p), key=lambda i: w[i].count_ops())[:2]:
        pair = [w[p], w[q]], [x[p], x[q]]
        for inner in reduced_by_mayer(*pair, near=near, seconds=seconds):
            smaller = _varied(inner, p, q, w, x, near or {}, seconds)
            if smaller is None:
                continue
            constant, form, names = smaller
            for outer in reduced_by_mayer(form, names, near=near, seconds=seconds):
                yield outer.subs(constant, inner)


def _varied(
    inner: Expr, p: int, q: int, w: list[Expr], x: list[Symbol], near: Mapping[Symbol, Expr], seconds: float
) -> tuple[Symbol, list[Expr], list[Symbol]] | None:
    """The form in (V, the other coordinates) after λ w = dV + Σ Kₖ dxₖ, V the inner solution, Kₖ free of x_p, x_q."""
    scale = inner.diff(x[p]) / w[p]
    constant = Dummy("V", real=True)
    value = near.get(x[q], Integer(0))
    rest = {k: normal(scale * w[k] - inner.diff(x[k])) for k in range(len(x)) if k not in (p, q) and w[k] != 0}
    for fixed in (value, Integer(1), Integer(2)):
        solved = attempt(seconds, "eliminate", solve, inner.subs(x[q], fixed) - constant, x[p])
        branches = [b for b in solved.value or [] if vanishes(b.subs(constant, inner.subs(x[q], fixed)) - x[p])]
        for branch in branches[:1]:
            form = [normal(v.subs(x[q], fixed).subs(x[p], branch)) for v in rest.values()]
            if not any(v.has(S.NaN, S.ComplexInfinity) for v in form):
                names = [constant, *(x[k] for k in rest)]
                return constant, [Integer(1), *form], names
    return None
