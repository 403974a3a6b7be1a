"""Whether numbers of some functions leave one set of parameters only, many far apart, or whole families."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
import sympy as sp

from ulna.base import Verdict
from ulna.identification.structural.experiment import SEED
from ulna.symbolic.exact import attempt, normal, value_at

_PRIME = 2147483549
_SECONDS = 1.5
_MOST_PAIRED = 9


def recovered(
    functions: Sequence[sp.Expr], unknown: Sequence[sp.Symbol], positive: frozenset[str]
) -> dict[str, Verdict]:
    """For each parameter that the functions' numbers fix uniquely the verdict that says how; others are left out.

    Step by step: a function, or product or quotient of two, in which one unknown is left, as a quotient of lines in a
    power of it, is solved for it (proved). What stays is asked of a Gröbner basis at a random set of parameters, modulo
    a prime (supported).

    Args:
        functions: rational in the parameters.
        unknown: the parameters.
        positive: names of those known to be positive, of which an even power is enough.
    """
    found = _step_by_step(functions, unknown, positive, {})
    if len(functions) <= _MOST_PAIRED and any(s.name not in found for s in unknown):
        paired = [normal(f) for a, b in combinations(functions, 2) for f in (a / b, a * b)]
        found = _step_by_step([*functions, *paired], unknown, positive, found)
    rest = [s for s in unknown if s.name not in found and any(s in f.free_symbols for f in functions)]
    if rest:
        found |= attempt(_SECONDS, "Gröbner basis", _unique, tuple(functions), tuple(rest)).value or {}
    return found


def _step_by_step(
    functions: Sequence[sp.Expr], unknown: Sequence[sp.Symbol], positive: frozenset[str], known: Mapping[str, Verdict]
) -> dict[str, Verdict]:
    found = dict(known)
    before = -1
    while before < len(found):
        before = len(found)
        for function in functions:
            left = [s for s in unknown if s in function.free_symbols and s.name not in found]
            if len(left) == 1 and (verdict := _solved(function, left[0], positive)) is not None:
                found[left[0].name] = verdict
    return found


def claim(name: str) -> str:
    """What is said of a parameter that is known globally."""
    return f"the outputs leave one value of {name}"


def _solved(function: sp.Expr, symbol: sp.Symbol, positive: frozenset[str]) -> Verdict | None:
    above, below = (sp.expand(part) for part in sp.fraction(sp.together(function)))
    if not (above.is_polynomial(symbol) and below.is_polynomial(symbol)):
        return None
    powers = {k for part in (above, below) for (k,), _ in sp.Poly(part, symbol).terms() if k}
    if len(powers) != 1:
        return None
    [power] = powers
    if power % 2 or symbol.name in positive:
        evidence = {"from": function} | ({} if power % 2 else {"positive": True})
        return Verdict.proved(claim(symbol.name), **evidence)
    return None


def _unique(functions: tuple[sp.Expr, ...], rest: tuple[sp.Symbol, ...]) -> dict[str, Verdict]:
    """Of the parameters that are left those with one value only at a random set of parameters."""
    generator = np.random.default_rng(SEED)
    symbols = sorted({s for f in functions for s in f.free_symbols}, key=lambda s: s.name)
    drawn = {s: sp.Integer(int(generator.integers(2, 1 << 20))) for s in symbols}
    known: Mapping[sp.Symbol, sp.Expr] = {s: v for s, v in drawn.items() if s not in rest}
    guard = sp.Symbol("reciprocal_of_denominators")
    equations, denominators = [], sp.S.One
    for function in functions:
        above, below = sp.fraction(sp.together(function.xreplace(dict(known))))
        if not above.free_symbols and not below.free_symbols:
            continue
        if not all(part.is_polynomial(*rest) for part in (above, below)):
            return {}
        value = value_at(function, drawn)
        if value is None:
            return {}
        equations.append(sp.expand(above * value.q - value.p * below))
        if below.free_symbols:
            denominators *= below
    if denominators != 1:
        equations.append(sp.expand(guard * denominators - 1))
    basis = sp.groebner(equations, guard, *rest, modulus=_PRIME, order="grevlex")
    evidence = {"method": "a Gröbner basis at random parameters", "points": 1, "prime": _PRIME, "seed": SEED}
    return {s.name: Verdict.supported(claim(s.name), **evidence) for s in rest if basis.contains(s - drawn[s])}
