"""The side of the operating point: a plant with jumps and kinks as the smooth plant it is near a point off them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import sympy as sp
from sympy.core.relational import Relational

from ulna.base import UlnaError
from ulna.system.holder import SystemLike, as_system
from ulna.system.operating_point import equilibrium_in_numbers
from ulna.system.system import System

NON_SMOOTH = (sp.Abs, sp.sign, sp.Min, sp.Max, sp.floor, sp.ceiling, sp.Heaviside, sp.Piecewise)
"""Functions without the derivatives that vector-field methods need."""
_KINK = 1e-9
"""Distance from a kink, relative to its terms, below which the point lies on it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OneSide:
    """A plant near its operating point, where each function that is not smooth is one of its smooth pieces.

    Attributes:
        given: the plant as it was; system: the same with the pieces put in.
        pieces: what stands for each term that is not smooth.
    """

    given: System
    system: System
    pieces: Mapping[sp.Expr, sp.Expr]


def on_one_side(system: SystemLike) -> OneSide | None:
    """The plant on the side of its operating point; None where it is smooth, or the point lies on a kink or jump.

    None also where an input acts on the other side only: within a dead zone a plant cannot be moved.
    """
    given = as_system(system)
    formulas = [*given.inline(given.rates), *given.inline(given.readouts)]
    if not any(e.has(*NON_SMOOTH) for e in formulas):
        return None
    try:
        here = equilibrium_in_numbers(given)
    except UlnaError:
        return None
    at = {**here.values, **here.parameters}
    pieces: dict[sp.Expr, sp.Expr] = {}
    while terms := {t for e in formulas for t in e.atoms(*NON_SMOOTH) if not any(a.has(*NON_SMOOTH) for a in t.args)}:
        found = {term: _piece(term, at) for term in sorted(terms, key=str)}
        if None in found.values():
            return None
        put = {term: piece for term, piece in found.items() if piece is not None}
        pieces |= put
        formulas = [e.xreplace(put) for e in formulas]
    n = len(given.rates)
    smooth = replace(given, rates=tuple(formulas[:n]), readouts=tuple(formulas[n:]), definitions=())
    if any(not any(r.has(u) for r in smooth.rates) for u in given.input_symbols):
        return None
    return OneSide(given=given, system=smooth, pieces=pieces)


def _piece(term: sp.Expr, at: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr | None:
    """What a term is around a point, its arguments being smooth; None on a kink."""
    first = term.args[0]
    if isinstance(term, sp.Abs | sp.sign | sp.Heaviside):
        side = _sign(first, sp.Integer(0), at)
        if not side:
            return None
        above = side > 0
        return {sp.Abs: first if above else -first, sp.sign: sp.Integer(side), sp.Heaviside: sp.Integer(above)}[
            term.func
        ]
    if isinstance(term, sp.Min | sp.Max):
        wanted = -1 if isinstance(term, sp.Min) else 1
        leads = [a for a in term.args if all(b is a or _sign(a, b, at) == wanted for b in term.args)]
        return leads[0] if leads else None
    if isinstance(term, sp.floor | sp.ceiling):
        number = sp.N(first.xreplace(at))
        whole = term.func(number) if number.is_number and number.is_real else None
        return whole if whole is not None and _sign(first, sp.Integer(round(number)), at) else None
    for value, condition in term.args:
        holds = _decided(condition, at)
        if holds is None:
            return None
        if holds:
            return value
    return None


def _decided(condition: sp.Basic, at: Mapping[sp.Symbol, sp.Expr]) -> bool | None:
    """Whether a condition holds around a point; None where one of its comparisons changes there."""
    decided = {}
    for comparison in condition.atoms(Relational):
        side = _sign(comparison.lhs, comparison.rhs, at)
        if not side:
            return None
        decided[comparison] = sp.true if bool(comparison.func(side, 0)) else sp.false
    return bool(condition.xreplace(decided))


def _sign(left: sp.Basic, right: sp.Basic, at: Mapping[sp.Symbol, sp.Expr]) -> int:
    """The sign of left - right at a point, 0 on the kink and where it has no value."""
    a, b = (sp.N(e.xreplace(at)) for e in (left, right))
    if not (a.is_number and b.is_number and a.is_real and b.is_real) or abs(a - b) <= _KINK * (abs(a) + abs(b)):
        return 0
    return 1 if a > b else -1
