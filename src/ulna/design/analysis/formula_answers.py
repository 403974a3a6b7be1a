"""The standard questions about a plant, in groups that share their computations (docs/analysis.md)."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ulna.base import Verdict
from ulna.design.analysis.answer import Answer, decided, not_applicable
from ulna.design.analysis.rest_answers import rest_points
from ulna.design.forms import (
    LinearisingForm,
    LinearisingOutputs,
    controller_form,
    dynamic_extension,
    input_output_form,
    last_row,
    linearisability,
    linearising_outputs,
    state_linearisation,
)
from ulna.design.internal import minimum_phase, zero_dynamics
from ulna.design.observers import ObserverForm, find_observer_form, output_transformation
from ulna.geometry import (
    RelativeDegree,
    accessibility,
    accessible,
    new_symbols,
    observability,
    observation_space,
    relative_degree,
)
from ulna.symbolic.exact import zero_set
from ulna.symbolic.solving import on_branch
from ulna.system import NON_SMOOTH, System, equilibrium_in_numbers

_NO_OUTPUT = "the plant has no output"
_NO_INPUT = "the plant has no input"


def outputs_answered(system: System) -> dict[str, Answer]:
    """Relative degree of the given outputs, generically and at the point, and their decoupling matrix."""
    if not system.outputs:
        return {
            k: not_applicable(k, _NO_OUTPUT)
            for k in ("relative_degree", "relative_degree_at_point", "decoupling_matrix")
        }
    found = relative_degree(system)
    if not found.certainty.holds:
        reason = str(found.certainty.evidence.get("tried", "derivatives could not be judged"))
        keys = ("relative_degree", "relative_degree_at_point", "decoupling_matrix")
        return {key: not_applicable(key, reason, ran_out=True) for key in keys}
    return {
        "relative_degree": Answer(verdict=found.certainty, value=list(found.per_output)),
        "relative_degree_at_point": decided(found.at_point),
        "decoupling_matrix": Answer(verdict=found.invertible, value=found.decoupling.tolist()),
    }


def _inputs(system: System) -> dict[str, Answer]:
    found = accessibility(system)
    conditions = linearisability(system)
    return {
        "controllability_rank": Answer(verdict=found.controllable, value=found.rank),
        "controllability_rank_at_point": Answer(verdict=found.controllable_at_point, value=found.rank_at_point),
        "distribution_dims": Answer(verdict=found.controllable, value=list(found.dimensions)),
        "involutive": decided(conditions.involutive),
        "full_state_linearizable": decided(conditions.verdict),
        "linearizable_at_point": decided(conditions.at_point),
    }


def _state_linearisation(system: System) -> dict[str, Answer]:
    return {"state_linearizable": decided(state_linearisation(system).verdict)}


def _linearisation(system: System) -> dict[str, Answer]:
    if any(rate.has(*NON_SMOOTH) for rate in system.inline(system.rates)) and (given := law_of_outputs(system)):
        # The given outputs need few derivatives, which exist; brackets would need them all.
        reason = "q has brackets in it, which need more derivatives than the plant has"
        return given | {key: not_applicable(key, reason) for key in ("q_closed", "integrating_factor")}
    found = linearising_outputs(system)
    answers = {"linearizing_outputs": Answer(verdict=found.verdict, value=None)} | _last_row(system, found)
    if found.functions is None:
        return answers | _input_output(system)
    form = controller_form(system, found.functions)
    answers["linearizing_outputs"] = Answer(verdict=found.verdict, value=list(found.functions))
    return answers | _transformation(form)


def law_of_outputs(system: System) -> dict[str, Answer]:
    """Transformation, law and singular set of the given outputs where they linearise the whole state; else nothing."""
    if not system.outputs or len(system.outputs) != len(system.inputs):
        return {}
    degree = relative_degree(system)
    if not degree.invertible.holds or degree.total != len(system.states):
        return {}
    form = controller_form(system, degree.outputs)
    given = Answer(verdict=form.verdict, value=list(degree.outputs))
    return {"linearizing_outputs": given} | _transformation(form)


def _last_row(system: System, found: LinearisingOutputs) -> dict[str, Answer]:
    """Whether q, the last row of the inverse controllability matrix, is closed, and the factor that makes it so."""
    keys = ("q_closed", "integrating_factor")
    row = last_row(found)
    if row is None:
        inputs = len(system.inputs)
        reason = "the controllability matrix is singular" if inputs == 1 else f"q is for one input, here are {inputs}"
        return {key: not_applicable(key, reason) for key in keys}
    return {
        "q_closed": decided(row.closed),
        "integrating_factor": Answer(verdict=found.verdict, value=row.factor),
    }


def _transformation(form: LinearisingForm) -> dict[str, Answer]:
    inverse = None
    if form.map.inverse is not None:
        inverse = {x.name: e for x, e in zip(form.map.old, form.map.inverse, strict=True)}
    return {
        "T": Answer(verdict=form.verdict, value=list(form.map.forward)),
        "inverse": Answer(verdict=form.map.inverted, value=inverse),
        "control": Answer(verdict=form.verdict, value=list(form.control)),
        "singular_set": Answer(verdict=form.verdict, value=zero_set(form.singular, form.view.x)),
    }


def _input_output(system: System) -> dict[str, Answer]:
    """Law and singular set of the outputs, where the whole state cannot be linearised."""
    if not system.outputs or len(system.outputs) != len(system.inputs):
        return {}
    degree: RelativeDegree = relative_degree(system)
    answers = {}
    if degree.singular is not None:
        value = zero_set(degree.singular, degree.view.x)
        answers["singular_set"] = Answer(verdict=degree.invertible, value=value)
    if degree.invertible.holds:
        form = input_output_form(system)
        verdict = Verdict(
            claim="the law linearises the outputs, not the whole state",
            status=degree.invertible.status,
            evidence={"form": "input-output", "internal_dimension": form.internal_dimension},
        )
        answers["control"] = Answer(verdict=verdict, value=list(form.control))
    return answers


def _observability(system: System) -> dict[str, Answer]:
    keys = ("observability_rank", "observability_rank_at_point", "observability_rank_without_inputs")
    if not system.outputs:
        return {k: not_applicable(k, _NO_OUTPUT) for k in keys}
    found, drift = observation_space(system), observability(system)
    without = drift.observable.restated(drift.observable.claim.replace(" (rank", " without inputs (rank"))
    return {
        "observability_rank": Answer(verdict=found.observable, value=found.rank.value),
        "observability_rank_at_point": Answer(verdict=found.observable_at_point, value=found.at_point.value),
        "observability_rank_without_inputs": Answer(verdict=without, value=drift.rank.value),
    }


def _accessibility(system: System) -> dict[str, Answer]:
    if not system.inputs:
        return {"accessibility_rank": not_applicable("accessibility_rank", _NO_INPUT)}
    verdict, dimension = accessible(system)
    return {"accessibility_rank": Answer(verdict=verdict, value=dimension)}


def _observer(system: System) -> dict[str, Answer]:
    if not system.outputs:
        return {"observer_form": not_applicable("observer_form", _NO_OUTPUT)}
    found = find_observer_form(system)
    answers = {"observer_form": decided(found.verdict)}
    if found.form is not None:
        answers |= _observer_coordinates(found.form)
    return answers


def _output_transformation(system: System) -> dict[str, Answer]:
    """Whether ψ(y) helps; its coordinates take the place of the plain form's where only they exist."""
    if not system.outputs:
        return {key: not_applicable(key, _NO_OUTPUT) for key in ("observer_form_output_transform", "output_transform")}
    found = output_transformation(system)
    psi = None
    if found.form is not None:
        at = dict(zip(found.form.y, system.inline(system.readouts), strict=True))
        here = equilibrium_in_numbers(system).where
        psi = [on_branch(function.xreplace(at), here) for function in found.form.measured]
    answers = {
        "observer_form_output_transform": decided(found.verdict),
        "output_transform": Answer(verdict=found.verdict, value=psi[0] if psi and len(psi) == 1 else psi),
    }
    if found.form is not None and find_observer_form(system).form is None:
        answers |= _observer_coordinates(found.form)
    return answers


