"""Critical equilibria in the plane: centres, weak foci and nilpotent points.

Sources: A. M. Lyapunov, The General Problem of the Stability of Motion (1892), for the constants of a weak focus and
the first integral of a centre; A. F. Andreev, Transl. AMS 8 (1958), for nilpotent points; H. Poincaré for reversible
centres.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy as sp

from ulna.base import Status
from ulna.symbolic.exact import SampledZero, is_zero, tidy
from ulna.symbolic.solving import taylor_coefficients

_QUICK = SampledZero(seconds=0.3)


def center_reason(rates: Sequence[sp.Expr], coordinates: Sequence[sp.Symbol]) -> str | None:
    """Why an equilibrium at the origin with eigenvalues ±iω is a centre, or None if no reason is seen.

    Looked for: a reflection of one coordinate that reverses time, a vanishing divergence (a Hamiltonian), and rates
    that are products X(x) Y(y) of one function of each coordinate (a first integral by quadrature).
    """
    x, y = coordinates
    if reversible(rates, coordinates):
        return "a reflection of one coordinate reverses time"
    if _zero(rates[0].diff(x) + rates[1].diff(y)):
        return "the divergence vanishes: a Hamiltonian is conserved"
    separable = all(_zero(r * r.diff(x, y) - r.diff(x) * r.diff(y)) for r in rates)
    origin = {x: sp.Integer(0), y: sp.Integer(0)}
    # 1 / (X_1(x) Y_2(y)) is an integrating factor if both factors are regular at the equilibrium.
    if separable and not _zero(rates[0].diff(y).xreplace(origin)) and not _zero(rates[1].diff(x).xreplace(origin)):
        return "the variables separate: a function H_1(x) + H_2(y) is conserved"
    return None


def reversible(rates: Sequence[sp.Expr], coordinates: Sequence[sp.Symbol]) -> bool:
    """Whether (x, y, t) → (x, −y, −t) or (−x, y, −t) maps solutions to solutions."""
    x, y = coordinates
    for sign_x, sign_y in ((1, -1), (-1, 1)):
        mirror = {x: sign_x * x, y: sign_y * y}
        if _zero(rates[0].xreplace(mirror) + sign_x * rates[0]) and _zero(
            rates[1].xreplace(mirror) + sign_y * rates[1]
        ):
            return True
    return False


def focal_value(
    rates: Sequence[sp.Expr], coordinates: Sequence[sp.Symbol], square: sp.Expr, order: int
) -> tuple[sp.Expr, sp.Expr] | None:
    """(g, V): the first g ≠ 0 in V' = g (ω² x² + y²)^j + … with V = ω² x² + y² + …; None if all vanish.

    Negative g: asymptotically stable with Lyapunov function V; positive: unstable.

    Args:
        rates: polynomial field with linear part (y, −ω² x); coordinates: (x, y).
        square: ω².
        order: highest degree of V.
    """
    x, y = coordinates
    energy = square * x**2 + y**2
    parts = {2: energy}
    pieces = [_by_degree(r, coordinates) for r in rates]
    for degree in range(3, order + 1):
        known = sp.Integer(0)
        for k, part in parts.items():
            for i, z in enumerate(coordinates):
                known += part.diff(z) * pieces[i].get(degree + 1 - k, 0)
        unknowns = [sp.Dummy(f"v{k}") for k in range(degree + 1)]
        constant = sp.Dummy("g")
        form = sp.Add(*(a * x**k * y ** (degree - k) for k, a in enumerate(unknowns)))
        equation = y * form.diff(x) - square * x * form.diff(y) + known
        if degree % 2 == 0:
            equation -= constant * energy ** (degree // 2)
        equations = sp.Poly(sp.expand(equation), x, y).coeffs()
        [solution] = sp.linsolve(equations, [constant, *unknowns])
        values = dict(zip([constant, *unknowns], solution, strict=True))
        free = dict.fromkeys([*unknowns, constant], sp.Integer(0))
        parts[degree] = sp.expand(form.xreplace(values).xreplace(free))
        g = tidy(values[constant].xreplace(free)) if degree % 2 == 0 else sp.Integer(0)
        if g != 0:
            return g, sp.Add(*parts.values())
    return None


def nilpotent_type(
    rates: Sequence[sp.Expr], coordinates: Sequence[sp.Symbol], order: int
) -> tuple[str, dict[str, Any]] | None:
    """The type of an equilibrium with linear part (y, 0): "unstable", "stable node", "monodromic"; None if unknown.

    With y = φ(x) solving x' = 0: y' on it is a x^α + …, the divergence b x^β + … (Andreev).

    Args:
        rates: field that vanishes at the origin; coordinates: (x, y).
        order: highest power of x looked at.
    """
    x, _ = coordinates
    graph = _isocline(rates[0], coordinates, order)
    curve = {x: [sp.Integer(0), sp.Integer(1)], coordinates[1]: graph}
    divergence = rates[0].diff(x) + rates[1].diff(coordinates[1])
    slope, spread = taylor_coefficients([rates[1], divergence], curve, order)
    alpha = next((k for k, c in enumerate(slope) if c != 0), None)
    beta = next((k for k, c in enumerate(spread) if c != 0), None)
    if alpha is None:
        return None
    a = slope[alpha]
    evidence: dict[str, Any] = {"a": a, "alpha": alpha}
    if beta is not None:
        evidence |= {"b": spread[beta], "beta": beta}
    if alpha % 2 == 0 or a.is_positive:
        return "unstable", evidence
    if beta is None or 2 * beta > alpha - 1:
        return "monodromic", evidence
    b = spread[beta]
    if 2 * beta == alpha - 1 and (b**2 + 4 * a * (beta + 1)).is_negative:
        return "monodromic", evidence
    if beta % 2:
        return "unstable", evidence
    return ("unstable" if b.is_positive else "stable node"), evidence


def drifting_type(
    rates: Sequence[sp.Expr], coordinates: Sequence[sp.Symbol], order: int
) -> tuple[str, dict[str, Any]] | None:
    """The type of the origin of (x, y)' = (y, y ρ(x, y)), where the line y = 0 is at rest: "unstable" or "stable".

    Off the line dy/dx = ρ. With ρ(x, 0) = b x^k + … and k even, b < 0 every motion comes to rest close by; else some
    motion towards one side never slows down. None if the system is not of this kind.
    """
    x, y = coordinates
    at_rest = {y: sp.Integer(0)}
    if not _zero(rates[0] - y) or not _zero(rates[1].xreplace(at_rest)):
        return None
    spread = rates[1].diff(y).xreplace(at_rest)
    if _zero(spread):
        return "unstable", {"reason": "a velocity, once there, does not change sign"}
    [series] = taylor_coefficients([spread], {x: [sp.Integer(0), sp.Integer(1)]}, order)
    k = next((k for k, c in enumerate(series) if c != 0), None)
    if k is None:
        return None
    stable = k % 2 == 0 and bool(series[k].is_negative)
    known = stable or k % 2 == 1 or bool(series[k].is_positive)
    return ("stable" if stable else "unstable", {"b": series[k], "k": k}) if known else None


def _isocline(rate: sp.Expr, coordinates: Sequence[sp.Symbol], order: int) -> list[sp.Expr]:
    """Coefficients of y = φ(x) with rate(x, φ(x)) = 0, where ∂rate/∂y(0) = 1."""
    x, y = coordinates
    graph: list[sp.Expr] = [sp.Integer(0), sp.Integer(0)]
    for degree in range(2, order + 1):
        [series] = taylor_coefficients([rate], {x: [sp.Integer(0), sp.Integer(1)], y: graph}, degree)
        graph.append(-series[degree])
    return graph


def _by_degree(polynomial: sp.Expr, coordinates: Sequence[sp.Symbol]) -> dict[int, sp.Expr]:
    pieces: dict[int, sp.Expr] = {}
    for exponents, coefficient in sp.Poly(polynomial, *coordinates).terms():
        term = coefficient * sp.Mul(*(z**e for z, e in zip(coordinates, exponents, strict=True)))
        pieces[sum(exponents)] = pieces.get(sum(exponents), sp.Integer(0)) + term
    return pieces


def _zero(expression: sp.Expr) -> bool:
    """Only what is proved counts: a centre is destroyed by the smallest term."""
    return expression == 0 or is_zero(expression, test=_QUICK).status is Status.PROVED
