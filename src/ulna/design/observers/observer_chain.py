"""The coordinates of an observer form, from the output downwards: z_n = ψ(h), z_{k−1} = L_f z_k − a_k(y).

The slope a_k' is read off before a_k is known: a_k' = dz_k(ad_f^n τ), because dz_{k−1} does not see ad_f^{n−1} τ. So
the only integrals are over the single variable y, and no one-form has to be integrated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import sympy as sp

from ulna.base import Verdict
from ulna.design.observers.output_functions import OutputSection, integral_over_output
from ulna.geometry import lie_bracket, lie_derivative
from ulna.symbolic.exact import lowest_terms, tidy

_SECONDS = 0.4


@dataclass(frozen=True, slots=True, kw_only=True)
class ObserverChain:
    """Coordinates and injections of an observer form as they were found, not yet checked by substitution.

    Attributes:
        coordinates: (n,) z in x, block after block.
        indices: sizes of the blocks.
        measured: (p,) the last coordinates in the output symbols.
        drift_injection: (n, 1) a(y); input_injection: (n, m) c(y).
    """

    coordinates: tuple[sp.Expr, ...]
    indices: tuple[int, ...]
    measured: tuple[sp.Expr, ...]
    drift_injection: sp.ImmutableDenseMatrix
    input_injection: sp.ImmutableDenseMatrix


class NotOfOutputsError(Exception):
    """A function that had to be one of the outputs is not, or could not be written or integrated as one."""

    def __init__(self, verdict: Verdict) -> None:
        self.verdict = verdict
        super().__init__(str(verdict))


def search_chain(section: OutputSection, fields: Sequence[sp.MatrixBase], psi: sp.Expr) -> ObserverChain:
    """The chain of a single output ỹ = ψ(y).

    Args:
        section: the plant with its output symbol.
        fields: τ with dψ(ad_f^{n−1} τ) = 1 and dL_f^k ψ(τ) = 0 for k < n − 1, ad_f τ, … as far as known.
        psi: ψ in the output symbol; the symbol itself for the plain form.

    Raises:
        NotOfOutputsError: refuted with the function that is not one of y, undecided with what was tried.
    """
    view, y = section.view, section.y[0]
    n = len(view.x)
    weight = section.at_states(psi.diff(y))
    chain = [sp.ImmutableDenseMatrix(field) for field in fields]
    while len(chain) < n:
        chain.append(lie_bracket(view.f, chain[-1], view.x).applyfunc(lowest_terms))
    top = lie_bracket(view.f, chain[n - 1], view.x)
    z = [section.at_states(psi)]
    injections: list[sp.Expr] = []
    for k in range(n, 0, -1):
        rate = lie_derivative(z[0], view.f, view.x)
        if k == 1:
            injections.insert(0, of_outputs(section, rate, f"a_{k}(y)"))
            break
        steepness = of_outputs(section, lie_derivative(z[0], top, view.x) * weight, f"a_{k}'(y)")
        injection = integral_over_output(section, steepness)
        if injection is None:
            raise NotOfOutputsError(Verdict.undecided(f"a_{k}(y) in closed form", tried=f"∫ {steepness} d{y}"))
        below, constant = without_constant(tidy(rate - section.at_states(injection), seconds=_SECONDS), view.x)
        injections.insert(0, injection + constant)
        z.insert(0, below)
    return ObserverChain(
        coordinates=tuple(z),
        indices=(n,),
        measured=(psi,),
        drift_injection=sp.ImmutableDenseMatrix(n, 1, injections),
        input_injection=input_coefficients(section, z),
    )


def of_outputs(section: OutputSection, function: sp.Expr, what: str) -> sp.Expr:
    """The function written in the output symbols.

    Raises:
        NotOfOutputsError: if it depends on more, or could not be written so.
    """
    verdict = section.depends_on_outputs_only(function)
    if not verdict.holds:
        raise NotOfOutputsError(replace(verdict, claim=f"{what} is a function of the outputs"))
    found = section.in_outputs(function)
    if found is None:
        raise NotOfOutputsError(
            Verdict.undecided(
                f"{what} written in the outputs", tried="solving the outputs for states", function=function
            )
        )
    return found


def input_coefficients(section: OutputSection, coordinates: list[sp.Expr]) -> sp.ImmutableDenseMatrix:
    """(n, m) c(y) with L_g z = c(h(x)).

    Raises:
        NotOfOutputsError: if a coefficient is not a function of the outputs: the input condition fails.
    """
    view = section.view
    entries = [
        of_outputs(section, lie_derivative(z, column, view.x), f"the coefficient of {signal.name} in z_{k + 1}'")
        for k, z in enumerate(coordinates)
        for signal, column in zip(view.system.inputs, view.input_fields, strict=True)
    ]
    return sp.ImmutableDenseMatrix(len(coordinates), len(view.u), entries)


def without_constant(expression: sp.Expr, states: tuple[sp.Symbol, ...]) -> tuple[sp.Expr, sp.Expr]:
    """The expression without, and separately, the terms that hold no state: any constant may be shifted into a(y)."""
    constant = sp.expand(expression).as_independent(*states, as_Add=True)[0]
    if constant == 0:
        return expression, constant
    return tidy(expression - constant, seconds=_SECONDS), constant
