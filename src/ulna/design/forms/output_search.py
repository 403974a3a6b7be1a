"""Linearising outputs: functions h_1 … h_m whose relative degrees add up to n, found without a given output.

A function with controllability index k has dh ⊥ G_{k−2}. The search goes down the indices: at each of them the
annihilator of G_{k−2} is spanned by what is known already (dh, dL_f h, …) and by as many new differentials as there
are indices k (Isidori, Nonlinear Control Systems, proof of theorem 5.2.3). Given outputs and states are tried first,
then the distribution is integrated.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache

import sympy as sp

from ulna.base import Verdict
from ulna.design.forms.linearisability_conditions import Linearisability, linearisability, linearises
from ulna.geometry import (
    Accessibility,
    Distribution,
    RelativeDegree,
    closed,
    filtration,
    first_integrals,
    integrate,
    lie_derivative,
    one_form,
    relative_degree,
    relative_degree_of,
)
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.exact import (
    SampledZero,
    attempt,
    generic_rank,
    inverse_last_row,
    null_space,
    rank_at,
    tidy,
    value_at,
)
from ulna.symbolic.solving import defined_near
from ulna.system import System, equilibrium, equilibrium_in_numbers

_SECONDS = 4.0
_FILTER = SampledZero(points=4, seconds=0)


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearisingOutputs:
    """Functions of the state that make the plant a set of chains of integrators.

    Attributes:
        linearisability: the conditions.
        functions: (m,) by falling controllability index, or in the plant's order if all are outputs of it; None where
            there are none or none were found.
        origins: (m,) where each comes from: `output y`, `state x1`, `integration`.
        relative_degree: the functions' relative degrees; None without functions.
        verdict: refuted if the plant is not linearisable, undecided if the search found nothing, else how sure it is
            that the relative degrees add up to n and the decoupling matrix is generically invertible.
    """

    linearisability: Linearisability
    functions: tuple[sp.Expr, ...] | None
    origins: tuple[str, ...]
    relative_degree: RelativeDegree | None
    verdict: Verdict


def linearising_outputs(system: PlantLike) -> LinearisingOutputs:
    """Outputs for which the plant is exactly linearisable by feedback.

    Raises:
        NotAffineError: if the plant is not affine in its inputs.
        UlnaError: if a field is not smooth.
    """
    return _linearising_outputs(as_plant(system))


@lru_cache(maxsize=32)
def _linearising_outputs(system: System) -> LinearisingOutputs:
    conditions = linearisability(system)
    claim = f"'{system.name}' has linearising outputs"
    if not conditions.verdict.holds:
        return _none(conditions, conditions.verdict.restated(claim))
    if conditions.accessibility.ranks[0].value < len(conditions.accessibility.view.u):
        reason = "the input fields are dependent: some inputs are redundant"
        return _none(conditions, Verdict.refuted(claim, reason=reason, rank=conditions.accessibility.ranks[0].value))
    regular = conditions.at_point.holds
    given = _given(conditions, regular)
    if given is not None:
        return given
    search = _Search(found=conditions.accessibility, regular=regular)
    chosen = search.run(conditions.indices)
    if chosen is None:
        tried = "given outputs, states, integration of the G_i"
        evidence = {"reason": "out of time: --seconds or ULNA_PATIENCE gives more"} if search.given_up else {}
        return _none(conditions, Verdict.undecided(claim, tried=tried, **evidence))
    chosen = _in_given_order(chosen, conditions.accessibility)
    functions = tuple(function for function, _ in chosen)
    relative = relative_degree_of(functions, conditions.accessibility.view)
    return LinearisingOutputs(
        linearisability=conditions,
        functions=functions,
        origins=tuple(origin for _, origin in chosen),
        relative_degree=relative,
        verdict=replace(linearises(relative), claim=claim),
    )


def _given(conditions: Linearisability, regular: bool) -> LinearisingOutputs | None:
    """The plant's own outputs where they linearise it, at the operating point as well if anything does."""
    view = conditions.accessibility.view
    if len(view.h) != len(view.u):
        return None
    relative = relative_degree(view.system)
    verdict = linearises(relative)
    if not verdict.holds or (regular and not relative.at_point.holds):
        return None
    return LinearisingOutputs(
        linearisability=conditions,
        functions=relative.outputs,
        origins=tuple(f"output {o.name}" for o in view.system.outputs),
        relative_degree=relative,
        verdict=replace(verdict, claim=f"'{view.system.name}' has linearising outputs"),
    )


