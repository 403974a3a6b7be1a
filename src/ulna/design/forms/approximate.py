"""Approximate input-output linearisation: terms that spoil the relative degree at the operating point are left out.

Source: J. Hauser, S. Sastry, P. Kokotović, "Nonlinear control via approximate input-output linearization: the ball and
beam example", IEEE Trans. Automatic Control 37 (1992).
"""

from __future__ import annotations

import sympy as sp

from ulna.base import NoFormError, Verdict
from ulna.design.forms.linearising_form import LinearisingForm, form_of
from ulna.geometry import RelativeDegree, lie_derivative
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.exact import is_zero, tidy
from ulna.symbolic.formulas import formula, put_in
from ulna.system import control_affine, equilibrium


def approximate_form(system: PlantLike) -> LinearisingForm:
    """The chain h, L_f h, … of one output, without terms of the one input that vanish at the operating point.

    Where L_g L_f^{k−1} h vanishes at the point but not around it the term with the input is dropped and the
    differentiation goes on until the input appears with a factor that does not vanish there. What is dropped is of
    second order near the point where the input rests at zero. The form's verdict is refuted: `dropped` in its evidence
    tells the terms.

    Raises:
        NoFormError: if the plant has another number of inputs or outputs, nothing has to be dropped, or no such factor
            is met in as many derivatives as there are states.
    """
    system = as_plant(system)
    asked = f"approximate input-output form of '{system.name}'"
    if len(system.inputs) != 1 or len(system.outputs) != 1:
        found = f"it has {len(system.outputs)} outputs and {len(system.inputs)} inputs."
        raise NoFormError(asked, found, "It is for one output and one input.")
    view, point = control_affine(system), equilibrium(system).where
    chain, dropped, beta = [view.h[0]], [], sp.Integer(0)
    for k in range(1, len(view.x) + 1):
        beta = tidy(lie_derivative(chain[-1], view.g, view.x), seconds=0.2)
        chain.append(tidy(lie_derivative(chain[-1], view.f, view.x), seconds=0.2))
        if not is_zero(put_in(beta, point)).holds:
            break
        if not is_zero(beta).holds:
            dropped.append(f"{formula(beta * view.u[0])} in derivative {k} of {system.outputs[0].name}")
    else:
        raise NoFormError(asked, "no derivative of the output contains the input with a factor at the operating point.")
    if not dropped:
        raise NoFormError(asked, "nothing has to be dropped.", "Use `input_output_form`.")
    claim = "the input enters at the end of the chain only"
    relative = RelativeDegree(
        view=view,
        outputs=(view.h[0],),
        per_output=(len(chain) - 1,),
        decoupling=sp.ImmutableDenseMatrix([[beta]]),
        lie_chain=(tuple(chain),),
        invertible=Verdict.proved("the factor of the input is not zero", singular=beta),
        at_point=Verdict.proved("the factor of the input is not zero at the operating point"),
        singular=beta,
        point=equilibrium(system).states,
        certainty=Verdict.refuted(claim, dropped=tuple(dropped)),
    )
    return form_of(relative, relative.certainty)
