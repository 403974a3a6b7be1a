"""Decompositions: coordinates that split off what inputs cannot reach, or what outputs cannot see.

Isidori, Nonlinear Control Systems, 3rd ed., sections 1.6-1.7, the nonlinear counterpart of Kalman's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations

import sympy as sp

from ulna.base import Verdict, all_of
from ulna.geometry.coordinates import Diffeomorphism, diffeomorphism, new_symbols
from ulna.geometry.distributions import Distribution, distribution
from ulna.geometry.leaves import first_integrals
from ulna.geometry.lie import lie_bracket, lie_derivative
from ulna.geometry.observables import observation_space
from ulna.geometry.observation import differentials
from ulna.geometry.smoothness import require_smooth
from ulna.symbolic.exact import SampledZero, attempt, generic_rank, is_zero, tidy
from ulna.system import ControlAffine, System, control_affine, equilibrium

_TEST = SampledZero(seconds=0.4)
_SECONDS = 6.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Decomposition:
    """New coordinates ζ = (ζ₁, ζ₂) in which a plant falls into two parts.

    Attributes:
        view: the plant.
        dimension: of the accessible or observable part ζ₁, generically.
        map: ζ = T(x), the first `dimension` entries ζ₁; None where the functions were not found.
        verdict: on the block structure: ζ₂' free of u and ζ₁ (accessible part first), or ζ₁' and the outputs free of
            ζ₂ (observable part first).
    """

    view: ControlAffine
    dimension: int
    map: Diffeomorphism | None
    verdict: Verdict

    @property
    def system(self) -> System:
        """The plant."""
        return self.view.system

    @property
    def complete(self) -> bool:
        """True if there is nothing to split off."""
        return self.dimension == len(self.view.x)


@lru_cache(maxsize=64)
def accessible_decomposition(system: System) -> Decomposition:
    """Coordinates with the part that no input moves last: ζ₂' = φ(ζ₂), n − d first integrals of the accessible span.

    The span is the smallest distribution with all g_j that is invariant under f and the g_j; d is its dimension.

    Examples:
        >>> ulna.accessible_decomposition(ulna.model("duffing")).complete
        True
    """
    view = control_affine(system)
    claim = f"'{system.name}' splits into a part that the inputs move and a part that they do not"
    span = accessible_span(view)
    d = len(span.fields)
    if d == len(view.x):
        whole = _change(view, list(view.x))
        return Decomposition(view=view, dimension=d, map=whole, verdict=Verdict.proved(claim, reason="no second part"))
    if d == 0:
        whole = _change(view, list(view.x))
        return Decomposition(view=view, dimension=0, map=whole, verdict=Verdict.proved(claim, reason="no inputs act"))
    point = equilibrium(system).states
    found = first_integrals(span, near=point)
    if found.functions is None:
        verdict = Verdict.undecided(claim, **{**found.verdict.evidence, "because": found.verdict.claim})
        return Decomposition(view=view, dimension=d, map=None, verdict=verdict)
    fixed = list(found.functions)
    verdict = accessible_structure(view, fixed)
    return Decomposition(view=view, dimension=d, map=_change(view, _complement(view, fixed) + fixed), verdict=verdict)


@lru_cache(maxsize=64)
def observable_decomposition(system: System) -> Decomposition:
    """Coordinates with the part that no output sees last: ζ₁' = φ(ζ₁, u), y = ψ(ζ₁).

    ζ₁ are functions of the observation space itself (states where their differentials lie in it), so nothing has to
    be integrated.

    Examples:
        >>> ulna.observable_decomposition(ulna.model("duffing")).complete
        True
    """
    view = control_affine(system)
    claim = f"'{system.name}' splits into a part that the outputs see and a part that they do not"
    seen = observation_space(system)
    if seen.rank.value == len(view.x):
        whole = _change(view, list(view.x))
        verdict = Verdict.proved(claim, reason="no second part")
        return Decomposition(view=view, dimension=len(view.x), map=whole, verdict=verdict)
    kept: list[sp.Expr] = []
    for candidate in (*view.x, *(tidy(h, seconds=0.3) for h in seen.functions)):
        inside = generic_rank(differentials((*seen.functions, candidate), view.x), seconds=0).value <= seen.rank.value
        if inside and generic_rank(differentials((*kept, candidate), view.x), seconds=0).value > len(kept):
            kept.append(candidate)
    verdict = observable_structure(view, kept)
    change = _change(view, kept + _complement(view, kept))
    return Decomposition(view=view, dimension=len(kept), map=change, verdict=verdict)


def accessible_span(view: ControlAffine) -> Distribution:
    """The smallest distribution that contains all g_j and is invariant under f and the g_j, as a generic basis."""
    kept: list[sp.ImmutableDenseMatrix] = []
    newest = list(view.input_fields)
    while newest and len(kept) < len(view.x):
        added = []
        for field in newest:
            if len(kept) < len(view.x) and generic_rank(sp.Matrix.hstack(*kept, field), seconds=0).value > len(kept):
                kept.append(sp.ImmutableDenseMatrix(field))
                added.append(field)
        newest = [lie_bracket(mover, field, view.x) for field in added for mover in (view.f, *view.input_fields)]
    return distribution(kept, view.x)


def accessible(system: System) -> tuple[Verdict, int]:
    """Whether inputs reach an open set of states from almost every one, and the dimension of what they move.

    The rank condition on brackets of the inputs' fields with the drift *and with each other* (strong accessibility:
    Sussmann and Jurdjevic, J. Differential Equations 12 (1972)); weaker than the conditions of linearisation.
    """
    view = control_affine(system)
    require_smooth([*view.f, *view.g], f"accessibility of '{system.name}'")
    span, n = accessible_span(view), len(view.x)
    claim = f"'{system.name}' is accessible: brackets of its fields have rank {n}"
    dimension = len(span.fields)
    if dimension == n:
        return Verdict.proved(claim, rank=n), n
    return Verdict.refuted(claim, rank=dimension), dimension


def accessible_structure(view: ControlAffine, fixed: Sequence[sp.Expr]) -> Verdict:
    """Whether L_g η = 0 and L_f η is a function of the η alone; refuted with the function that is not."""
    claim = f"what is split off from '{view.system.name}' moves by itself"
    parts = []
    for function in fixed:
        for signal, column in zip(view.system.inputs, view.input_fields, strict=True):
            slope = lie_derivative(function, column, view.x)
            part = is_zero(slope, test=_TEST)
            if part.fails:
                return Verdict.refuted(claim, **{**part.evidence, "input": signal.name, "function": function})
            parts.append(part)
        parts.append(_within(view, fixed, lie_derivative(function, view.f, view.x)))
        if parts[-1].fails:
            return all_of(claim, parts)
    return all_of(claim, parts)


def observable_structure(view: ControlAffine, seen: Sequence[sp.Expr]) -> Verdict:
    """Whether outputs and Lie derivatives of the ζ₁ are functions of the ζ₁ alone; refuted with one that is not."""
    claim = f"the outputs of '{view.system.name}' see these coordinates only"
    functions = list(view.h)
    for function in seen:
        functions += [lie_derivative(function, field, view.x) for field in (view.f, *view.input_fields)]
    parts = []
    for function in functions:
        parts.append(_within(view, seen, function))
        if parts[-1].fails:
            break
    return all_of(claim, parts)


def _within(view: ControlAffine, coordinates: Sequence[sp.Expr], function: sp.Expr) -> Verdict:
    """Whether d(function) lies in the span of the independent d(coordinates)."""
    claim = "the function depends on the given ones alone"
    rank = generic_rank(differentials((*coordinates, function), view.x), seconds=0.5)
    if rank.value > len(coordinates):
        return Verdict.refuted(claim, function=function, point=rank.point)
    return all_of(claim, [rank.verdict])


def _complement(view: ControlAffine, functions: Sequence[sp.Expr]) -> list[sp.Expr]:
    """States that complete the functions to coordinates, regular at the operating point if possible."""
    n = len(view.x)
    point = equilibrium(view.system).states
    missing = n - len(functions)
    fallback: list[sp.Expr] = []
    for chosen in combinations(view.x, missing):
        matrix = differentials((*functions, *chosen), view.x)
        if generic_rank(matrix, seconds=0).value < n:
            continue
        fallback = fallback or list(chosen)
        local = matrix.subs(dict(point))
        if not local.has(sp.nan, sp.zoo, sp.oo) and generic_rank(local, seconds=0).value == n:
            return list(chosen)
    return fallback


def _change(view: ControlAffine, functions: Sequence[sp.Expr]) -> Diffeomorphism:
    """The change of coordinates with these functions as new ones."""
    forward = sp.ImmutableDenseMatrix(len(functions), 1, list(functions))
    taken = (*view.x, *view.u, *view.system.parameter_symbols)
    jacobian = sp.Matrix(forward.jacobian(list(view.x)))
    singular = attempt(_SECONDS, "determinant", jacobian.det, method="berkowitz").value
    return diffeomorphism(
        forward,
        view.x,
        new_symbols("zeta", len(functions), taken),
        near=equilibrium(view.system).states,
        singular=sp.nan if singular is None else tidy(singular, seconds=0.3),
    )