def _in_given_order(chosen: list[tuple[sp.Expr, str]], found: Accessibility) -> list[tuple[sp.Expr, str]]:
    given = [f"output {o.name}" for o in found.view.system.outputs]
    if all(origin in given for _, origin in chosen):
        return sorted(chosen, key=lambda one: given.index(one[1]))
    return chosen


@dataclass(frozen=True, slots=True, kw_only=True)
class LastRow:
    """The last row q of the inverse controllability matrix of a plant with one input (the paper's section 3).

    Attributes:
        row: (1, n) q; None if G_{n−2} is not involutive (then no multiple of q is closed) or it was not found in time.
        closed: whether dq = 0, so that T₁ = ∫q.
        factor: μ with μ q = dT₁ for the linearising output T₁ that was found; None without one.
    """

    row: sp.ImmutableDenseMatrix | None
    closed: Verdict
    factor: sp.Expr | None


def last_row(found: LinearisingOutputs) -> LastRow | None:
    """q, whether it is closed, and its integrating factor; None where there is not one input or rank n.

    With the paper's bracket μ = L_{ad_f^{n−1} g} T₁ = L_g L_f^{n−1} T₁, the decoupling term itself.
    """
    access = found.linearisability.accessibility
    view = access.view
    if len(view.u) != 1 or access.rank < len(view.x):
        return None
    claim = "the last row q is closed"
    if found.linearisability.involutive.fails:
        return LastRow(row=None, closed=found.linearisability.involutive.restated(claim), factor=None)
    factor = None
    if found.functions is not None and found.relative_degree is not None:
        factor = found.relative_degree.decoupling[0, 0]
        entries = [tidy(found.functions[0].diff(x) / factor, seconds=0.3) for x in view.x]
        row: sp.ImmutableDenseMatrix | None = sp.ImmutableDenseMatrix([entries])
    else:
        solution = None if access.cut_short else inverse_last_row(access.matrix).solution
        row = None if solution is None else sp.ImmutableDenseMatrix(solution)
    if row is None:
        verdict = Verdict.undecided(claim, tried="the inverse of the controllability matrix")
    else:
        verdict = replace(closed(one_form(row, view.x)), claim=claim)
    return LastRow(row=row, closed=verdict, factor=factor)


