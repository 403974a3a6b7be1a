"""The stability class of the origin of a block of equations: eigenvalues first, then what decides critical cases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import sympy as sp

from ulna.design.internal.center_manifold import CenterModes, ReducedOrder, center_modes, planar_field, reduced_orders
from ulna.design.internal.conserved import conservative_oscillators, damping_sign
from ulna.design.internal.planar_stability import center_reason, drifting_type, focal_value, nilpotent_type, reversible
from ulna.symbolic.exact import SampledZero, attempt, generic_rank, is_zero
from ulna.symbolic.solving import RootLocation, eigenvalue_location, graph_near

_QUICK = SampledZero(seconds=0.3)
_SECONDS = 1.5
_SCALAR_ORDER = 9
_PLANAR_ORDER = 7


class StabilityClass(StrEnum):
    """How an equilibrium is stable."""

    EXPONENTIAL = "exponential"
    """Asymptotically stable with all eigenvalues left of the imaginary axis."""
    ASYMPTOTIC = "asymptotic"
    """Asymptotically stable, but not exponentially."""
    MARGINAL = "marginal"
    """Stable, not asymptotically."""
    UNSTABLE = "unstable"
    """Not stable."""
    UNDECIDED = "undecided"
    """Nothing can be said."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockClass:
    """The class of the origin, and why.

    Attributes:
        stability: the class; location: of the eigenvalues.
        evidence: what decided: reduced dynamics, Lyapunov function, conserved quantity, what was tried.
    """

    stability: StabilityClass
    location: RootLocation
    evidence: dict[str, Any] = field(default_factory=dict)


def block_class(rates: Sequence[sp.Expr], coordinates: Sequence[sp.Symbol]) -> BlockClass:
    """The class of the equilibrium at the origin.

    Args:
        rates: F(x) with F(0) = 0; other symbols are constants, of the sign that their assumptions say.
        coordinates: x.
    """
    origin = dict.fromkeys(coordinates, sp.Integer(0))
    A = sp.Matrix(list(rates)).jacobian(list(coordinates)).xreplace(origin)
    if A.has(sp.nan, sp.zoo, sp.oo):
        location = eigenvalue_location(sp.zeros(0, 0))
        return BlockClass(
            stability=StabilityClass.UNDECIDED, location=location, evidence={"tried": "no linearisation at the point"}
        )
    A = A.applyfunc(lambda e: e if e.is_Rational else sp.nsimplify(sp.radsimp(e)) if e.is_number else e)
    location = eigenvalue_location(A)
    if location.unstable:
        return BlockClass(stability=StabilityClass.UNSTABLE, location=location, evidence={"by": "eigenvalues"})
    if not location.verdict.holds:
        return BlockClass(
            stability=StabilityClass.UNDECIDED, location=location, evidence=dict(location.verdict.evidence)
        )
    if not location.on_axis:
        return BlockClass(stability=StabilityClass.EXPONENTIAL, location=location, evidence={"by": "eigenvalues"})
    found = attempt(_SECONDS, "critical case", _critical, list(rates), list(coordinates), A, location)
    if found.value is None:
        return BlockClass(stability=StabilityClass.UNDECIDED, location=location, evidence={"tried": found.reason})
    stability, evidence = found.value
    return BlockClass(stability=stability, location=location, evidence=evidence)


_Answer = tuple[StabilityClass, dict[str, Any]]


