"""Observability by some input: Lie derivatives of the outputs along the drift and all input fields.

R. Hermann and A. J. Krener, "Nonlinear controllability and observability", IEEE TAC 22 (1977): near a point where the
differentials of these functions have rank n, some input tells any two states apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations, islice

import sympy as sp
from sympy import Expr

from ulna.base import Verdict
from ulna.geometry.lie import lie_derivative
from ulna.geometry.observation import differentials, extends, full_rank
from ulna.geometry.smoothness import require_smooth
from ulna.symbolic.exact import Rank, attempt, generic_rank, is_zero, rank_at
from ulna.symbolic.formulas import formula
from ulna.system import ControlAffine, System, control_affine, equilibrium

_SECONDS = 2.0
_MINORS = 6
_MOST = 40
"""Functions looked at where a point is singular."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservationSpace:
    """Functions whose differentials span the smallest codistribution with dh that is invariant under f and all g_j.

    Attributes:
        view: the control-affine view.
        functions: independent functions, outputs first, then iterated Lie derivatives of low order.
        rank: generic rank of their differentials (the dimension of the observable part).
        at_point: the rank at the operating point of the functions and of further Lie derivatives.
        observable: on "some input tells almost any two near states apart". Where the drift alone does not,
            `observable_while` says for which constant inputs it is so, as text, or that they must change.
        observable_at_point: the same near the operating point.
    """

    view: ControlAffine
    functions: tuple[Expr, ...]
    rank: Rank
    at_point: Rank
    observable: Verdict
    observable_at_point: Verdict


@lru_cache(maxsize=64)
def observation_space(system: System) -> ObservationSpace:
    """The observable functions with inputs included; stops when a level of Lie derivatives adds no dimension.

    Raises:
        UlnaError: for terms without derivatives (abs, sign, …); NotAffineError if the inputs do not enter linearly.
    """
    view = control_affine(system)
    require_smooth([*view.f, *view.g, *view.h], f"observability of '{system.name}'")
    kept = _independent(view, (view.f, *view.input_fields))
    matrix = differentials(tuple(kept), view.x)
    rank, here = generic_rank(matrix), equilibrium(system)
    by_drift = _drift_suffices(view, rank)
    local = _at_point(view, kept, rank)
    motion = {} if by_drift else _motion(view, rank.value)
    return ObservationSpace(
        view=view,
        functions=tuple(kept),
        rank=rank,
        at_point=local,
        observable=full_rank(
            rank, view, "by some input" if not by_drift else "almost everywhere", **_told(rank, view, motion)
        ),
        observable_at_point=full_rank(local, view, here.phrase, **_told(local, view, motion)),
    )


def _drift_suffices(view: ControlAffine, rank: Rank) -> bool:
    """Whether the drift alone shows as much; without inputs it does."""
    return not view.u or len(_independent(view, [view.f])) >= rank.value


def _independent(view: ControlAffine, fields: Sequence[sp.MatrixBase]) -> list[Expr]:
    """Functions with independent differentials: the outputs and their Lie derivatives along the fields."""
    kept, newest = list[Expr](), list(view.h)
    while newest and len(kept) < len(view.x):
        added = list[Expr]()
        for function in newest:
            if len(kept) < len(view.x) and extends(kept, function, view.x):
                kept.append(function)
                added.append(function)
        newest = [lie_derivative(h, field, view.x) for field in fields for h in added]
    return kept


def _at_point(view: ControlAffine, kept: Sequence[Expr], rank: Rank) -> Rank:
    """The rank there; where the functions kept do not suffice, of all Lie derivatives of low order besides."""
    here = equilibrium(view.system).where
    local = rank_at(differentials(tuple(kept), view.x), here)
    if local.value >= rank.value:
        return local

    def further() -> Rank:
        functions = newest = list(view.h)
        for _ in range(len(view.x) - 1):
            newest = [lie_derivative(h, field, view.x) for field in (view.f, *view.input_fields) for h in newest]
            newest = [h for h in newest if h.free_symbols & set(view.x)]
            functions = [*functions, *newest][:_MOST]
            if len(functions) == _MOST or not newest:
                break
        return rank_at(differentials(tuple(functions), view.x), here)

    more = attempt(_SECONDS, "rank", further).value
    return more if more is not None and more.verdict.holds and more.value > local.value else local


def _motion(view: ControlAffine, rank: int) -> dict[str, str]:
    """For which constant inputs the outputs alone show as much: the factor of all minors that must not vanish."""

    def found() -> dict[str, str]:
        moving = sp.ImmutableDenseMatrix(view.f + view.g * sp.Matrix(view.u))
        functions = _independent(view, [moving])
        if len(functions) < rank:
            return {"observable_while": "the inputs change"}
        matrix = differentials(tuple(functions), view.x)
        common: set[Expr] | None = None
        for rows in islice(combinations(range(matrix.rows), rank), _MINORS):
            for columns in islice(combinations(range(matrix.cols), rank), _MINORS):
                minor = matrix.extract(list(rows), list(columns)).det()
                if not is_zero(minor).holds:
                    factors = _input_factors(minor, view)
                    common = factors if common is None else common & factors
        needed = sorted(f"{formula(base)} != 0" for base in common or ())
        return {"observable_while": " and ".join(needed) or "an input acts"}

    return attempt(_SECONDS, "motion", found).value or {"observable_while": "the plant is moved by some input"}


def _input_factors(minor: Expr, view: ControlAffine) -> set[Expr]:
    """The factors of a numerator that depend on inputs."""
    numerator = sp.factor(sp.numer(sp.together(minor)))
    bases = [factor.as_base_exp()[0] for factor in sp.Mul.make_args(numerator)]
    return {base for base in bases if base.has(*view.u)}


def _told(rank: Rank, view: ControlAffine, motion: dict[str, str]) -> dict[str, str]:
    """The motion that observing needs, where there is observing."""
    return motion if rank.value == len(view.x) else {}
