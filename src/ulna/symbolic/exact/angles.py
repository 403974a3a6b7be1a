"""Angles as they are written: sin(x₂ − 2 + 2eˣ) is kept as the sine of one angle instead of being expanded.

Addition theorems are needed only where angles are related. So of all arguments of sines and cosines a basis over the
rational numbers is chosen among the arguments themselves, and every argument is written over this basis.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

from sympy import Add, Dummy, Expr, Rational, Symbol, cos, cot, csc, expand_trig, pi, sec, sin, tan

_CIRCULAR = (sin, cos, tan, cot, sec, csc)

Vector = dict[Expr, Rational]


def with_plain_angles(expressions: Sequence[Expr]) -> tuple[tuple[Expr, ...], dict[Expr, Expr]]:
    """The expressions with a symbol for each independent angle that is a sum, and what the symbols stand for."""
    nodes = sorted(set().union(*(e.atoms(*_CIRCULAR) for e in expressions)), key=lambda e: (e.count_ops(), str(e)))
    if all(node.args[0].is_Symbol for node in nodes) or any(node.has(pi) for node in nodes):
        return tuple(expressions), {}
    basis: list[tuple[Expr, Vector, Vector]] = []  # (symbol, reduced vector, the same over the symbols)
    meaning: dict[Expr, Expr] = {}
    swaps: dict[Expr, Expr] = {}
    for node in nodes:
        argument = node.args[0]
        rest, over = _reduced(_vector(argument), basis)
        if rest:
            symbol = argument if argument.is_Symbol else Dummy(f"angle{len(basis)}", real=True)
            basis.append((symbol, rest, {symbol: Rational(1), **{s: -c for s, c in over.items()}}))
            if symbol is not argument:
                meaning[symbol] = argument
            over = {symbol: Rational(1)}
        swaps[node] = node.func(Add(*(c * s for s, c in over.items())))
    return tuple(e.xreplace(swaps) for e in expressions), meaning


def over_relative_angles(expression: Expr) -> Iterator[tuple[Expr, Symbol, Expr]]:
    """The expression over a ∓ b in place of the angle a, for pairs of angles: (expression, symbol, what it stands for).

    A mechanism's formulas often depend on the angle between two of its parts alone; once the addition theorems are
    written out nothing shows that, and no identity leads back.
    """
    inside = [node.args[0] for node in expression.atoms(*_CIRCULAR)]
    masked = expression.xreplace({node: Dummy() for node in expression.atoms(*_CIRCULAR)})
    angles = {s for argument in inside for s in argument.free_symbols} - masked.free_symbols
    for one, other in combinations(sorted(angles, key=str), 2):
        for sign in (1, -1):
            relative = Dummy("relative", real=True)
            yield expand_trig(expression.xreplace({one: sign * other + relative})), relative, one - sign * other


def _vector(argument: Expr) -> Vector:
    vector: Vector = {}
    for term in Add.make_args(argument.expand()):
        coefficient, monomial = term.as_coeff_Mul()
        vector[monomial] = vector.get(monomial, Rational(0)) + coefficient
    return {m: c for m, c in vector.items() if c != 0}


def _reduced(vector: Vector, basis: Sequence[tuple[Expr, Vector, Vector]]) -> tuple[Vector, Vector]:
    """(rest, combination): vector = rest + combination over the symbols, the rest without the leading monomials."""
    rest, over = dict(vector), {}
    for _, direction, symbols in basis:
        leading = next(iter(direction))
        factor = rest.get(leading, Rational(0)) / direction[leading]
        if factor == 0:
            continue
        rest = _sum(rest, direction, -factor)
        over = _sum(over, symbols, factor)
    return rest, over


def _sum(first: Vector, second: Vector, factor: Rational) -> Vector:
    total = dict(first)
    for key, value in second.items():
        total[key] = total.get(key, Rational(0)) + factor * value
    return {key: value for key, value in total.items() if value != 0}
