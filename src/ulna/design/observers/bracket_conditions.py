"""When a single-output plant has an observer form: the brackets of the starting field (Krener and Isidori 1983)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations

import sympy as sp

from ulna.base import Status, Verdict, all_of
from ulna.design.observers.refutation_at_points import refutation_at_a_point
from ulna.geometry import Observability, lie_bracket, observability
from ulna.symbolic.exact import SampledZero, attempt, inverse_last_column, is_zero, lowest_terms
from ulna.system import ControlAffine, System

_TEST = SampledZero(seconds=0.4)
_SECONDS = 4.0
_LARGE = 60
"""Operations in Q above which one point is looked at before brackets are written down."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ObserverConditions:
    """The three conditions for z' = A z + γ(y, u), y = z_n, of a single-output plant.

    Attributes:
        observability: the matrix Q of rows L_f^k dh.
        fields: (ad_f^0 τ, …, ad_f^{n−1} τ) with Q τ = e_n, in the bracket of the paper's eq. 19; empty without rank,
            shorter where a bracket fails early.
        commuting: on [ad_f^i τ, ad_f^j τ] = 0 for i, j < n: the drift is linear up to a function of y.
        inputs: on [g_j, ad_f^k τ] = 0 for k ≤ n − 2: the input's coefficients are functions of y.
        exists: all of them.
    """

    observability: Observability
    fields: tuple[sp.ImmutableDenseMatrix, ...]
    commuting: Verdict
    inputs: Verdict
    exists: Verdict

    @property
    def system(self) -> System:
        """The plant."""
        return self.observability.system

    @property
    def starting_field(self) -> sp.ImmutableDenseMatrix | None:
        """τ = ∂x/∂z₁ (paper eq. 43-45)."""
        return self.fields[0] if self.fields else None


@lru_cache(maxsize=64)
def observer_conditions(system: System) -> ObserverConditions:
    """The conditions with the bracket, and the point, that breaks one."""
    seen = observability(system)
    view = seen.view
    claim = f"'{system.name}' has an observer form z' = A z + γ(y, u)"
    if not seen.observable.holds:
        return _without_fields(seen, claim, seen.observable)
    # Four states make the first bracket long even where Q is short (ball and beam).
    large = len(view.x) > 3 or (len(view.x) > 1 and sum(e.count_ops() for e in seen.matrix) > _LARGE)
    quick = Verdict.undecided("a slope at a point", tried="not yet")
    if large:
        quick = refutation_at_a_point(seen)
        if quick.fails and quick.evidence["any_psi"]:
            return _without_fields(seen, claim, quick)
    found = inverse_last_column(sp.Matrix(seen.matrix))
    if found.solution is None:
        why = Verdict.undecided("the starting field is known", tried="Q τ = e_n")
        return _without_fields(seen, claim, quick if large and quick.fails else why)
    started = sp.ImmutableDenseMatrix(found.solution)
    result = attempt(_SECONDS, "brackets of the starting field", chain_of_fields, view, started)
    if result.value is None:
        undecided = Verdict.undecided("brackets of the starting field", tried=result.reason)
        quick = refutation_at_a_point(seen) if not large and len(view.x) > 1 else quick
        fields, commuting, inputs = (started,), quick if quick.fails else undecided, undecided
    else:
        fields, commuting, inputs = result.value
    return ObserverConditions(
        observability=seen,
        fields=fields,
        commuting=commuting,
        inputs=inputs,
        exists=all_of(claim, [commuting, inputs]),
    )


def chain_of_fields(
    view: ControlAffine, start: sp.ImmutableDenseMatrix
) -> tuple[tuple[sp.ImmutableDenseMatrix, ...], Verdict, Verdict]:
    """(start, ad_f start, …, ad_f^{n−1} start), grown only as long as all brackets vanish, `commuting` and `inputs`."""
    n = len(view.x)
    fields = (start,)
    commuting = commuting_fields(view, fields)
    while len(fields) < n and commuting.holds:
        fields = (*fields, lie_bracket(view.f, fields[-1], view.x).applyfunc(lowest_terms))
        newest = commuting_fields(view, fields, since=len(fields) - 1)
        commuting = all_of(newest.claim, [commuting, newest])
    return fields, commuting, input_condition(view, fields[: n - 1])


def commuting_fields(view: ControlAffine, fields: tuple[sp.ImmutableDenseMatrix, ...], *, since: int = 1) -> Verdict:
    """Whether [ad_f^i τ, ad_f^j τ] = 0 for i < j, j ≥ since; refuted with `i`, `j`, the `bracket` and a `point`."""
    claim = "[ad_f^i τ, ad_f^j τ] = 0 for all i, j < n"
    parts = []
    for i, j in sorted((p for p in combinations(range(len(fields)), 2) if p[1] >= since), key=sum):
        bracket = lie_bracket(fields[i], fields[j], view.x)
        verdict = vanishes(bracket)
        if verdict.fails:
            return Verdict.refuted(claim, **{**verdict.evidence, "i": i, "j": j, "bracket": bracket})
        parts.append(verdict)
    return all_of(claim, parts)


def input_condition(view: ControlAffine, fields: tuple[sp.ImmutableDenseMatrix, ...]) -> Verdict:
    """Whether [g_j, ad_f^k τ] = 0 for the given fields; refuted with the `input`, `k`, the `bracket` and a `point`."""
    claim = "[g, ad_f^k τ] = 0 for k ≤ n − 2: γ depends on x through y alone"
    parts = []
    for signal, column in zip(view.system.inputs, view.input_fields, strict=True):
        for k, field in enumerate(fields):
            bracket = lie_bracket(column, field, view.x)
            verdict = vanishes(bracket)
            if verdict.fails:
                evidence = {**verdict.evidence, "input": signal.name, "k": k, "bracket": bracket}
                return Verdict.refuted(claim, **evidence)
            parts.append(verdict)
    return all_of(claim, parts)


def vanishes(field: sp.MatrixBase) -> Verdict:
    """Whether a field is identically zero."""
    parts = []
    for entry in field:
        part = is_zero(entry, test=_TEST)
        if part.fails:
            return part
        parts.append(part)
    return all_of("the field vanishes", parts)


def _without_fields(seen: Observability, claim: str, why: Verdict) -> ObserverConditions:
    status = Status.REFUTED if why.fails else Status.UNDECIDED
    missing = Verdict.undecided("brackets of the starting field", tried="there is no starting field")
    exists = Verdict(claim=claim, status=status, evidence={**why.evidence, "because": why.claim})
    return ObserverConditions(observability=seen, fields=(), commuting=missing, inputs=missing, exists=exists)