def _critical(rates: list[sp.Expr], x: list[sp.Symbol], A: sp.MatrixBase, location: RootLocation) -> _Answer:
    """No eigenvalue on the right, some on the axis."""
    if not any(e.free_symbols & set(x) for r in rates for e in [r.diff(z) for z in x]):
        return _linear(A, location)
    if location.zero == 1 and not location.squares:
        found = _single_zero(rates, x, A)
        if found[0] is not StabilityClass.UNDECIDED:
            return found
        return _line_of_equilibria(rates, x, 1) or found
    if location.zero and not location.squares:
        on_line = _line_of_equilibria(rates, x, location.zero)
        if on_line is not None:
            return on_line
    if len(x) == 2 and len(location.squares) == 1:
        reason = center_reason(rates, x)
        if reason is not None:
            return StabilityClass.MARGINAL, {"by": "centre in the plane", "reason": reason}
    oscillators = conservative_oscillators(rates, x)
    if oscillators is not None:
        evidence = {"by": "energy with a strict minimum is conserved", "mass": oscillators.mass}
        return StabilityClass.MARGINAL, evidence | {"stiffness": oscillators.stiffness}
    if not location.zero and len(location.squares) == 1:
        return _single_pair(rates, x, A, location.squares[0])
    if location.zero == 2 and not location.squares:
        return _double_zero(rates, x, A)
    return StabilityClass.UNDECIDED, {"tried": f"{location.on_axis} modes on the imaginary axis are too many"}


def _linear(A: sp.MatrixBase, location: RootLocation) -> _Answer:
    """A linear block is stable if the Jordan blocks of its modes on the axis have size one."""
    squares = list(dict.fromkeys(location.squares))
    wanted = [(A, location.zero)] if location.zero else []
    wanted += [(A**2 + s * sp.eye(A.rows), 2 * location.squares.count(s)) for s in squares]
    for matrix, multiplicity in wanted:
        if matrix.rows - generic_rank(matrix).value < multiplicity:
            return StabilityClass.UNSTABLE, {"by": "linear, with a Jordan block on the imaginary axis"}
    return StabilityClass.MARGINAL, {"by": "linear, modes on the imaginary axis without Jordan blocks"}


def _line_of_equilibria(rates: list[sp.Expr], x: list[sp.Symbol], zero: int) -> _Answer | None:
    """As many dimensions of equilibria as zero eigenvalues: each is stable, none attracts (Aulbach 1984)."""
    point = dict.fromkeys(x, sp.Integer(0))
    if any(r.free_symbols - set(x) for r in rates):
        return None
    graph = graph_near(rates, x, near=point)
    if graph.verdict.holds and len(x) - len(graph.solved) == zero:
        return StabilityClass.MARGINAL, {"by": "a manifold of equilibria through it", "equilibria": dict(graph.solved)}
    return None


def _single_zero(rates: list[sp.Expr], x: list[sp.Symbol], A: sp.MatrixBase) -> _Answer:
    modes = center_modes(A, zero=1, squares=())
    shown: list[ReducedOrder] = []
    for one in reduced_orders(rates, x, modes, _SCALAR_ORDER):
        shown.append(one)
        if is_zero(one.rates[0], test=_QUICK).holds:
            continue
        [s] = modes.coordinates
        coefficient = sp.Poly(one.rates[0], s).LC()
        evidence = {"by": "centre manifold", "reduced": one.rates[0], "direction": modes.center}
        if one.degree % 2 == 0:
            return StabilityClass.UNSTABLE, evidence
        if _number_sign(coefficient) < 0:
            return StabilityClass.ASYMPTOTIC, evidence
        return (StabilityClass.UNSTABLE if _number_sign(coefficient) > 0 else StabilityClass.UNDECIDED), evidence
    return StabilityClass.UNDECIDED, {"tried": f"centre manifold: no term up to degree {_SCALAR_ORDER}"}


def _single_pair(rates: list[sp.Expr], x: list[sp.Symbol], A: sp.MatrixBase, square: sp.Expr) -> _Answer:
    modes = center_modes(A, zero=0, squares=(square,))
    orders: list[ReducedOrder] = []
    for one in reduced_orders(rates, x, modes, _PLANAR_ORDER):
        orders.append(one)
        if one.degree % 2 == 0:
            continue
        found = focal_value(planar_field(orders, modes), modes.coordinates, square, one.degree + 1)
        if found is not None:
            value, function = found
            evidence = {"by": "focal value on the centre manifold", "focal_value": value, "lyapunov": function}
            stable = _number_sign(value)
            if not stable:
                break
            return (StabilityClass.ASYMPTOTIC if stable < 0 else StabilityClass.UNSTABLE), evidence
    return StabilityClass.UNDECIDED, {"tried": f"focal values vanish up to degree {_PLANAR_ORDER}"}


