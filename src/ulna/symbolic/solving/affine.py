"""Unknowns of affine equations, as formulas: accelerations behind a mass matrix, say."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import sympy as sp

from ulna.base import PlantError
from ulna.symbolic.exact.quotients import normal
from ulna.symbolic.exact.rank import rank_of_numbers

_SEED = 3107
_BY_MINORS = 2
"""Up to this many unknowns the solution is one fraction over the determinant; beyond, elimination stays shorter."""


def solve_affine(
    equations: Sequence[sp.Expr], unknowns: Sequence[sp.Symbol], *, where: str = "affine equations"
) -> dict[sp.Symbol, sp.Expr]:
    """The unknowns at which all expressions vanish; pivots are chosen at a random point.

    Args:
        equations: (k,) expressions, affine in the unknowns.
        unknowns: (k,) symbols.
        where: how an error names them.

    Raises:
        PlantError: if an expression is not affine, or the coefficients are singular at a random point.
    """
    return dict(_solution(tuple(equations), tuple(unknowns), where))


@lru_cache(maxsize=64)
def _solution(
    equations: tuple[sp.Expr, ...], unknowns: tuple[sp.Symbol, ...], where: str
) -> tuple[tuple[sp.Symbol, sp.Expr], ...]:
    zeros = dict.fromkeys(unknowns, sp.Integer(0))
    names = ", ".join(s.name for s in unknowns)
    rows: list[list[sp.Expr]] = []
    for equation in equations:
        # Sin² + cos² becomes one: it stands in every mass matrix, and its pivots would keep it for good.
        row = [sp.factor_terms(normal(sp.expand(sp.diff(equation, unknown)))) for unknown in unknowns]
        if any(entry.has(*unknowns) for entry in row):
            raise PlantError(
                f"the implicit definitions {names} of {where}",
                "an equation is not affine in them.",
                "Write each as coefficients times unknowns plus what is known.",
            )
        rows.append(row)
    known = [-equation.xreplace(zeros) for equation in equations]
    sides = [min(side, sp.expand(side), key=sp.count_ops) for side in known]
    sample = _sampled(rows)
    if rank_of_numbers(sample) < len(unknowns):
        raise PlantError(
            f"the implicit definitions {names} of {where}",
            "their coefficients are singular at a random point.",
            "Give as many independent equations as unknowns.",
        )
    found = _by_minors(rows, sides) if len(unknowns) <= _BY_MINORS else _eliminated(rows, sides, sample)
    return tuple(zip(unknowns, found, strict=True))


def _sampled(rows: Sequence[Sequence[sp.Expr]]) -> np.ndarray:
    symbols = sorted(set().union(*(e.free_symbols for row in rows for e in row)), key=str)
    numbers = np.random.default_rng(_SEED).uniform(0.2, 1.2, len(symbols))
    point = {symbol: sp.Float(value) for symbol, value in zip(symbols, numbers, strict=True)}
    return np.array([[float(sp.N(entry.xreplace(point))) for entry in row] for row in rows])


def _by_minors(rows: list[list[sp.Expr]], sides: list[sp.Expr]) -> list[sp.Expr]:
    if len(rows) == 1:
        return [sides[0] / rows[0][0]]
    (a, b), (c, d) = rows
    determinant = a * d - b * c
    return [(d * sides[0] - b * sides[1]) / determinant, (a * sides[1] - c * sides[0]) / determinant]


def _eliminated(rows: list[list[sp.Expr]], sides: list[sp.Expr], sample: np.ndarray) -> list[sp.Expr]:
    """Gauss with the largest sampled pivot of each column."""
    count = len(rows)
    rows, sides, sample = [list(row) for row in rows], list(sides), sample.copy()
    for k in range(count):
        best = max(range(k, count), key=lambda i: abs(sample[i, k]))
        if abs(sample[k, k]) < 1e-3 * abs(sample[best, k]):  # the order given is kept where it serves
            rows[k], rows[best], sides[k], sides[best] = rows[best], rows[k], sides[best], sides[k]
            sample[[k, best]] = sample[[best, k]]
        for i in range(k + 1, count):
            if rows[i][k] == 0:
                continue
            factor, ratio = rows[i][k] / rows[k][k], sample[i, k] / sample[k, k]
            for j in range(k + 1, count):
                rows[i][j] = rows[i][j] - factor * rows[k][j]
                sample[i, j] -= ratio * sample[k, j]
            sides[i] = sides[i] - factor * sides[k]
    solution: list[sp.Expr] = [sp.Integer(0)] * count
    for k in reversed(range(count)):
        inner = sum((rows[k][j] * solution[j] for j in range(k + 1, count)), sp.Integer(0))
        solution[k] = (sides[k] - inner) / rows[k][k]
    return solution
