"""The standard questions on the numeric road: for plants too large for formulas, answered at points in balls."""

from __future__ import annotations

from ulna.base import Status, UlnaError, Verdict
from ulna.design.analysis.answer import Answer, decided, not_applicable
from ulna.design.forms import compiled_law
from ulna.geometry import NumericRank, NumericStructure, numeric_structure, structure_in_numbers
from ulna.system import Equilibrium, System, given_point, system_kernel

LARGE = 13
"""States from which on a plant goes the numeric road."""


def answers_in_numbers(system: System, keys: tuple[str, ...]) -> dict[str, Answer]:
    """The answers that numbers can give; the other keys are undecided and say so."""
    found = structure_in_numbers(system, given_point(system)) or numeric_structure(system_kernel(system))
    reason = f"no formulas are sought for {len(system.states)} states: numeric road"
    answers = {key: not_applicable(key, reason) for key in keys}
    answered = _structure(system, found) | _degrees(system, found) | law_in_numbers(system)
    return answers | {key: answer for key, answer in answered.items() if key in keys}


def structure_answers(system: System, here: Equilibrium, keys: tuple[str, ...]) -> dict[str, Answer]:
    """What balls tell of any plant in milliseconds, for where formulas run out of time."""
    found = structure_in_numbers(system, here)
    answers = {key: not_applicable(key, "numbers do not tell") for key in keys}
    if found is None:
        return answers
    told = _structure(system, found) | _degrees(system, found)
    return answers | {
        key: answer for key, answer in told.items() if key in keys and answer.verdict.status is not Status.UNDECIDED
    }


def _ranked(claim: str, rank: NumericRank) -> Answer:
    return Answer(verdict=rank.verdict.restated(claim, road="numeric"), value=rank.value)


def _structure(system: System, found: NumericStructure) -> dict[str, Answer]:
    n = len(system.states)
    full = found.involutive
    if found.rank.value is None:
        full = found.rank.verdict
    elif found.rank.value < n:
        evidence = dict(found.rank.verdict.evidence)
        full = Verdict.refuted("full rank", controllability_rank=found.rank.value, states=n, **evidence)
    dimensions = None if None in found.dimensions else list(found.dimensions)
    answers = {
        "controllability_rank": _ranked("generic rank", found.rank),
        "controllability_rank_at_point": _ranked("rank at the operating point", found.rank_at_point),
        "distribution_dims": Answer(verdict=found.rank.verdict, value=dimensions),
        "involutive": decided(found.involutive),
        "full_state_linearizable": decided(full.restated("full-state linearisable")),
        "state_linearizable": decided(_by_coordinates_alone(found, n)),
        "linearizable_at_point": decided(_around_the_point(found, full)),
    }
    if found.rank.value == n:
        answers["accessibility_rank"] = _ranked(
            "accessible: the brackets with the drift reach every direction", found.rank
        )
    if full.fails:
        answers["linearizing_outputs"] = Answer(verdict=full.restated("there are linearising outputs"), value=None)
    if found.observability_rank is not None and found.observability_rank_at_point is not None:
        # Along the drift alone: inputs can only add to it.
        answers["observability_rank_without_inputs"] = _ranked("generic rank", found.observability_rank)
        if found.observability_rank.value == n or not system.inputs:
            answers["observability_rank"] = _ranked("generic rank", found.observability_rank)
        if found.observability_rank_at_point.value == n or not system.inputs:
            answers["observability_rank_at_point"] = _ranked("rank at the point", found.observability_rank_at_point)
    return answers


def _by_coordinates_alone(found: NumericStructure, n: int) -> Verdict:
    """Whether a change of coordinates alone makes the plant linear: rank n, and all ad_f^i g_j commute."""
    claim = "linear in other coordinates, without feedback"
    if found.rank.value != n:
        evidence = {"controllability_rank": found.rank.value, "states": n}
        return Verdict.undecided(claim, **evidence) if found.rank.value is None else Verdict.refuted(claim, **evidence)
    return found.commuting.restated(claim, road="numeric")


def _around_the_point(found: NumericStructure, full: Verdict) -> Verdict:
    """Full-state linearisability around the operating point: as generically, and no G_k is smaller there."""
    claim = "full-state linearisable around the operating point"
    if not full.holds:
        return full.restated(claim)
    if None in found.dimensions_at_point:
        return Verdict.undecided(claim, tried="the dimensions of the G_k at the point")
    dimensions = {"dimensions": found.dimensions, "dimensions_at_point": found.dimensions_at_point}
    same = found.dimensions == found.dimensions_at_point
    return full.restated(claim) if same else Verdict.refuted(claim, generically=True, **dimensions)


def _degrees(system: System, found: NumericStructure) -> dict[str, Answer]:
    if not system.outputs or not system.inputs:
        return {}
    known = found.degrees_known
    return {
        "relative_degree": Answer(verdict=known, value=list(found.degrees) if known.holds else None),
        "relative_degree_at_point": decided(found.degrees_at_point),
    }


def law_in_numbers(system: System) -> dict[str, Answer]:
    """The compiled law of the given outputs."""
    if not system.outputs or not system.inputs:
        return {}
    answers: dict[str, Answer] = {}
    try:
        law = compiled_law(system)
    except UlnaError as error:
        # Besides plants without a form: a system of equations that is singular where it is compiled.
        return answers | {"control": not_applicable("control", str(error))}
    compiled = Verdict.supported(
        "the law is compiled, not written out (design.compiled_law)",
        operations=law.law.operation_count,
        internal_dimension=len(system.states) - sum(law.indices),
    )
    answers["control"] = Answer(verdict=compiled, value=None)
    if sum(law.indices) == len(system.states):
        answers["linearizing_outputs"] = Answer(verdict=law.verdict, value=list(system.inline(system.readouts)))
    return answers
