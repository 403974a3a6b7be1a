"""Input-output linearisation of square plants: y_i^(r_i) = v_i by static feedback (Isidori, sections 4.1 and 5.3)."""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

from ulna.base import NoFormError, Verdict
from ulna.design.forms.linearising_form import LinearisingForm, form_of
from ulna.geometry import RelativeDegree, relative_degree, relative_degree_of
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.formulas import formula
from ulna.system import System, equilibrium


def input_output_form(system: PlantLike, *, at: Mapping[sp.Symbol, sp.Expr] | None = None) -> LinearisingForm:
    """The input-output linearising law of a square plant.

    Args:
        system: as many outputs as inputs.
        at: a point (value by state symbol) at which the law must be defined. Left out, it need only be defined on
            an open dense set, and `at_point` tells about the operating point.

    Raises:
        NoFormError: if the plant is not square, an output is never reached by an input, or the decoupling matrix is
            singular, generically or at the point asked for. Its value is the `Verdict` that says so.

    Examples:
        >>> ulna.input_output_form("cart_pole").indices
        (2,)
    """
    system = as_plant(system)
    asked = f"input-output form of '{system.name}'"
    _require_square(system, asked)
    degree = relative_degree(system)
    if at is not None:
        point = {**equilibrium(system).where, **at}
        degree = relative_degree_of(degree.outputs, degree.view, point=point)
    _require_invertible(degree, asked)
    form = form_of(degree, degree.invertible)
    if at is not None and not form.at_point.holds:
        raise NoFormError(
            asked,
            f"the decoupling matrix is singular at the point asked for: {formula(form.singular)} = 0 there.",
            "The law exists away from it; dynamic extension may help with two or more inputs.",
            value=form.at_point,
        )
    return form


def _require_square(system: System, asked: str) -> None:
    outputs, inputs = len(system.outputs), len(system.inputs)
    if not outputs or not inputs:
        missing = "outputs" if inputs else "inputs"
        claim = "the plant has inputs and outputs"
        raise NoFormError(asked, f"it has no {missing}.", f"Add [{missing}].", value=Verdict.refuted(claim))
    if outputs != inputs:
        raise NoFormError(
            asked,
            f"it has {outputs} outputs and {inputs} inputs.",
            "Choose as many outputs as inputs.",
            value=Verdict.refuted("the plant is square", outputs=outputs, inputs=inputs),
        )


def _require_invertible(degree: RelativeDegree, asked: str) -> None:
    if degree.invertible.holds:
        return
    if None in degree.per_output:
        names = [degree.view.system.outputs[k].name for k, r in enumerate(degree.per_output) if r is None]
        found, hint = f"no input ever reaches the output {', '.join(names)}.", "Choose another output."
    elif degree.invertible.fails:
        found = f"the decoupling matrix {degree.decoupling.tolist()} is singular everywhere."
        hint = "Try `dynamic_extension`."
    else:
        found, hint = "the rank of the decoupling matrix could not be decided.", ""
    raise NoFormError(asked, found, hint, value=degree.invertible)
