"""Full-state linearisability by state feedback and change of coordinates: the conditions, and what breaks them.

Jakubczyk and Respondek (1980), Hunt, Su and Meyer (1983); Isidori, Nonlinear Control Systems, theorems 4.2.3 and
5.2.3: the distributions G_i = span{ad_f^k g_j, k ≤ i} have constant dimension, all of them are involutive, and
dim G_{n−1} = n. For one input G_{n−2} alone has to be looked at.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from typing import Any

import sympy as sp

from ulna.base import Verdict, all_of
from ulna.geometry import (
    Accessibility,
    NumericStructure,
    RelativeDegree,
    accessibility,
    filtration,
    involutive,
    lie_bracket,
    relative_degree,
)
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.exact import attempt, generic_rank
from ulna.system import System, equilibrium

_PROOF_SECONDS = 1.0
_BRACKET_SECONDS = 1.5
_SHORT_SECONDS = 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Linearisability:
    """Whether a plant is full-state linearisable, and which bracket, rank or point says no.

    Attributes:
        accessibility: the brackets and ranks that were judged.
        involutive: whether all G_i, i ≤ n − 2, are involutive on an open dense set. A refutation names the `bracket`
            (text), its components `field`, the `span` (texts), the ranks before and after, and the `point`.
        verdict: whether the plant is linearisable around almost every point.
        at_point: whether it is so around the operating point.
    """

    accessibility: Accessibility
    involutive: Verdict
    verdict: Verdict
    at_point: Verdict

    @property
    def indices(self) -> tuple[int, ...]:
        """Controllability (Brunovský) indices, largest first."""
        return self.accessibility.indices


def linearisability(system: PlantLike) -> Linearisability:
    """Whether a plant is full-state linearisable; no output is needed and none is used.

    Raises:
        NotAffineError: if the plant is not affine in its inputs.
        UlnaError: if a field is not smooth.
    """
    return _linearisability(as_plant(system))


@lru_cache(maxsize=32)
def _linearisability(system: System) -> Linearisability:
    found = accessibility(system)
    involution = _all_involutive(found)
    claim = f"'{system.name}' is full-state linearisable"
    given = linearises(relative_degree(system)) if found.cut_short and system.outputs else None
    if given is not None and given.holds:
        # Outputs whose relative degrees add up to n are a proof: no bracket is needed.
        involution = Verdict(claim=involution.claim, status=given.status, evidence={"because": given.claim})
        verdict = given.restated(claim, indices=found.indices)
    else:
        verdict = all_of(claim, [found.controllable, involution], indices=found.indices)
    return Linearisability(
        accessibility=found,
        involutive=involution,
        verdict=verdict,
        at_point=_at_point(system, found, verdict),
    )


def _all_involutive(found: Accessibility) -> Verdict:
    n, inputs = len(found.view.x), len(found.view.u)
    claim = f"G_{n - 2} is involutive" if inputs == 1 else "all G_i are involutive"
    if not inputs:
        return Verdict.proved(claim, reason="there are no inputs")
    if found.numbers is not None:
        return found.numbers.involutive.restated(claim, road="numeric")
    if found.cut_short:
        return Verdict.undecided(claim, tried=found.cut_short)
    judged: list[Verdict] = []
    levels = [n - 2] if inputs == 1 else range(n - 1)
    last = len(found.levels) - 1
    for level in levels:
        if level < 0 or level > last or found.ranks[level].value == n:
            continue
        judged.append(_involutive(found, level))
        if judged[-1].fails:
            break
    if levels and n - 2 > last and not any(v.fails for v in judged):
        judged.append(_involutive(found, last))
    return all_of(claim, judged)


def _involutive(found: Accessibility, level: int) -> Verdict:
    """By short fields that span the same where that says yes; else by the brackets themselves, which have names."""
    claim = f"G_{level} is involutive"
    view = found.view
    short = attempt(_SHORT_SECONDS, "short fields", filtration, view.f, view.input_fields, view.x, level).value
    judged = attempt(_SHORT_SECONDS, "involutivity", involutive, short[-1]).value if short is not None else None
    if judged is not None and judged.holds:
        return replace(judged, claim=claim)
    named = _involutive_by_names(found, level)
    return named if named.fails or judged is None or not judged.fails else replace(judged, claim=claim)


def _involutive_by_names(found: Accessibility, level: int) -> Verdict:
    """All pairs at random points first, since one that leaves the span is all that matters; proofs afterwards."""
    span = found.distribution(level)
    claim = f"G_{level} is involutive"
    names = [found.name_of(field) for field in span.fields]
    doubtful: list[sp.ImmutableDenseMatrix] = []
    parts: list[Verdict] = []
    for i, j in combinations(range(len(span.fields)), 2):
        bracket = attempt(
            _BRACKET_SECONDS, "bracket", lie_bracket, span.fields[i], span.fields[j], span.coordinates
        ).value
        if bracket is None:
            parts.append(Verdict.undecided(claim, tried=f"[{names[i]}, {names[j]}] in {_BRACKET_SECONDS:g} s"))
            continue
        if all(entry == 0 for entry in bracket):
            continue
        larger = sp.ImmutableDenseMatrix.hstack(*span.fields, bracket)
        rank = generic_rank(larger, seconds=0)
        if rank.point is None:
            parts.append(Verdict.undecided(claim, **rank.verdict.evidence))
        elif rank.value > len(span.fields):
            evidence: dict[str, Any] = {
                "bracket": f"[{names[i]}, {names[j]}]",
                "field": bracket,
                "span": tuple(names),
                "level": level,
                "rank_before": len(span.fields),
                "rank_after": rank.value,
                "point": _shown_point(found.view.x, rank.point),
            }
            return Verdict.refuted(claim, **evidence)
        else:
            doubtful.append(larger)
    for larger in doubtful:
        parts.append(generic_rank(larger, seconds=_PROOF_SECONDS / len(doubtful)).verdict)
    return all_of(claim, parts)


def _shown_point(states: tuple[sp.Symbol, ...], point: Mapping[Any, Any] | None) -> dict[sp.Symbol, sp.Expr]:
    """The states' values only, states that do not matter left out."""
    return {s: point[s] for s in states if s in point} if point else {}


