"""Will computer algebra take an expression for a polynomial of high degree? Asked before it does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any

import sympy as sp

_GREATEST = 12
"""Numerators and denominators in exponents and arguments up to which degrees stay small."""

_GREATEST_POWER = 40
"""Whole powers up to which that is so."""

_KINDS = (
    sp.Pow, sp.exp, sp.sinh, sp.cosh, sp.tanh, sp.coth, sp.sech, sp.csch,
    sp.sin, sp.cos, sp.tan, sp.cot, sp.sec, sp.csc,
)  # fmt: skip
"""What is rewritten over exponentials: exp(38.68 x) becomes the power 967 of exp(x / 25)."""


def has_high_powers(value: Any) -> bool:
    """True if an expression in the value, or in its lists and mappings, holds powers of a high degree."""
    return any(_high(expression) for expression in _expressions(value))


def _expressions(value: Any) -> Iterator[sp.Basic]:
    if isinstance(value, sp.MatrixBase):
        yield from value
    elif isinstance(value, sp.Basic):
        yield value
    elif isinstance(value, list | tuple):
        for one in value:
            yield from _expressions(one)
    elif isinstance(value, Mapping):
        for one in value.values():
            yield from _expressions(one)


@lru_cache(maxsize=512)
def _high(expression: sp.Basic) -> bool:
    if expression.is_Atom:
        return False
    return any(_high_node(node) for node in expression.atoms(*_KINDS))


def _high_node(node: sp.Expr) -> bool:
    if isinstance(node, sp.Pow) and not isinstance(node, sp.exp):
        if isinstance(node.exp, sp.Integer):
            return abs(int(node.exp)) > _GREATEST_POWER
        exponent = node.exp
    else:
        exponent = node.args[0]
    for term in sp.Add.make_args(exponent):
        number = term.as_coeff_Mul()[0]
        if isinstance(number, sp.Rational) and (abs(number.p) > _GREATEST or number.q > _GREATEST):
            return True
    return False
