"""Checks that expressions invert a map on the branch through a base point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import sympy as sp

from ulna.base import Status, Verdict, all_of
from ulna.symbolic.exact.ball import leaves_of
from ulna.symbolic.exact.zero import SampledZero, are_zero
from ulna.symbolic.solving.isolate import Base

_RADIUS = sp.Rational(1, 200)
"""Half width of the neighbourhood in which a candidate must be the inverse."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InversionTask:
    """The map, its variables, and the base point with a number for every symbol."""

    forward: tuple[sp.Expr, ...]
    old: tuple[sp.Symbol, ...]
    new: tuple[sp.Symbol, ...]
    base: Base
    seconds: float


def verified(
    task: InversionTask,
    start: dict[sp.Symbol, sp.Expr],
    expressions: tuple[sp.Expr, ...],
    claim: str,
    evidence: dict[str, object],
) -> Verdict:
    """Both compositions are the identity near the base point.

    T(S(z)) = z by exact algebra, S(T(x0)) = x0 exactly and a regular Jacobian at x0 prove that S is the local
    inverse (inverse function theorem); S(T(x)) = x at points near x0 is tested besides.
    """
    if any(one.has(*task.old) for one in expressions):
        return Verdict.refuted(claim, found="old coordinates are left in the result")
    near_old = comes_back(task, start, expressions)
    if not near_old.holds:
        return near_old
    pinned = near_old.evidence.get("parameters") or {}
    verdict = _identity(task, start, expressions, claim, near_old, evidence, pinned)
    values = _parameters_in(task, expressions)
    if not verdict.fails or pinned or not values:
        return verdict
    # S(T(x)) = x held by luck of the parameters drawn; the other composition holds near the given ones perhaps.
    near_old = _comes_back_at(task, start, expressions, values)
    return _identity(task, start, expressions, claim, near_old, evidence, values) if near_old.holds else near_old


def _identity(
    task: InversionTask,
    start: dict[sp.Symbol, sp.Expr],
    expressions: tuple[sp.Expr, ...],
    claim: str,
    near_old: Verdict,
    evidence: dict[str, object],
    pinned: Mapping[sp.Basic, sp.Expr],
) -> Verdict:
    """T(S(z)) = z besides S(T(x)) = x, parameters near the `pinned` values where there are any."""
    back = dict(zip(task.old, expressions, strict=True))
    image: dict[Any, sp.Expr] = {z: one.xreplace(start) for z, one in zip(task.new, task.forward, strict=True)}
    if pinned:
        values = dict(pinned)
        start = {x: value.xreplace(values) for x, value in start.items()}
        image = {z: one.xreplace(values) for z, one in image.items()} | values
        evidence = {**evidence, "parameters": values}
    right = [task.forward[k].xreplace(back) - z for k, z in enumerate(task.new)]
    near_new = are_zero(right, test=SampledZero(points=4, near=image, radius=_RADIUS, seconds=0.5))
    if near_new.status is Status.PROVED and _fixes(expressions, image, start):
        return Verdict.proved(claim, **evidence)
    return all_of(claim, [near_new, near_old], **evidence)


def comes_back(task: InversionTask, start: dict[sp.Symbol, sp.Expr], expressions: tuple[sp.Expr, ...]) -> Verdict:
    """S(T(x)) = x at points near x0, for any parameters or at least near those of the base point.

    The branch of a root may depend on the signs of parameters: then the evidence names the `parameters`.
    """
    there = dict(zip(task.new, task.forward, strict=True))
    left = [one.xreplace(there) - x for one, x in zip(expressions, task.old, strict=True)]
    anywhere = are_zero(left, test=SampledZero(points=4, near=start, radius=_RADIUS, seconds=0))
    parameters = _parameters_in(task, left)
    return anywhere if anywhere.holds or not parameters else _comes_back_at(task, start, expressions, parameters)


def _comes_back_at(
    task: InversionTask,
    start: dict[sp.Symbol, sp.Expr],
    expressions: tuple[sp.Expr, ...],
    parameters: Mapping[sp.Basic, sp.Expr],
) -> Verdict:
    """S(T(x)) = x near x0 and near these parameters, which the evidence names."""
    there = dict(zip(task.new, task.forward, strict=True))
    left = [one.xreplace(there) - x for one, x in zip(expressions, task.old, strict=True)]
    base = {x: value.xreplace(dict(parameters)) for x, value in start.items()}
    radius = _RADIUS * _smallest(parameters)
    found = are_zero(left, test=SampledZero(points=4, near={**base, **parameters}, radius=radius, seconds=0))
    return replace(found, evidence={**found.evidence, "parameters": dict(parameters)})


def _parameters_in(task: InversionTask, expressions: Sequence[sp.Expr]) -> dict[sp.Basic, sp.Expr]:
    """The values at the base point of what is neither an old nor a new coordinate."""
    own = {*task.old, *task.new}
    return {leaf: task.base[leaf] for leaf in leaves_of(expressions) if leaf not in own}


def _smallest(values: Mapping[sp.Basic, sp.Expr]) -> sp.Expr:
    """The least modulus of the values that are not zero, at most one."""
    return min((sp.S.One, *(abs(value) for value in values.values() if value != 0)), key=float)


def _fixes(
    expressions: tuple[sp.Expr, ...], image: Mapping[sp.Symbol, sp.Expr], start: Mapping[sp.Symbol, sp.Expr]
) -> bool:
    """True only if the inverse takes the image of the base point exactly back to it."""
    differences = [one.xreplace(dict(image)) - x for one, x in zip(expressions, start.values(), strict=True)]
    if any(one.has(sp.nan, sp.zoo, sp.oo) for one in differences):
        return False
    return bool(differences) and are_zero(differences).status is Status.PROVED
