"""Everything a plant's vector fields say, key by key: `analyse(system)` (keys and values: docs/analysis.md)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import sympy as sp

from ulna.base import UlnaError, Verdict
from ulna.design.controller_form import ControllerForm, controller_form
from ulna.design.findings import Finding, decided, not_applicable
from ulna.design.linearisability import linearisability
from ulna.design.linearising_outputs import last_row, linearising_outputs
from ulna.design.state_linearisation import state_linearisation
from ulna.geometry.accessibility import accessibility
from ulna.geometry.observability import observability
from ulna.geometry.relative_degree import RelativeDegree, relative_degree
from ulna.symbolic.budget import attempt
from ulna.symbolic.zero_set import zero_set
from ulna.system.affine import control_affine
from ulna.system.operating_point import OperatingPoint, operating_point
from ulna.system.system import System

SECONDS = 8.0
"""Time that one group of answers may take; what is not found by then is undecided."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Analysis:
    """The answers to the standard questions about a plant.

    Attributes:
        system: the plant.
        point: the operating point at which pointwise questions were asked.
        findings: by key, each a value with its verdict and evidence.
    """

    system: System
    point: OperatingPoint
    findings: Mapping[str, Finding]

    def __getitem__(self, key: str) -> Finding:
        return self.findings[key]


def analyse(system: System, *, seconds: float = SECONDS) -> Analysis:
    """Answer every question of docs/analysis.md for a plant.

    Args:
        system: the plant; parameters stay symbolic except where stability needs numbers.
        seconds: time for each group of answers.

    Raises:
        NotAffineError: if the plant is not affine in its inputs, the one thing nothing can be said without.
    """
    control_affine(system)
    findings: dict[str, Finding] = {}
    for keys, group in _GROUPS.items():
        findings |= _answered(keys, group, system, seconds)
    return Analysis(system=system, point=operating_point(system), findings=findings)


def _answered(
    keys: tuple[str, ...], group: Callable[[System], dict[str, Finding]], system: System, seconds: float
) -> dict[str, Finding]:
    """The findings of a group; one that fails or runs out of time leaves its keys undecided, with the reason."""
    try:
        outcome = attempt(seconds, keys[0], group, system)
    except UlnaError as error:
        found: dict[str, Finding] = {}
        reason = str(error)
    else:
        found = outcome.value or {}
        reason = outcome.reason
    return {key: found.get(key, not_applicable(key, reason or "nothing was found")) for key in keys}


def _outputs(system: System) -> dict[str, Finding]:
    if not system.outputs:
        reason = "the plant has no output"
        return {k: not_applicable(k, reason) for k in ("relative_degree", "relative_degree_at_point", "decoupling_matrix")}
    found = relative_degree(system)
    return {
        "relative_degree": Finding(verdict=found.certainty, value=list(found.per_output)),
        "relative_degree_at_point": decided(found.at_point),
        "decoupling_matrix": Finding(verdict=found.invertible, value=found.decoupling.tolist()),
    }


def _inputs(system: System) -> dict[str, Finding]:
    found = accessibility(system)
    conditions = linearisability(system)
    return {
        "controllability_rank": Finding(verdict=found.controllable, value=found.rank),
        "controllability_rank_at_point": Finding(verdict=found.controllable_at_point, value=found.rank_at_point),
        "distribution_dims": Finding(verdict=found.controllable, value=list(found.dimensions)),
        "involutive": decided(conditions.involutive),
        "full_state_linearizable": decided(conditions.verdict),
        "linearizable_at_point": decided(conditions.at_point),
    }


def _state_linearisation(system: System) -> dict[str, Finding]:
    return {"state_linearizable": decided(state_linearisation(system).verdict)}


def _linearisation(system: System) -> dict[str, Finding]:
    found = linearising_outputs(system)
    row = last_row(found)
    findings: dict[str, Finding] = {}
    if row is not None:
        findings["q_closed"] = decided(row.closed)
        if row.factor is not None:
            findings["integrating_factor"] = Finding(verdict=found.verdict, value=row.factor)
    if found.functions is None:
        reason = Finding(verdict=found.verdict, value=None)
        return findings | dict.fromkeys(("linearizing_outputs", "T", "inverse"), reason) | _input_output(system)
    form = controller_form(system, found.functions)
    findings["linearizing_outputs"] = Finding(verdict=found.verdict, value=list(found.functions))
    return findings | _transformation(form)


def _transformation(form: ControllerForm) -> dict[str, Finding]:
    inverse = None
    if form.map.inverse is not None:
        inverse = {x.name: e for x, e in zip(form.map.old, form.map.inverse, strict=True)}
    return {
        "T": Finding(verdict=form.verdict, value=list(form.map.forward)),
        "inverse": Finding(verdict=form.map.inverted, value=inverse),
        "control": Finding(verdict=form.verdict, value=list(form.control())),
        "singular_set": Finding(verdict=form.verdict, value=zero_set(form.singular, form.view.x)),
    }


def _input_output(system: System) -> dict[str, Finding]:
    """Law and singular set of the outputs, where the whole state cannot be linearised."""
    from ulna.design.input_output import input_output_form

    if not system.outputs or len(system.outputs) != len(system.inputs):
        return {}
    degree: RelativeDegree = relative_degree(system)
    findings = {}
    if degree.singular is not None:
        value = zero_set(degree.singular, degree.view.x)
        findings["singular_set"] = Finding(verdict=degree.invertible, value=value)
    if degree.invertible.holds:
        form = input_output_form(system)
        verdict = Verdict(
            claim="the law linearises the outputs, not the whole state",
            status=degree.invertible.status,
            evidence={"form": "input-output", "internal_dimension": form.internal_dimension},
        )
        findings["control"] = Finding(verdict=verdict, value=list(form.control))
    return findings


def _observability(system: System) -> dict[str, Finding]:
    if not system.outputs:
        reason = "the plant has no output"
        return {k: not_applicable(k, reason) for k in ("observability_rank", "observability_rank_at_point")}
    found = observability(system)
    return {
        "observability_rank": Finding(verdict=found.observable, value=found.rank.value),
        "observability_rank_at_point": Finding(verdict=found.observable_at_point, value=found.at_point.value),
    }


def _expressions(matrix: sp.MatrixBase) -> list[Any]:
    return list(matrix)


_GROUPS: Mapping[tuple[str, ...], Callable[[System], dict[str, Finding]]] = {
    ("relative_degree", "relative_degree_at_point", "decoupling_matrix"): _outputs,
    (
        "controllability_rank",
        "controllability_rank_at_point",
        "distribution_dims",
        "involutive",
        "full_state_linearizable",
        "linearizable_at_point",
    ): _inputs,
    ("state_linearizable",): _state_linearisation,
    ("linearizing_outputs", "T", "inverse", "control", "singular_set", "q_closed", "integrating_factor"): _linearisation,
    ("observability_rank", "observability_rank_at_point"): _observability,
}
