"""Output transformations ỹ = ψ(y) that give a plant the observer form it lacks in y.

Several outputs are the matter of `transformed_blocks`. With one output the starting field of ỹ is τ/s(y), s = ψ'.
Writing out the brackets of its chain leaves one equation for s. With λ = 1/s, [λτ, ad_f^{n−1}(λτ)] = 0 says for even
n, and [ad_f(λτ), ad_f^{n−1}(λτ)] = 0 for odd n (bracket of eq. 19),

    n even:  [τ, ad_f^{n−1} τ] = 2 (s'/s) τ,    n odd:  [ad_f τ, ad_f^{n−1} τ] = n (s'/s) ad_f τ + (…) τ,

so φ = s'/s is read off with the covectors L_f^{n−1} dh or L_f^{n−2} dh and must be a function of y alone. ψ is unique
up to a scale and a constant, so failure of the form for this ψ refutes every ψ. Sources: for n = 2, 3 Keller, Int. J.
Control 46 (1987); the general theory in Krener and Respondek, SIAM J. Contr. Opt. 23 (1985).
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import sympy as sp

from ulna.base import Verdict, all_of
from ulna.design.observers.bracket_conditions import (
    ObserverConditions,
    chain_of_fields,
    vanishes,
)
from ulna.design.observers.linear_error_form import ObserverForm, assembled
from ulna.design.observers.observer_chain import NotOfOutputsError, of_outputs, search_chain
from ulna.design.observers.observer_coordinates import (
    ObserverFormSearch,
    find_observer_form,
    in_old_coordinates,
    required_form,
)
from ulna.design.observers.output_functions import OutputSection, exponential, integral_over_output, output_section
from ulna.design.observers.straightened import straightened_plant
from ulna.design.observers.transformed_blocks import (
    OutputFunctions,
    in_measured_outputs,
    output_functions,
    with_outputs_replaced,
)
from ulna.geometry import lie_bracket, observability
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.exact import attempt, lowest_terms, tidy
from ulna.symbolic.formulas import formula, is_elementary
from ulna.system import System

_SECONDS = 10.0
_SEVERAL_SECONDS = 1.5


def transformed_observer_form(system: PlantLike) -> ObserverForm:
    """The observer form of a plant after a transformation of each output, the identity where that suffices.

    Raises:
        NoFormError: if there is none or none was found; `value` is the `ObserverFormSearch` that says why.

    Examples:
        >>> ulna.transformed_observer_form("duffing").indices
        (2,)
    """
    hint = "A high-gain observer or an extended Kalman filter does not need the form."
    return required_form(output_transformation(as_plant(system)), hint, after=" with an output transformation")


@lru_cache(maxsize=64)
def output_transformation(system: System) -> ObserverFormSearch:
    """ψ and the form with measured outputs ψ(y), or the reason why there is none, as a value.

    Refuted with the quantity that is not a function of y alone; the evidence's `slope` is ψ', `psi` ψ itself.
    """
    claim = f"'{system.name}' has an observer form after an output transformation"
    plain = find_observer_form(system)
    if plain.form is not None:
        y = plain.form.y
        psi = "y" if len(y) == 1 else tuple(str(s) for s in y)
        return replace(
            plain, verdict=replace(plain.verdict, claim=claim, evidence={"psi": psi, **plain.verdict.evidence})
        )
    if len(system.outputs) > 1:
        return _of_several(plain, claim)
    straight = straightened_plant(system)
    if straight is not None:
        return in_old_coordinates(system, straight, output_transformation(straight.system))
    conditions = plain.conditions
    if conditions is None:
        return _none(system, Verdict.undecided(claim, reason="the plant has no output"))
    hopeless = conditions.commuting.evidence.get("any_psi", False)
    if not conditions.observability.observable.holds or conditions.starting_field is None or hopeless:
        why = plain.verdict
        if why.fails and why.evidence.get("any_psi") is False:
            why = Verdict.undecided(why.claim, tried="the starting field is too large to write down")
        return _none(system, replace(why, claim=claim))
    found = attempt(_SECONDS, "output transformation", _of_one, conditions, claim)
    return found.value or _none(system, Verdict.undecided(claim, tried=found.reason))


def _of_several(plain: ObserverFormSearch, claim: str) -> ObserverFormSearch:
    """One function for each output; a no only where no other way to transform the outputs is left."""
    system = plain.system
    if not observability(system).observable.holds or 0 in observability(system).indices:
        return _none(system, replace(plain.verdict, claim=claim))
    found = attempt(_SEVERAL_SECONDS, "output transformations", _functions_or_verdict, system)
    if not isinstance(found.value, OutputFunctions):
        undecided = Verdict.undecided(claim, tried=found.reason)
        return _none(system, undecided if found.value is None else found.value.restated(claim))
    psi = found.value
    changed = psi.functions != psi.symbols
    search = find_observer_form(with_outputs_replaced(system, psi)) if changed else plain
    shown = tuple(formula(e) for e in psi.functions)
    if changed and search.form is not None:
        form = in_measured_outputs(system, search.form, psi)
        verdict = replace(form.verdict, claim=claim, evidence={"psi": shown, **form.verdict.evidence})
        return ObserverFormSearch(system=system, form=form, verdict=verdict)
    verdict = search.verdict.restated(claim, psi=shown)
    if verdict.fails and not psi.unique:
        verdict = Verdict.undecided(claim, **{"tried": "one function for each output", **verdict.evidence})
    return _none(system, verdict)


def _functions_or_verdict(system: System) -> OutputFunctions | Verdict:
    straight = straightened_plant(system)
    try:
        return output_functions(system if straight is None else straight.system)
    except NotOfOutputsError as failure:
        return failure.verdict


def _of_one(conditions: ObserverConditions, claim: str) -> ObserverFormSearch:
    system = conditions.system
    section = output_section(conditions.observability.view)
    y = section.y[0]
    try:
        slope = _slope(section, conditions)
        if slope == 1:
            why = conditions.exists if conditions.exists.fails else find_observer_form(system).verdict
            return _none(system, why.restated(claim, because=why.claim, psi="y at most"))
        # Before an integral is sought: ψ' alone tells whether the brackets of the form in ψ(y) vanish.
        start = (conditions.fields[0] / section.at_states(slope)).applyfunc(lowest_terms)
        fields, commuting, inputs = chain_of_fields(section.view, start)
        exists = all_of(claim, [commuting, inputs])
        if exists.fails:
            return _none(system, exists.restated(claim, slope=slope))
        psi = integral_over_output(section, slope)
        if psi is None or not is_elementary(psi):
            # The brackets vanish, so the form exists; without ψ in formulas nothing can be built on it.
            return _none(system, exists.restated(claim, slope=slope, reason=f"∫ {slope} d{y} is not elementary"))
        factor, psi = sp.factor_terms(psi).as_independent(y, as_Add=False)
        chain = search_chain(section, [(field * factor).applyfunc(lowest_terms) for field in fields], psi)
    except NotOfOutputsError as failure:
        return _none(system, failure.verdict.restated(claim))
    form = assembled(section, chain)
    if form is None:
        tried = "the inverse of the Jacobian of the coordinates found"
        return _none(system, Verdict.undecided(claim, tried=tried, psi=psi))
    verdict = form.verdict.restated(claim, psi=psi)
    return ObserverFormSearch(system=system, form=None if verdict.fails else form, verdict=verdict)


def _slope(section: OutputSection, conditions: ObserverConditions) -> sp.Expr:
    """ψ' = exp(∫ φ dy) in the output symbol, up to a factor; 1 where no transformation can help.

    Raises:
        NotOfOutputsError: if φ is not a function of y, or its integral is not found.
    """
    y = section.y[0]
    phi = of_outputs(section, curvature(conditions), "ψ''/ψ'")
    if phi == 0:
        return sp.Integer(1)
    exponent = integral_over_output(section, phi)
    if exponent is None:
        raise NotOfOutputsError(Verdict.undecided("ψ' in closed form", tried=f"∫ {phi} d{y}"))
    return exponential(exponent, y)


def curvature(conditions: ObserverConditions) -> sp.Expr:
    """φ(x) = ψ''/ψ' as the brackets demand it, the same for every ψ that works; 0 for one state.

    Raises:
        NotOfOutputsError: if brackets that no ψ can change do not vanish.
    """
    view = conditions.observability.view
    n = len(view.x)
    if n == 1:
        return sp.Integer(0)
    start = conditions.starting_field
    chain = [sp.ImmutableDenseMatrix(start)]
    for _ in range(n - 1):
        chain.append(lie_bracket(view.f, chain[-1], view.x).applyfunc(lowest_terms))
    odd = n % 2
    # No factor λ(y) on τ changes these: for them only L_τ L_f^k λ with k + 1 < n occur, and those vanish.
    for k in range(1, n - 1 + odd):
        fixed = lie_bracket(chain[0], chain[k], view.x)
        verdict = vanishes(fixed)
        if verdict.fails:
            claim = f"[τ, ad_f^{k} τ] = 0, which no output transformation changes"
            raise NotOfOutputsError(Verdict.refuted(claim, **{**verdict.evidence, "bracket": fixed}))
    bracket = lie_bracket(chain[odd], chain[n - 1], view.x)
    covector = conditions.observability.matrix[n - 1 - odd, :]
    return tidy((covector * bracket)[0] / (n if odd else 2), seconds=1.0)


def _none(system: System, verdict: Verdict) -> ObserverFormSearch:
    return ObserverFormSearch(system=system, form=None, verdict=verdict)
