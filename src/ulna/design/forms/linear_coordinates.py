"""Linearisation by a change of coordinates alone, without feedback: z' = A z + B u + c.

Nijmeijer and van der Schaft, Nonlinear Dynamical Control Systems, theorem 5.3: for a plant whose fields ad_f^k g_j span
the whole space that is possible exactly if all of these fields commute.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import sympy as sp

from ulna.base import Verdict, all_of
from ulna.geometry import (
    Accessibility,
    Diffeomorphism,
    accessibility,
    bracket_name,
    diffeomorphism,
    exact_potential,
    lie_bracket,
    new_symbols,
    one_form,
)
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.exact import SampledZero, inverse, tidy
from ulna.system import System, equilibrium

_TEST = SampledZero(seconds=0.3)


@dataclass(frozen=True, slots=True, kw_only=True)
class StateLinearisation:
    """Whether a change of coordinates alone makes the plant linear, and which one.

    Attributes:
        system: the plant.
        verdict: refuted with the `bracket` (text) that does not vanish, its components `field`, the `point` and a
            `value` there, or with the rank.
        map: z = T(x), zero at the operating point; None if there is none or the integration did not succeed.
        A: (n, n), B: (n, m), offset: (n, 1): z' = A z + B u + offset; None without a map.
    """

    system: System
    verdict: Verdict
    map: Diffeomorphism | None = None
    A: sp.ImmutableDenseMatrix | None = None
    B: sp.ImmutableDenseMatrix | None = None
    offset: sp.ImmutableDenseMatrix | None = None


def state_linearisation(system: PlantLike) -> StateLinearisation:
    """Whether a plant becomes linear by coordinates alone, and the coordinates where they are found.

    Raises:
        NotAffineError: if the plant is not affine in its inputs.
        UlnaError: if a field is not smooth.

    Examples:
        >>> ulna.state_linearisation("duffing").verdict.status
        <Status.REFUTED: 'refuted'>
    """
    return _state_linearisation(as_plant(system))


@lru_cache(maxsize=32)
def _state_linearisation(system: System) -> StateLinearisation:
    found = accessibility(system)
    verdict = _verdict(system, found)
    if not verdict.holds:
        return StateLinearisation(system=system, verdict=verdict)
    forward = found.view.x if _is_linear(found) else None if found.cut_short else _coordinates(found)
    return _described(found, verdict, forward)


def _verdict(system: System, found: Accessibility) -> Verdict:
    claim = f"'{system.name}' becomes linear by a change of coordinates alone"
    if _is_linear(found):
        return Verdict.proved(claim, reason="it is linear as it stands")
    if not found.controllable.holds:
        return found.controllable.restated(claim)
    parts = [found.controllable]
    for name, first, second in _pairs(found):
        part = _commute(first, second, found.view.x)
        if part.fails:
            return Verdict.refuted(claim, **{"bracket": name, **part.evidence})
        parts.append(part)
    if found.cut_short:
        missing = Verdict.undecided("the missing brackets commute", tried=found.cut_short)
        parts.append(found.numbers.commuting if found.numbers is not None else missing)
    if found.numbers is not None and found.numbers.commuting.fails:
        return found.numbers.commuting.restated(claim, road="numeric")
    return all_of(claim, parts)


def _pairs(found: Accessibility) -> Iterator[tuple[str, sp.ImmutableDenseMatrix, sp.ImmutableDenseMatrix]]:
    """All pairs of fields ad_f^k g_j up to one level above the one where they span everything, by total order.

    That last level is made only when it is needed: its expressions are large.
    """
    view = found.view
    levels = [list(level) for level in found.levels]
    top, inputs = len(levels), len(view.u)
    for total in range(2 * top + 1):
        for i in range(total // 2 + 1):
            k = total - i
            if k > top or (k == top and found.cut_short):
                continue
            if k == len(levels):
                levels.append([lie_bracket(view.f, field, view.x) for field in levels[-1]])
            for a, first in enumerate(levels[i]):
                for b in range(a + 1 if i == k else 0, inputs):
                    name = f"[{bracket_name(i, a, inputs)}, {bracket_name(k, b, inputs)}]"
                    yield name, first, levels[k][b]


def _commute(first: sp.MatrixBase, second: sp.MatrixBase, x: tuple[sp.Symbol, ...]) -> Verdict:
    bracket = lie_bracket(first, second, x)
    parts = []
    for entry in bracket:
        part = _TEST(entry)
        if part.fails:
            return Verdict.refuted("the fields commute", field=bracket, **part.evidence)
        parts.append(part)
    return all_of("the fields commute", parts)


def _is_linear(found: Accessibility) -> bool:
    """f affine and g constant in x."""
    x = found.view.x
    slopes = [*found.view.f.jacobian(list(x)), *found.view.g]
    return all(_TEST(entry.diff(s)).holds for entry in slopes for s in x if s in entry.free_symbols)


def _coordinates(found: Accessibility) -> tuple[sp.Expr, ...] | None:
    """T with (∂T/∂x) ad_f^k g_j = the unit vectors: the rows of the inverse of a basis are closed; integrate them."""
    x = found.view.x
    basis = sp.ImmutableDenseMatrix.hstack(*found.distribution(len(found.levels) - 1).fields)
    rows = inverse(basis).solution
    if rows is None:
        return None
    functions: list[sp.Expr] = []
    for i in range(len(x)):
        potential = exact_potential(one_form(rows[i, :], x), near=found.point)
        if potential.value is None:
            return None
        functions.append(tidy(potential.value, seconds=0.3))
    return tuple(functions)


def _described(found: Accessibility, verdict: Verdict, forward: tuple[sp.Expr, ...] | None) -> StateLinearisation:
    view, system = found.view, found.view.system
    if forward is None:
        return StateLinearisation(system=system, verdict=verdict)
    point = {**equilibrium(system).states, **system.values}
    taken = (*view.x, *view.u, *system.parameter_symbols)
    z = new_symbols("z", len(view.x), taken)
    column = sp.ImmutableDenseMatrix(len(forward), 1, list(forward))
    jacobian = column.jacobian(list(view.x))
    change = diffeomorphism(column, view.x, z, near=point, singular=tidy(jacobian.det(method="berkowitz")))
    # d(L_f T) = A dT with constant A: solve at one regular point instead of simplifying functions to constants.
    drift = jacobian * view.f
    inverted = inverse(sp.ImmutableDenseMatrix(jacobian)).solution
    if inverted is None:
        return StateLinearisation(system=system, verdict=verdict, map=change)
    A = (drift.jacobian(list(view.x)) * inverted).applyfunc(tidy)
    B = (jacobian * view.g).applyfunc(tidy)
    offset = (drift - A * column).applyfunc(tidy)
    if any(e.free_symbols & set(view.x) for e in (*A, *B, *offset)):
        return StateLinearisation(system=system, verdict=verdict, map=change)
    A, B, offset = (sp.ImmutableDenseMatrix(matrix) for matrix in (A, B, offset))
    return StateLinearisation(system=system, verdict=verdict, map=change, A=A, B=B, offset=offset)