def _observer_coordinates(form: ObserverForm) -> dict[str, Answer]:
    system = form.system
    # Whatever the plant calls its outputs: an answer is read by its symbols.
    y = new_symbols("y", len(form.y), (*system.input_symbols, *system.parameter_symbols), plain_if_one=True)
    injection = form.injection.xreplace(dict(zip(form.y, y, strict=True)))
    return {
        "observer_T": Answer(verdict=form.verdict, value=list(form.map.forward)),
        "observer_injection": Answer(verdict=form.verdict, value=list(injection)),
    }


def _zero_dynamics(system: System) -> dict[str, Answer]:
    keys = ("zero_dynamics", "minimum_phase")
    if not system.outputs or not system.inputs:
        return {key: not_applicable(key, _NO_INPUT if system.outputs else _NO_OUTPUT) for key in keys}
    found = zero_dynamics(system)
    stability = minimum_phase(found)
    phase = Answer(
        verdict=stability.verdict, value=None if stability.stability == "undecided" else str(stability.stability)
    )
    if found.system is None:
        return {"zero_dynamics": Answer(verdict=found.verdict, value=None), "minimum_phase": phase}
    value = {
        "manifold": {x.name: e for x, e in found.manifold.items()},
        "u": [found.inputs[u] for u in system.input_symbols if u in found.inputs],
        "coords": {x.name: e for x, e in found.coordinates.items()},
        "rhs": {s.name: r for s, r in zip(found.system.states, found.system.rates, strict=True)},
        "set_point": list(found.set_point),
    }
    return {"zero_dynamics": Answer(verdict=found.verdict, value=value), "minimum_phase": phase}


