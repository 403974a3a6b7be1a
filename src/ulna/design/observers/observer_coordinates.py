"""The search for an observer form, with or without an answer, and its way back from straightened coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import sympy as sp

from ulna.base import NoFormError, Status, Verdict
from ulna.design.observers.bracket_conditions import ObserverConditions, observer_conditions
from ulna.design.observers.linear_error_form import ObserverForm, assembled, check_observer_form
from ulna.design.observers.observer_blocks import search_blocks
from ulna.design.observers.observer_chain import NotOfOutputsError, search_chain
from ulna.design.observers.output_functions import output_section, output_symbols
from ulna.design.observers.straightened import StraightenedPlant, straightened_plant
from ulna.geometry import Observability, observability
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.exact import SampledZero, attempt, tidy
from ulna.symbolic.formulas import formula
from ulna.symbolic.solving import on_branch
from ulna.system import ControlAffine, System, control_affine, equilibrium_in_numbers

_SECONDS = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ObserverFormSearch:
    """Whether a plant has an observer form, in its outputs or after a transformation of them; the form where found.

    Attributes:
        system: the plant.
        form: the form, or None; None too where an output transformation exists but is not elementary.
        verdict: on its existence; a refutation holds what fails (rank, bracket, or the function that is not one of y).
        conditions: the bracket conditions of a single-output plant, else None. Where the output is not a state they are
            those of the plant in coordinates with the output as a state; `evidence["coordinates"]` says which.
    """

    system: System
    form: ObserverForm | None
    verdict: Verdict
    conditions: ObserverConditions | None = None

    @property
    def functions(self) -> tuple[sp.Expr, ...] | None:
        """(p,) ψ_i in the form's output symbols, these themselves where nothing is transformed; None without a form."""
        return None if self.form is None else self.form.measured


def observer_form(system: PlantLike) -> ObserverForm:
    """The observer form of a plant with one or many outputs.

    Raises:
        NoFormError: if there is none or none was found; `value` is the `ObserverFormSearch` that says why.
        NotAffineError: if the plant is not affine in its inputs.

    Examples:
        >>> ulna.observer_form("one_link_arm").indices
        (3,)
    """
    hint = (
        "Try an output transformation (transformed_observer_form), a high-gain observer or an extended Kalman filter."
    )
    return required_form(find_observer_form(as_plant(system)), hint)


def required_form(search: ObserverFormSearch, hint: str, *, after: str = "") -> ObserverForm:
    """The form that was found.

    Raises:
        NoFormError: if there is none or none was found; `value` is the search.
    """
    if search.form is None:
        asked = f"observer form of '{search.system.name}'{after}"
        raise NoFormError(asked, f"{_explanation(search.verdict)}.", hint, value=search)
    return search.form


@lru_cache(maxsize=64)
def find_observer_form(system: System) -> ObserverFormSearch:
    """The observer form, or the reason why there is none, as a value."""
    claim = f"'{system.name}' has an observer form"
    straight = straightened_plant(system)
    if straight is not None:
        return in_old_coordinates(system, straight, find_observer_form(straight.system))
    seen = observability(system)
    conditions = observer_conditions(system) if len(system.outputs) == 1 else None
    known = seen.observable if conditions is None else conditions.exists
    if known.fails or (conditions is not None and not conditions.fields) or not seen.observable.holds:
        verdict = known.restated(claim)
        return ObserverFormSearch(system=system, form=None, verdict=verdict, conditions=conditions)
    result = attempt(_SECONDS, "search for the coordinates", _searched, seen, conditions)
    form, verdict = result.value or (None, Verdict.undecided(claim, tried=result.reason))
    return ObserverFormSearch(system=system, form=form, verdict=verdict.restated(claim), conditions=conditions)


