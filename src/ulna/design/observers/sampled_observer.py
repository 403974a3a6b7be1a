"""The exact observer in its own coordinates, ready to be discretised exactly (paper eq. 49-51)."""

from __future__ import annotations

import sympy as sp

from ulna.design.control.gains import AbstractGainRule
from ulna.design.observers.observer import exact_observer_in_form_coordinates
from ulna.design.observers.observer_form import ObserverForm
from ulna.system.linear_injection import LinearInjection


def injected_observer(form: ObserverForm, gains: AbstractGainRule) -> LinearInjection:
    """ẑ' = (A − L C) ẑ + γ(y, u) + L ψ(y), x̂ = T⁻¹(ẑ), split into its linear part and what is injected.

    Args:
        form: the observer form.
        gains: poles of A − L C, block after block.

    Raises:
        DesignError: if the inverse map is not known or the gain rule does not fit the blocks.
    """
    observer = exact_observer_in_form_coordinates(form, gains)
    matrix = sp.ImmutableDenseMatrix(form.A - observer.gains * form.C)
    injection = sp.Matrix(form.injection) + observer.gains * sp.Matrix(form.measured)
    hats = {s.symbol: sp.Symbol(f"{s.name}_hat", real=True) for s in form.system.states}
    known = form.system.values
    return LinearInjection(
        system=observer.system,
        matrix=sp.ImmutableDenseMatrix(matrix.xreplace(known)),
        injection=tuple(injection),
        start=tuple(expression.xreplace(hats) for expression in form.map.forward),
    )
