"""Energies that decide critical equilibria: conservative systems of several freedoms, damped oscillators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, combinations_with_replacement

import sympy as sp

from ulna.base import Status
from ulna.symbolic.exact import SEED, SampledZero, is_zero, random_points

_QUICK = SampledZero(seconds=0.3)
_POINTS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Oscillators:
    """q' = p, p' = F(q) with M F = −∂V/∂q for a positive definite constant M.

    Attributes:
        positions: q; velocities: p; mass: M; stiffness: ∂²V/∂q² at the origin.
    """

    positions: tuple[sp.Symbol, ...]
    velocities: tuple[sp.Symbol, ...]
    mass: sp.ImmutableDenseMatrix
    stiffness: sp.ImmutableDenseMatrix


def conservative_oscillators(rates: Sequence[sp.Expr], coordinates: Sequence[sp.Symbol]) -> Oscillators | None:
    """The system as undamped oscillators about a strict minimum of V, or None (Lagrange and Dirichlet's theorem)."""
    rate = dict(zip(coordinates, rates, strict=True))
    positions = [q for q in coordinates if rate[q] in rate and rate[q] != q]
    velocities = [rate[q] for q in positions]
    if len(set(velocities)) != len(velocities) or set(positions) & set(velocities):
        return None
    if len(positions) * 2 != len(coordinates):
        return None
    forces = sp.Matrix([rate[p] for p in velocities])
    if forces.free_symbols & set(velocities):
        return None
    slopes = forces.jacobian(positions)
    origin = dict.fromkeys(positions, sp.Integer(0))
    for mass in _masses(slopes, positions):
        stiffness = (-mass * slopes).xreplace(origin)
        if _positive(mass) and _positive(stiffness):
            return Oscillators(
                positions=tuple(positions),
                velocities=tuple(velocities),
                mass=sp.ImmutableDenseMatrix(mass),
                stiffness=sp.ImmutableDenseMatrix(stiffness),
            )
    return None


def _masses(slopes: sp.MatrixBase, positions: Sequence[sp.Symbol]) -> list[sp.MatrixBase]:
    """Symmetric constant M with M ∂F/∂q symmetric: the identity if it will do, else a basis and its sum."""
    n = slopes.rows
    pairs = list(combinations_with_replacement(range(n), 2))
    unknowns = {pair: sp.Dummy(f"m{pair}") for pair in pairs}
    M = sp.Matrix(n, n, lambda i, j: unknowns[min(int(i), int(j)), max(int(i), int(j))])
    points = random_points(positions, seed=SEED, near=None)
    equations = []
    for _, point in zip(range(_POINTS), points, strict=False):
        local = M * slopes.xreplace(dict(point))
        equations += [sp.expand(local[i, j] - local[j, i]) for i, j in combinations(range(n), 2)]
    flat = list(unknowns.values())
    solution = next(iter(sp.linsolve([e for e in equations if e != 0] or [sp.Integer(0)], flat)), None)
    if solution is None:
        return []
    general = M.xreplace(dict(zip(flat, solution, strict=True)))
    free = sorted(general.free_symbols & set(flat), key=str)
    units = [general.xreplace({f: sp.Integer(int(f is g)) for f in free}) for g in free]
    ones = general.xreplace(dict.fromkeys(free, sp.Integer(1)))
    candidates = [sp.eye(n), *units, *(-u for u in units), ones]
    return [c for c in candidates if _symmetric(c * slopes)]


def _symmetric(matrix: sp.MatrixBase) -> bool:
    return all(
        is_zero(matrix[i, j] - matrix[j, i], test=_QUICK).status is Status.PROVED
        for i, j in combinations(range(matrix.rows), 2)
    )


def _positive(matrix: sp.MatrixBase) -> bool:
    return all(matrix[:k, :k].det().is_positive for k in range(1, matrix.rows + 1))


def damping_sign(rates: Sequence[sp.Expr], coordinates: Sequence[sp.Symbol]) -> int | None:
    """−1 if (x, y)' = (y, F(x) + y ρ(x, y)) loses energy, 1 if it gains, but for curves it does not stay on; else None.

    −ρ must be a polynomial of even powers with coefficients of one sign (LaSalle's principle; in reversed time for
    the gain).
    """
    x, y = coordinates
    if sp.expand(rates[0] - y) != 0:
        return None
    origin = {y: sp.Integer(0)}
    rest = sp.expand(rates[1] - rates[1].xreplace(origin))
    quotient = sp.cancel(rest / y)
    if rest == 0 or not quotient.is_polynomial(x, y):
        return None
    terms = sp.Poly(quotient, x, y).terms()
    if any(e % 2 for exponents, _ in terms for e in exponents):
        return None
    if all(c.is_negative for _, c in terms):
        return -1
    return 1 if all(c.is_positive for _, c in terms) else None
