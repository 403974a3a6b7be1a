"""The best-looking function of a function: any F(T) with F' ≠ 0 has the same level sets as T."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product

from sympy import (
    Add,
    Dummy,
    Expr,
    Function,
    Integer,
    Mul,
    Pow,
    Rational,
    Symbol,
    acos,
    asin,
    atan,
    exp,
    expand,
    expand_log,
    factor,
    factor_terms,
    fraction,
    lcm_list,
    log,
    powsimp,
    sqrt,
    together,
)

from ulna.symbolic.exact import attempt, normal
from ulna.symbolic.integration import exponential

_SECONDS = 0.5
_STEPS = (Rational(1, 97), Rational(-1, 89), Rational(1, 61), Rational(-1, 53))


def simplest_function_of(value: Expr, coordinates: Sequence[Symbol], *, near: Mapping[Symbol, Expr]) -> Expr | None:
    """The shortest of T, log T, exp T, powers and reciprocals of T that is real around the point.

    One that is regular at the point, with a nonzero differential, is preferred to a shorter one. Constants that are
    added or multiplied are dropped, and T is 0 at the point where it is finite there.

    Args:
        value: T.
        coordinates: x.
        near: values of all coordinates; parameters stay symbols and count as positive numbers for the test of realness.

    Returns:
        None if every candidate is complex or undefined around the point.
    """
    best: tuple[tuple[bool, int, int], Expr] | None = None
    for candidate in _distinct(_candidates(value, coordinates)):
        repaired = real_logarithms(candidate, near)
        if any(not p.exp.is_number for p in repaired.atoms(Pow)):
            repaired = _merged_powers(repaired)
        quality = _quality(repaired, coordinates, near)
        if quality is None:
            continue
        key = (not quality, repaired.count_ops() + repaired.count(log) + repaired.count(exp), len(str(repaired)))
        if best is None or key < best[0]:
            best = key, repaired
    if best is None:
        return None
    return best[1] if best[0][0] else without_offset(best[1], near)


def without_offset(value: Expr, near: Mapping[Symbol, Expr]) -> Expr:
    """T − T(point) where T is finite at the point, T itself where the point of its coordinates depends on parameters.

    A constant of parameters would make a longer function, which says no more.
    """
    if any(near[x].free_symbols for x in near.keys() & value.free_symbols):
        return value
    offset = attempt(_SECONDS, "value at the point", value.subs, list(near.items())).value
    return value - offset if offset is not None and offset.is_finite else value


def without_arcsines(value: Expr) -> Expr:
    """asin w → atan(w / √(1 − w²)) wherever the root comes out: asin(y/√(x² + y²)) → atan(y/x).

    Roots are taken with positive symbols. The new form has the same differential where the symbols are positive,
    and no root that limits it to one side.
    """
    swaps = {}
    for node in value.atoms(asin, acos):
        positive = {s: Dummy(s.name, positive=True) for s in node.free_symbols}
        w = node.args[0].xreplace(positive)
        rest = attempt(_SECONDS, "1 − w²", lambda w=w: sqrt(factor(1 - w**2))).value
        slope = attempt(_SECONDS, "tangent", normal, w / rest).value if rest is not None and rest != 0 else None
        if slope is None or any(not p.exp.is_Integer for p in slope.atoms(Pow)):
            continue
        slope = slope.xreplace({d: s for s, d in positive.items()})
        swaps[node] = atan(slope) if isinstance(node, asin) else -atan(slope)
    return value.xreplace(swaps) if swaps else value


def _candidates(value: Expr, coordinates: Sequence[Symbol]) -> Iterator[Expr]:
    plain = _plain(_merged_powers(value), coordinates)
    yield plain
    yield from _only_argument(plain, coordinates)
    yield from (_plain(form, coordinates) for form in _rewritten(plain))
    if plain.has(log):
        scale = lcm_list([c.q for c in _log_coefficients(plain)] or [1])
        yield from _powers(exponential(expand(plain * scale)), coordinates)
        for coefficient in _log_coefficients(plain)[:2]:
            yield from _powers(exponential(expand(plain / coefficient)), coordinates)
    split = expand_log(log(_monic(plain)), force=True)
    if plain.is_Mul or plain.is_Pow or isinstance(plain, exp):
        yield from _powers(plain, coordinates)
        yield _plain(split, coordinates)


def _merged_powers(value: Expr) -> Expr:
    """exp(b log u) → u^b and uᵃ u → uᵃ⁺¹."""
    swaps = {node: exponential(node.args[0]) for node in value.atoms(exp) if node.args[0].has(log)}
    merged = attempt(_SECONDS, "powers", powsimp, value.xreplace(swaps))
    return merged.value if merged.value is not None else value


def _only_argument(value: Expr, coordinates: Sequence[Symbol]) -> Iterator[Expr]:
    """u where T is a function of u alone: the argument of a function or the base of a power that occurs in T."""
    own = set(coordinates)
    inner = {node.args[0] for node in value.atoms(Function, Pow, exp) if own & node.args[0].free_symbols}
    for u in sorted(inner, key=lambda u: (u.count_ops(), str(u))):
        if not u.is_Symbol and not own & value.subs(u, Dummy("u")).free_symbols:
            yield _plain(u, coordinates)


def _powers(value: Expr, coordinates: Sequence[Symbol]) -> Iterator[Expr]:
    """T and the powers of T that make its exponents small whole numbers, with both signs."""
    value = powsimp(value)
    yield _plain(value, coordinates)
    exponents = [f.as_base_exp()[1] for f in Mul.make_args(value) if set(coordinates) & f.free_symbols]
    rational = [e for e in exponents if e.is_Rational and e != 0]
    if rational:
        common = rational[0]
        for e in rational[1:]:
            common = common.gcd(e)
        for power in {1 / common, -1 / common, Integer(-1)}:
            yield _plain(Mul(*(_raised(f, power) for f in Mul.make_args(value))), coordinates)


def _raised(factor: Expr, power: Expr) -> Expr:
    base, exponent = factor.as_base_exp()
    return Pow(base, exponent * power)


def _log_coefficients(value: Expr) -> list[Expr]:
    found = []
    for term in Add.make_args(expand(value)):
        logs = [f for f in Mul.make_args(term) if isinstance(f, log)]
        if len(logs) == 1 and (term / logs[0]).is_Rational:
            found.append(term / logs[0])
    return found


def _rewritten(value: Expr) -> Iterator[Expr]:
    rewritings = (("expand", expand), ("factor terms", factor_terms), ("normal", normal), ("factor", factor))
    for what, function in rewritings:
        found = attempt(_SECONDS, what, function, value)
        if found.value is not None:
            yield found.value
    joined = attempt(_SECONDS, "together", together, value).value
    if joined is not None:
        numerator, denominator = fraction(joined)
        if denominator.free_symbols:
            yield normal(denominator / numerator)


def _plain(value: Expr, coordinates: Sequence[Symbol]) -> Expr:
    """Without added constants and constant factors."""
    own = set(coordinates)
    value = Add(*(t for t in Add.make_args(value) if own & t.free_symbols))
    if value.is_Add:
        terms = Add.make_args(value)
        scale = lcm_list([t.as_coeff_Mul()[0].q for t in terms if t.as_coeff_Mul()[0].is_Rational])
        value = Add(*(t * scale for t in terms))
        value = factor_terms(value).as_independent(*coordinates, as_Add=False)[1]
        return -value if value.could_extract_minus_sign() else value
    value = _monic(value, own)
    return Mul(*(-f if f.is_Add and f.could_extract_minus_sign() else f for f in Mul.make_args(value)))


def _monic(value: Expr, own: set[Symbol] | None = None) -> Expr:
    if value.is_Mul:
        return Mul(*(f for f in value.args if f.free_symbols & (own or f.free_symbols)))
    return value


def _distinct(candidates: Iterable[Expr]) -> list[Expr]:
    return [c for c in dict.fromkeys(candidates) if c.free_symbols]


def real_logarithms(value: Expr, near: Mapping[Symbol, Expr]) -> Expr:
    """log u → log(−u) wherever u is negative at the point: another branch, the same differential."""
    swaps = {}
    for node in value.atoms(log):
        number = _number(node.args[0], near)
        if number is not None and number.is_real and number < 0:
            swaps[node] = log(-node.args[0])
    return value.xreplace(swaps) if swaps else value


def _quality(value: Expr, coordinates: Sequence[Symbol], near: Mapping[Symbol, Expr]) -> bool | None:
    """True: real with nonzero finite differential at the point; False: only real around it; None: not even that."""
    shifted = [
        {x: near[x] + step * sign for x, sign in zip(coordinates, signs, strict=True)}
        for step, signs in zip(_STEPS, product((1, Rational(2, 3)), repeat=len(coordinates)), strict=False)
    ]
    real = [_is_real(_number(value, point)) for point in shifted]
    if not any(real):
        return None
    slopes = [_number(value.diff(x), near) for x in coordinates]
    regular = _is_real(_number(value, near)) and all(_is_real(s) for s in slopes) and any(s != 0 for s in slopes)
    return regular and all(real)


def _is_real(number: Expr | None) -> bool:
    return number is not None and bool(number.is_real) and bool(number.is_finite)


def _number(value: Expr, point: Mapping[Symbol, Expr]) -> Expr | None:
    """The value to 15 digits, parameters at distinct positive numbers; None if it cannot be computed.

    The parameters of the point count too: at an equilibrium q = 1/Ki not even q is a number without them.
    """
    of_point = set[Symbol]().union(*(w.free_symbols for w in point.values()))
    parameters = sorted((value.free_symbols | of_point) - set(point), key=str)
    numbers = {p: Rational(7 + 3 * k, 5 + 2 * k) for k, p in enumerate(parameters)}
    found = attempt(_SECONDS, "a value", lambda: value.subs(list(point.items())).subs(numbers).evalf(15, chop=True))
    return found.value
