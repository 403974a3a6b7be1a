"""The standard questions on the numeric road: for plants too large for formulas, answered at random points."""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sp

from ulna.base import NoFormError, Verdict
from ulna.design.analysis.answer import Answer, decided, not_applicable
from ulna.design.forms import compiled_law, relative_degrees
from ulna.geometry import NumericStructure, numeric_structure
from ulna.system import System, SystemKernel, system_kernel

LARGE = 13
"""States from which on a plant goes the numeric road."""


def answers_in_numbers(system: System, keys: tuple[str, ...]) -> dict[str, Answer]:
    """The answers that numbers can give; the other keys are undecided and say so."""
    field = system_kernel(system)
    given = dict(system.operating_point)
    point = np.array([float(given.get(s.name, sp.Integer(0))) for s in system.states])
    structure = numeric_structure(field, point)
    reason = f"no formulas are sought for {len(system.states)} states: numeric road"
    answers = {key: not_applicable(key, reason) for key in keys}
    answered = _structure(system, structure) | _outputs(system, field)
    return answers | {key: answer for key, answer in answered.items() if key in keys}


def _sampled(claim: str, value: Any) -> Answer:
    return Answer(verdict=Verdict.supported(claim, road="numeric"), value=value)


def _structure(system: System, found: NumericStructure) -> dict[str, Answer]:
    n = len(system.states)
    full = all_involutive = found.involutive
    if found.rank < n:
        full = Verdict.refuted("full-state linearisable", controllability_rank=found.rank, states=n)
    answers = {
        "controllability_rank": _sampled("generic rank", found.rank),
        "controllability_rank_at_point": _sampled("rank at the operating point", found.rank_at_point),
        "distribution_dims": _sampled("generic dimensions", list(found.dimensions)),
        "involutive": decided(all_involutive),
        "full_state_linearizable": decided(full),
    }
    if found.observability_rank is not None:
        answers["observability_rank"] = _sampled("generic rank", found.observability_rank)
        answers["observability_rank_at_point"] = _sampled("rank at the point", found.observability_rank_at_point)
    return answers


def _outputs(system: System, field: SystemKernel) -> dict[str, Answer]:
    if not field.functions or not field.inputs:
        return {}
    try:
        law = compiled_law(system)
    except NoFormError as error:
        degrees, verdict = relative_degrees(field)
        found = Answer(verdict=verdict, value=list(degrees))
        return {"relative_degree": found, "control": not_applicable("control", str(error))}
    answers = {"relative_degree": Answer(verdict=law.verdict, value=list(law.indices))}
    complete = sum(law.indices) == len(system.states)
    compiled = Verdict.supported(
        "the law is compiled, not written out (design.compiled_law)",
        operations=law.law.operation_count,
        internal_dimension=len(system.states) - sum(law.indices),
    )
    answers["control"] = Answer(verdict=compiled, value=None)
    if complete:
        outputs = [s.name for s in system.outputs]
        answers["linearizing_outputs"] = Answer(verdict=law.verdict, value=[sp.Symbol(name) for name in outputs])
    return answers