def _at_point(system: System, found: Accessibility, verdict: Verdict) -> Verdict:
    here = equilibrium(system)
    claim = f"'{system.name}' is full-state linearisable {here.phrase.replace('at the', 'around its', 1)}"
    if verdict.fails:
        return Verdict.refuted(claim, **{**verdict.evidence, "because": verdict.claim, "generically": False})
    if found.numbers is not None:
        return _at_point_in_numbers(claim, found, found.numbers, verdict, here.where)
    parts = [verdict]
    for level, (generic, local) in enumerate(zip(found.ranks, found.ranks_at_point, strict=True)):
        if local.point is None or not local.verdict.holds:
            parts.append(Verdict.undecided(f"G_{level} has a dimension at the point", **local.verdict.evidence))
        elif local.value < generic.value:
            return Verdict.refuted(
                claim,
                generically=True,
                level=level,
                generic_dimension=generic.value,
                dimension_at_point=local.value,
                point=here.where,
                singular=found.singular,
            )
    return all_of(claim, parts, point=here.where, singular=found.singular)


def _at_point_in_numbers(
    claim: str, found: Accessibility, numbers: NumericStructure, verdict: Verdict, where: Mapping[sp.Symbol, sp.Expr]
) -> Verdict:
    """By the dimensions of the G_i at the point, in balls."""
    for level, (generic, local) in enumerate(zip(numbers.dimensions, numbers.dimensions_at_point, strict=True)):
        if local is None:
            return Verdict.undecided(claim, tried=f"the dimension of G_{level} at the point", road="numeric")
        if local < (generic or 0):
            evidence = {"level": level, "generic_dimension": generic, "dimension_at_point": local, "point": where}
            return Verdict.refuted(claim, generically=True, road="numeric", **evidence)
    return all_of(claim, [verdict], point=where, singular=found.singular)


def linearises(relative: RelativeDegree) -> Verdict:
    """Whether outputs with these relative degrees linearise the whole state on an open dense set."""
    n, m = len(relative.view.x), len(relative.view.u)
    claim = "the outputs linearise the whole state"
    if len(relative.outputs) != m:
        return Verdict.refuted(claim, outputs=len(relative.outputs), inputs=m, reason="not one output for each input")
    if not relative.certainty.holds:
        return Verdict.undecided(claim, because=relative.certainty.claim)
    if relative.total != n:
        reason = f"the relative degrees {relative.per_output} do not add up to {n}"
        return Verdict.refuted(claim, per_output=relative.per_output, states=n, reason=reason)
    return all_of(claim, [relative.invertible, relative.certainty], per_output=relative.per_output)