def _none(conditions: Linearisability, verdict: Verdict) -> LinearisingOutputs:
    return LinearisingOutputs(
        linearisability=conditions, functions=None, origins=(), relative_degree=None, verdict=verdict
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Search:
    """The search down the controllability indices; `regular` if the operating point is a regular one.

    `given_up` names the steps that ended for lack of time.
    """

    found: Accessibility
    regular: bool
    given_up: list[str] = field(default_factory=list)

    def run(self, indices: tuple[int, ...]) -> list[tuple[sp.Expr, str]] | None:
        chosen: list[tuple[sp.Expr, str]] = []
        chains: list[tuple[int, list[sp.Expr]]] = []
        for index in sorted(set(indices), reverse=True):
            for _ in range(indices.count(index)):
                known = [e for own, chain in chains for e in chain[: own - index + 1]]
                new = self._next(index, known)
                if new is None:
                    return None
                chosen.append(new)
                chains.append((index, self._chain(new[0], index)))
        return chosen

    def _chain(self, function: sp.Expr, length: int) -> list[sp.Expr]:
        view, chain = self.found.view, [function]
        for _ in range(length - 1):
            chain.append(lie_derivative(chain[-1], view.f, view.x))
        return chain

    def _next(self, index: int, known: list[sp.Expr]) -> tuple[sp.Expr, str] | None:
        """A function with dh ⊥ G_{index−2}, independent of the known ones, where possible at the operating point."""
        span = self._short_span(index - 2)
        if span is None:
            return None
        spare: tuple[sp.Expr, str] | None = None
        for function, origin in self._candidates(span):
            if not self._independent([*known, function]):
                continue
            if not self.regular or self._independent_at_point([*known, function]):
                return function, origin
            spare = spare or (function, origin)
        return spare

    def _short_span(self, level: int) -> Distribution | None:
        """G_level by short fields: its brackets may be thousands of times longer. None where neither were found."""
        view = self.found.view
        if level < 0:
            return Distribution(coordinates=view.x, fields=())
        short = attempt(_SECONDS, "short fields", filtration, view.f, view.input_fields, view.x, level)
        if short.value is not None:
            return short.value[-1]
        return None if self.found.cut_short and level >= len(self.found.levels) else self.found.distribution(level)

    def _candidates(self, span: Distribution) -> Iterator[tuple[sp.Expr, str]]:
        view = self.found.view
        outputs = [(h, f"output {o.name}") for h, o in zip(view.h, view.system.outputs, strict=True)]
        states = [(x, f"state {x.name}") for x in view.x]
        for function, origin in (*outputs, *states):
            if self._constant_along(function, span):
                yield function, origin
        for near in self._base_points():
            numbers = equilibrium_in_numbers(view.system).where
            where = numbers | {x: value.xreplace(numbers) for x, value in near.items()}
            for function in self._integrated(span, near):
                turned = defined_near(function, where)
                yield (turned if self._constant_along(turned, span) else function), "integration"

    def _base_points(self) -> Iterable[Mapping[sp.Symbol, sp.Expr]]:
        """The operating point, and a regular one for plants that are singular there."""
        yield self.found.point
        if self.regular:
            return
        generic = self.found.ranks[-1].point or {}
        yield {x: generic.get(x, sp.Integer(0)) for x in self.found.view.x}

    def _integrated(self, span: Distribution, near: Mapping[sp.Symbol, sp.Expr]) -> Iterator[sp.Expr]:
        x = self.found.view.x
        if len(span.fields) == len(x) - 1:
            kernel = null_space(span.matrix.T)
            hints = [self.found.singular] if self.found.singular is not None else []
            integral = integrate(one_form(kernel[0], x), hints, near=near, seconds=_SECONDS)
            self._note_time(integral.verdict)
            if integral.value is not None:
                yield integral.value
            return
        integrals = first_integrals(span, near=near, seconds=_SECONDS)
        self._note_time(integrals.verdict)
        yield from integrals.found

    def _note_time(self, verdict: Verdict) -> None:
        tried = verdict.evidence.get("tried", ())
        steps = ((tried,) if isinstance(tried, str) else tuple(tried)) + (verdict.evidence.get("reason", ""),)
        self.given_up.extend(step for step in steps if "out of time" in step or "no answer within" in step)

    def _constant_along(self, function: sp.Expr, span: Distribution) -> bool:
        x = self.found.view.x
        slopes = [function.diff(c) for c in x]
        if all(s == 0 for s in slopes):
            return False
        return all(_FILTER(lie_derivative(function, field, x)).holds for field in span.fields)

    def _independent(self, functions: list[sp.Expr]) -> bool:
        return generic_rank(self._differentials(functions), seconds=0).value == len(functions)

    def _independent_at_point(self, functions: list[sp.Expr]) -> bool:
        # Parameters at their values where the point is an equilibrium for these only.
        where = equilibrium(self.found.view.system).where
        if any(value_at(function, where) is None for function in functions):
            return False
        return rank_at(self._differentials(functions), where, seconds=0).value == len(functions)

    def _differentials(self, functions: list[sp.Expr]) -> sp.ImmutableDenseMatrix:
        x = self.found.view.x
        return sp.ImmutableDenseMatrix([[h.diff(c) for c in x] for h in functions])
