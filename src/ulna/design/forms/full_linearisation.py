"""The controller form of a plant: linearising outputs whose chains are the whole state (paper section 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import sympy as sp

from ulna.base import DesignError, NoFormError, Verdict, all_of
from ulna.design.forms.linearisability_conditions import Linearisability, linearises
from ulna.design.forms.linearising_form import LinearisingForm, form_of
from ulna.design.forms.output_search import LinearisingOutputs, linearising_outputs
from ulna.geometry import RelativeDegree, accessible, relative_degree, relative_degree_of
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.exact import attempt
from ulna.symbolic.formulas import formula
from ulna.system import NON_SMOOTH, ControlAffine, System, control_affine

_SECONDS = 2.0
"""s, for brackets that only explain a refusal."""


def controller_form(system: PlantLike, outputs: Sequence[sp.Expr] | None = None, **misplaced: Any) -> LinearisingForm:
    """The controller form of a plant, for the given outputs or for ones that are found.

    For one input and q closed up to a constant, T₁ = ∫q with T₁ = 0 where the output that was found is 0, so that
    z_n' = f_n(z) + u exactly as in eq. 22.

    Args:
        system: the plant.
        outputs: (m,) functions of the state to use; left out, they are found.
        misplaced: no other argument is taken; poles are refused with what to do.

    Raises:
        DesignError: for poles or gains, which belong to the law.
        NoFormError: if the plant has no such form or none was found; its `value` is the verdict's owner.
        NotAffineError: if the plant is not affine in its inputs.
        UlnaError: if something that has to be differentiated is not smooth.

    Examples:
        >>> ulna.controller_form("duffing").indices
        (2,)
    """
    if misplaced:
        raise DesignError(
            f"controller form with {', '.join(misplaced)}",
            "a form takes the plant and its outputs; poles and gains belong to a law.",
            "Use state_feedback(plant, poles), which takes the controller form by itself.",
        )
    return _controller_form(as_plant(system), None if outputs is None else tuple(outputs))


@lru_cache(maxsize=32)
def _controller_form(system: System, outputs: tuple[sp.Expr, ...] | None) -> LinearisingForm:
    view = control_affine(system)
    if not view.u:
        raise NoFormError(_named(view), "it has no controller form: there are no inputs.", "Look at its observer form.")
    if outputs is not None:
        relative = relative_degree(system) if outputs == tuple(view.h) else relative_degree_of(outputs, view)
        verdict = linearises(relative)
        if not verdict.holds:
            raise NoFormError(
                f"{_named(view)} with the outputs {', '.join(map(formula, outputs))}",
                f"there is no controller form: {_reason(verdict)}.",
                "Leave the outputs out to have them found, or use `input_output_form`.",
                value=relative,
            )
        return _form(relative, verdict)
    if view.f.has(*NON_SMOOTH) or view.g.has(*NON_SMOOTH):
        # Brackets differentiate all of it; the given outputs only what they reach, and that may be smooth enough.
        relative = relative_degree(system) if len(view.h) == len(view.u) else None
        verdict = None if relative is None else linearises(relative)
        if relative is not None and verdict is not None and verdict.holds:
            return _form(relative, verdict)
    found = linearising_outputs(system)
    if found.functions is None or found.relative_degree is None:
        raise _no_form(found)
    return _form(_scaled(found.relative_degree), found.verdict)


def _scaled(relative: RelativeDegree) -> RelativeDegree:
    """T₁ divided by β where β is free of the states: then dT₁ = q exactly (one input only)."""
    gain = relative.decoupling[0, 0]
    if len(relative.outputs) != 1 or gain == 1 or gain.free_symbols & set(relative.view.x):
        return relative
    one = sp.Integer(1)
    return replace(
        relative,
        outputs=(relative.outputs[0] / gain,),
        lie_chain=(tuple(e / gain for e in relative.lie_chain[0]),),
        decoupling=sp.ImmutableDenseMatrix([[one]]),
        singular=one,
        invertible=Verdict.proved(relative.invertible.claim, rank=1, point={}, singular=one),
    )


def _form(relative: RelativeDegree, verdict: Verdict) -> LinearisingForm:
    return form_of(relative, all_of("the plant has this controller form", [verdict, linearises(relative)]))


def _named(view: ControlAffine) -> str:
    n, m = len(view.x), len(view.u)
    return f"'{view.system.name}' ({n} state{'s' * (n != 1)}, {m} input{'s' * (m != 1)})"


def _reason(verdict: Verdict) -> str:
    return str(verdict.evidence.get("reason") or verdict.rests_on or verdict.claim)


def _no_form(found: LinearisingOutputs) -> NoFormError:
    conditions = found.linearisability
    view = conditions.accessibility.view
    asked = _named(view)
    if conditions.verdict.fails:
        hint = "Try `input_output_form` for a part of the state."
        if len(view.u) == 1:
            hint = "Dynamic extension cannot help with one input; try `input_output_form`."
        return NoFormError(asked, f"it has no controller form: {_broken(conditions)}.", hint, value=conditions)
    if found.verdict.fails:
        return NoFormError(
            asked, f"it has no controller form: {_reason(found.verdict)}.", "Leave those inputs out.", value=found
        )
    return NoFormError(
        asked,
        "no controller form was found: the conditions hold as far as was decided, but no linearising outputs came "
        f"out of {found.verdict.evidence.get('tried', 'the search')}.",
        "Give `outputs=` if you know them, or use `input_output_form`.",
        value=found,
    )


def _broken(conditions: Linearisability) -> str:
    """Which rank or bracket says no, in words."""
    found = conditions.accessibility
    n = len(found.view.x)
    if found.controllable.fails:
        fields = ", ".join(dict.fromkeys(found.name_of(field) for level in found.levels for field in level))
        return f"span{{{fields}}} has rank {found.rank} instead of {n}{_accessible(found.view.system, n)}"
    evidence = conditions.involutive.evidence
    if "bracket" not in evidence:
        return (
            f"brackets leave G_{evidence['level']}, the span of ad_f^k g, k <= {evidence['level']}: "
            f"rank {evidence['rank_with_brackets']} instead of {evidence['rank']} at a point tried in numbers"
        )
    at = ", ".join(f"{s} = {float(v):.3g}" for s, v in evidence["point"].items())
    near = f" near {at}" if at else ""
    return (
        f"{evidence['bracket']} leaves span{{{', '.join(evidence['span'])}}}{near}, "
        f"rank {evidence['rank_after']} instead of {evidence['rank_before']}"
    )


def _accessible(system: System, n: int) -> str:
    """What that says about reaching states, where it is known: brackets of the inputs with each other count there."""
    found = attempt(_SECONDS, "accessibility", accessible, system).value
    if found is None:
        return ""
    verdict, dimension = found
    if verdict.holds:
        return f" (the plant is accessible all the same: brackets of the inputs with each other make it {n})"
    return f", and brackets of all fields reach no more than {dimension} dimensions: part of the state moves by itself"