def _dynamic_extension(system: System) -> dict[str, Answer]:
    key = "dynamic_extension"
    if len(system.outputs) == len(system.inputs) > 1 and relative_degree(system).invertible.holds:
        verdict = Verdict.refuted("dynamic extension is needed", reason="the decoupling matrix is invertible already")
        return {key: Answer(verdict=verdict, value=None)}
    found = dynamic_extension(system)
    if found.system is None:
        return {key: Answer(verdict=found.verdict, value=None)}
    value = {
        "states": [s.name for s in found.system.states],
        "inputs": [s.name for s in found.system.inputs],
        "rates": {s.name: r for s, r in zip(found.system.states, found.system.rates, strict=True)},
        "feedback": dict(zip((u.name for u in system.input_symbols), found.feedback, strict=True)),
        "relative_degree": list(found.indices),
        "det": found.singular,
        "regular_at_point": decided(found.at_point).value,
        "complete": decided(found.complete).value,
    }
    return {key: Answer(verdict=found.verdict, value=value)}


GROUPS: Mapping[tuple[str, ...], Callable[[System], dict[str, Answer]]] = {
    ("relative_degree", "relative_degree_at_point", "decoupling_matrix"): outputs_answered,
    (
        "controllability_rank",
        "controllability_rank_at_point",
        "distribution_dims",
        "involutive",
        "full_state_linearizable",
        "linearizable_at_point",
    ): _inputs,
    ("state_linearizable",): _state_linearisation,
    (
        "linearizing_outputs",
        "T",
        "inverse",
        "control",
        "singular_set",
        "q_closed",
        "integrating_factor",
    ): _linearisation,
    ("accessibility_rank",): _accessibility,
    ("observability_rank", "observability_rank_at_point", "observability_rank_without_inputs"): _observability,
    ("zero_dynamics", "minimum_phase"): _zero_dynamics,
    (
        "observer_form",
        "observer_T",
        "observer_injection",
    ): _observer,
    ("observer_form_output_transform", "output_transform"): _output_transformation,
    ("dynamic_extension",): _dynamic_extension,
    ("rest_points",): rest_points,
}
"""Which question belongs to which group; a group is answered within one time budget."""

RANKS = (
    ("accessibility_rank",),
    ("observability_rank", "observability_rank_at_point", "observability_rank_without_inputs"),
)
"""Groups whose answers are numbers alone: where numbers have answered, formulas add nothing."""
