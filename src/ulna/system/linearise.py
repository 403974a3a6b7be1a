"""Exact linearisation of a system at a point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp

from ulna.system.holder import SystemLike, as_system
from ulna.system.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class Linearisation:
    """dx' = A dx + B du, dy = C dx + D du about `point`.

    Attributes:
        A: (n, n); B: (n, m); C: (p, n); D: (p, m), exact.
        point: the values put in for states and inputs.
    """

    system: System
    point: Mapping[sp.Symbol, sp.Expr]
    A: sp.ImmutableDenseMatrix
    B: sp.ImmutableDenseMatrix
    C: sp.ImmutableDenseMatrix
    D: sp.ImmutableDenseMatrix


def linearise(system: SystemLike, point: Mapping[sp.Symbol, sp.Expr]) -> Linearisation:
    """The Jacobians of rates and readouts at a point (symbols not in `point` stay)."""
    system = as_system(system)
    rates, readouts = (
        sp.Matrix(system.inline(system.rates)),
        sp.Matrix(len(system.readouts), 1, system.inline(system.readouts)),
    )
    x, u = list(system.state_symbols), list(system.input_symbols)

    def at_point(expressions: sp.Matrix, by: list[sp.Symbol]) -> sp.ImmutableDenseMatrix:
        if not by or not expressions.rows:
            return sp.ImmutableDenseMatrix(sp.zeros(expressions.rows, len(by)))
        return sp.ImmutableDenseMatrix(expressions.jacobian(by).subs(dict(point)))

    return Linearisation(
        system=system,
        point=dict(point),
        A=at_point(rates, x),
        B=at_point(rates, u),
        C=at_point(readouts, x),
        D=at_point(readouts, u),
    )