def _searched(seen: Observability, conditions: ObserverConditions | None) -> tuple[ObserverForm | None, Verdict]:
    section = output_section(seen.view)
    try:
        if conditions is not None:
            chain = search_chain(section, conditions.fields, section.y[0])
        else:
            chain = search_blocks(section, seen)
    except NotOfOutputsError as failure:
        return None, failure.verdict
    form = assembled(section, chain)
    if form is None:
        claim = "the coordinates found can be inverted"
        return None, Verdict.undecided(claim, tried="the inverse of the Jacobian of the coordinates found")
    return (None if form.verdict.fails else form), form.verdict


def in_old_coordinates(system: System, straight: StraightenedPlant, search: ObserverFormSearch) -> ObserverFormSearch:
    """What was found for the straightened plant as an answer for the plant itself."""
    form = None if search.form is None else _moved_back(system, straight, search.form)
    verdict = search.verdict
    if form is None and search.form is not None:
        verdict = Verdict.undecided(verdict.claim, tried="the form found in straightened coordinates moved back")
    evidence = {**verdict.evidence, "coordinates": dict(straight.meaning)}
    return replace(search, system=system, form=form, verdict=replace(verdict, evidence=evidence))


def _moved_back(system: System, straight: StraightenedPlant, form: ObserverForm) -> ObserverForm | None:
    """The form of the straightened plant in the plant's own coordinates by the chain rule, sampled there once more."""
    view = control_affine(system)
    here = equilibrium_in_numbers(system).where
    forward = sp.ImmutableDenseMatrix(form.map.forward.applyfunc(lambda e: on_branch(straight.in_old(e), here)))
    solved = sp.Matrix([straight.solved.get(x, x) for x in view.x])
    inverse_map = form.map.inverse
    if inverse_map is not None:
        inverse_map = sp.ImmutableDenseMatrix(solved.xreplace(dict(zip(view.x, inverse_map, strict=True))))
    jacobian = (solved.jacobian(list(view.x)) * form.jacobian).applyfunc(straight.in_old)
    moved = replace(
        in_other_outputs(form, view, output_symbols(view.system)),
        map=replace(form.map, forward=forward, inverse=inverse_map, singular=straight.in_old(form.map.singular)),
        jacobian=sp.ImmutableDenseMatrix(jacobian),
    )
    return moved if check_observer_form(moved, test=SampledZero(seconds=0, near=here)).holds else None


def in_other_outputs(form: ObserverForm, view: ControlAffine, values: Sequence[sp.Expr]) -> ObserverForm:
    """The form with its injections in the outputs of another view of the plant.

    Args:
        form: the form.
        view: the other view.
        values: (p,) the form's outputs as functions of the view's output symbols.
    """
    onto: Mapping[sp.Symbol, sp.Expr] = dict(zip(form.y, values, strict=True))
    return replace(
        form,
        view=view,
        y=output_symbols(view.system),
        measured=tuple(e.xreplace(onto) for e in form.measured),
        drift_injection=form.drift_injection.xreplace(onto),
        input_injection=form.input_injection.xreplace(onto),
    )


def _explanation(verdict: Verdict) -> str:
    """One line on why there is no form, with the object that fails."""
    if verdict.holds:
        return f"it exists but was not written down: {verdict.evidence.get('reason', verdict.claim)}"
    because = verdict.rests_on or verdict.claim
    word = "fails" if verdict.status is Status.REFUTED else "is undecided"
    line = f"the condition '{because}' {word}"
    for name in ("i", "j", "k", "input", "output", "rank", "tried", "reason"):
        if name in verdict.evidence:
            line += f", {name} = {verdict.evidence[name]}"
    for name in ("bracket", "function"):
        if name in verdict.evidence:
            shown = verdict.evidence[name]
            entries = list(shown) if isinstance(shown, sp.MatrixBase) else [shown]
            text = ", ".join(formula(tidy(e, seconds=0.2)) for e in entries)
            line += f", {name} = ({text})" if len(text) < 300 else f", {name} too long to print"
    return line
