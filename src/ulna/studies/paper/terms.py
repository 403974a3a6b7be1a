"""Sums taken apart into terms that can be matched: what is symbolic names the term, what is numeric is compared."""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import sympy as sp


@dataclass(frozen=True, slots=True, kw_only=True)
class Term:
    """One term of a sum.

    Attributes:
        shape: the symbolic part, numbers inside functions left out: x₂ sin(z₁) for −34 x₂ sin(19.6 z₁).
        factor: the numeric factor in front (a number, or a mark of a printed one, with its sign).
        inner: numeric factors inside functions, by their place: ((sin of z₁, 19.6),).
    """

    shape: sp.Expr
    factor: sp.Expr
    inner: tuple[tuple[str, sp.Expr], ...]


def split_terms(expression: sp.Expr, marks: AbstractSet[sp.Symbol] = frozenset()) -> Mapping[sp.Expr, Term]:
    """Return the terms of the multiplied-out expression by their shape.

    Args:
        expression: a sum, or a single term.
        marks: symbols that stand for numbers.
    """
    terms: dict[sp.Expr, Term] = {}
    for addend in sp.Add.make_args(sp.expand(expression)):
        if addend == 0:
            continue
        term = _split(addend, marks)
        if term.shape in terms:  # the same shape with other numbers inside: kept apart by its own name
            shape = term.shape * sp.Symbol(f"again_{len(terms)}")
            term = Term(shape=shape, factor=term.factor, inner=term.inner)
        terms[term.shape] = term
    return terms


def _split(addend: sp.Expr, marks: AbstractSet[sp.Symbol]) -> Term:
    numeric, symbolic = _numeric_factors(addend, marks)
    inner: list[tuple[str, sp.Expr]] = []
    shape = sp.Integer(1)
    for factor in symbolic:
        shape *= _without_numbers(factor, marks, inner)
    return Term(shape=shape, factor=sp.Mul(*numeric), inner=tuple(inner))


def _numeric_factors(addend: sp.Expr, marks: AbstractSet[sp.Symbol]) -> tuple[list[sp.Expr], list[sp.Expr]]:
    numeric, symbolic = [], []
    for factor in sp.Mul.make_args(addend):
        is_number = factor.free_symbols <= set(marks)
        (numeric if is_number else symbolic).append(factor)
    return numeric, symbolic


def _without_numbers(factor: sp.Expr, marks: AbstractSet[sp.Symbol], inner: list[tuple[str, sp.Expr]]) -> sp.Expr:
    """The factor with the numbers inside its functions put aside into `inner`."""
    if isinstance(factor, sp.Pow):
        base, exponent = factor.as_base_exp()
        return sp.Pow(_without_numbers(base, marks, inner), exponent)
    if not isinstance(factor, sp.Function):
        return factor
    arguments = []
    for argument in factor.args:
        bare = sp.Integer(0)
        for addend in sp.Add.make_args(sp.expand(argument)):
            numeric, symbolic = _numeric_factors(addend, marks)
            part = sp.Mul(*(_without_numbers(s, marks, inner) for s in symbolic))
            number = sp.Mul(*numeric)
            if number != 1:
                inner.append((f"{type(factor).__name__} of {part}", number))
            bare += part
        arguments.append(bare)
    return factor.func(*arguments)