def _double_zero(rates: list[sp.Expr], x: list[sp.Symbol], A: sp.MatrixBase) -> _Answer:
    modes = center_modes(A, zero=2, squares=())
    orders = list(reduced_orders(rates, x, modes, _PLANAR_ORDER - 2))
    field_ = planar_field(orders, modes)
    if all(e == 0 for e in modes.reduced):
        return _flat_origin(orders, modes)
    exact = len(x) == 2 and _in_modes(rates, x, modes)
    full = exact or field_
    drift = drifting_type(exact, modes.coordinates, _PLANAR_ORDER) if exact else None
    if drift is not None:
        stability = StabilityClass.UNSTABLE if drift[0] == "unstable" else StabilityClass.MARGINAL
        return stability, {"by": "a line at rest, and motion along it", **drift[1]}
    kind = nilpotent_type(full, modes.coordinates, _PLANAR_ORDER - 2)
    if kind is None:
        return StabilityClass.UNDECIDED, {"tried": "nilpotent linear part: the leading term was not found"}
    name, evidence = kind
    evidence = {"by": "nilpotent linear part (Andreev)", **evidence}
    if name == "unstable":
        return StabilityClass.UNSTABLE, evidence
    if name == "stable node":
        return StabilityClass.ASYMPTOTIC, evidence
    if exact and reversible(exact, modes.coordinates):
        return StabilityClass.MARGINAL, evidence | {"reason": "trajectories go round, and a reflection reverses time"}
    sign = damping_sign(full, modes.coordinates) if exact else None
    if sign is not None:
        stable = StabilityClass.ASYMPTOTIC if sign < 0 else StabilityClass.UNSTABLE
        return stable, evidence | {"reason": "energy decreases" if sign < 0 else "energy grows"}
    return StabilityClass.UNDECIDED, evidence | {"tried": "a nilpotent focus or centre"}


def _in_modes(rates: list[sp.Expr], x: list[sp.Symbol], modes: CenterModes) -> tuple[sp.Expr, ...]:
    """A planar field in the reduced coordinates, exactly."""
    point = modes.center * sp.Matrix(list(modes.coordinates))
    values = dict(zip(x, point, strict=True))
    moved = modes.center.inv() * sp.Matrix([r.xreplace(values) for r in rates])
    s1, s2 = modes.coordinates
    first, second = (sp.expand(e) for e in moved)
    bend = first - s2
    if bend.has(s2):
        return first, second
    # Liénard's plane: the velocity of s1 as second coordinate.
    lifted = second.xreplace({s2: s2 - bend})
    return s2, sp.expand(lifted + bend.diff(s1) * s2)


def _flat_origin(orders: Sequence[ReducedOrder], modes: CenterModes) -> _Answer:
    """Two zero eigenvalues without a linear part: the leading form times the radius, on all directions."""
    s1, s2 = modes.coordinates
    slope = sp.Dummy("t", real=True)
    for one in orders:
        if all(e == 0 for e in one.rates):
            continue
        radial = sp.expand(s1 * one.rates[0] + s2 * one.rates[1])
        evidence = {"by": "centre manifold", "reduced": one.rates}
        along = sp.Poly(radial.xreplace({s1: sp.Integer(1), s2: slope}), slope)
        across = radial.xreplace({s1: sp.Integer(0), s2: sp.Integer(1)})
        if one.degree % 2 and not along.is_zero and along.count_roots() == 0 and across != 0:
            signs = {_number_sign(along.eval(0)), _number_sign(across)}
            if signs == {-1}:
                return StabilityClass.ASYMPTOTIC, evidence | {"lyapunov": s1**2 + s2**2}
            if signs == {1}:
                return StabilityClass.UNSTABLE, evidence | {"chetaev": s1**2 + s2**2}
        return StabilityClass.UNDECIDED, evidence | {"tried": "the radius as a Lyapunov function"}
    return StabilityClass.UNDECIDED, {"tried": "no leading form was found"}


def _number_sign(number: sp.Expr) -> int:
    """−1 or 1; 0 where it is not known."""
    if number.is_positive:
        return 1
    return -1 if number.is_negative else 0
