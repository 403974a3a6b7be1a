"""Nonlinear observer form (paper eq. 33-48): coordinates in which the state is linear up to functions of y and u.

z' = A z + γ(y, u), and in each block z_1' = γ_1, z_k' = z_{k−1} + γ_k, the last coordinate a function of the outputs.
With one output there is one block; A − L C then has any poles wanted and the error of the observer is linear.
Sources: Krener and Isidori, Syst. Contr. Lett. 3 (1983); Krener and Respondek, SIAM J. Contr. Opt. 23 (1985).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import sympy as sp

from ulna.base.errors import NoFormError
from ulna.base.verdict import Status, Verdict
from ulna.design.observers.bracket_conditions import ObserverConditions, observer_conditions
from ulna.design.observers.observer_blocks import search_blocks
from ulna.design.observers.observer_chain import ChainSearch, search_chain
from ulna.design.observers.observer_check import check_observer_form
from ulna.design.observers.output_functions import OutputSection, output_section
from ulna.design.observers.straightened import StraightenedPlant, straightened_plant
from ulna.geometry.diffeomorphism import Diffeomorphism, diffeomorphism, new_symbols
from ulna.geometry.observability import Observability, observability
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.exact.budget import attempt
from ulna.symbolic.exact.linear import inverse
from ulna.symbolic.exact.simplify import tidy
from ulna.symbolic.exact.zero import SampledZero
from ulna.symbolic.formulas.text import formula, listing
from ulna.symbolic.solving.branch import on_branch
from ulna.system import ControlAffine, System, control_affine, equilibrium, equilibrium_in_numbers

_SECONDS = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ObserverForm:
    """z' = A z + a(y) + c(y) u, measured(y) = C z.

    Attributes:
        view: the plant's control-affine view.
        indices: (p,) sizes of the blocks, in the order of the outputs.
        map: z = T(x), the inverse where it was found.
        jacobian: (n, n) ∂x/∂z in x, column k is ∂x/∂z_k (paper eq. 46).
        A: (n, n) shifts; C: (p, n) picks the last coordinate of each block.
        y: (p,) symbols of the outputs in the injection.
        measured: (p,) the last coordinates of the blocks as functions of y; y itself unless the output is transformed.
        drift_injection: (n, 1) a(y); input_injection: (n, m) c(y).
        verdict: on the form, by substitution.
    """

    view: ControlAffine
    indices: tuple[int, ...]
    map: Diffeomorphism
    jacobian: sp.ImmutableDenseMatrix
    A: sp.ImmutableDenseMatrix
    C: sp.ImmutableDenseMatrix
    y: tuple[sp.Symbol, ...]
    measured: tuple[sp.Expr, ...]
    drift_injection: sp.ImmutableDenseMatrix
    input_injection: sp.ImmutableDenseMatrix
    verdict: Verdict

    @property
    def system(self) -> System:
        """The plant."""
        return self.view.system

    @property
    def injection(self) -> sp.ImmutableDenseMatrix:
        """(n, 1) γ(y, u) = a(y) + c(y) u."""
        u = sp.Matrix(len(self.view.u), 1, list(self.view.u))
        return sp.ImmutableDenseMatrix(self.drift_injection + self.input_injection * u)

    @property
    def starting_fields(self) -> tuple[sp.ImmutableDenseMatrix, ...]:
        """(p,) ∂x/∂z of the first coordinate of each block (paper eq. 45)."""
        firsts = [sum(self.indices[:i]) for i in range(len(self.indices))]
        return tuple(self.jacobian[:, k] for k in firsts)

    def __repr__(self) -> str:
        rows = [*zip((z.name for z in self.map.new), self.map.forward, strict=True)]
        rows += [(f"γ{k + 1}", entry) for k, entry in enumerate(self.injection)]
        return listing(f"Observer form of '{self.system.name}', blocks of {', '.join(map(str, self.indices))}", rows)

    def _repr_latex_(self) -> str:
        from ulna.symbolic.formulas.latex import expression_latex

        return f"$$z = {expression_latex(self.map.forward)},\\quad \\gamma = {expression_latex(self.injection)}$$"


@dataclass(frozen=True, slots=True, kw_only=True)
class ObserverFormSearch:
    """Whether a plant has an observer form; the form where it was found.

    Attributes:
        system: the plant.
        form: the form, or None.
        verdict: on its existence; a refutation holds what fails (rank, bracket, or the function that is not one of y).
        conditions: the bracket conditions of a single-output plant, else None. Where the output is not a state they are
            those of the plant in coordinates with the output as a state; `evidence["coordinates"]` says which.
    """

    system: System
    form: ObserverForm | None
    verdict: Verdict
    conditions: ObserverConditions | None


def observer_form(system: PlantLike) -> ObserverForm:
    """The observer form of a plant with one or many outputs.

    Raises:
        NoFormError: if there is none or none was found; `value` is the `ObserverFormSearch` that says why.
        NotAffineError: if the plant is not affine in its inputs.
    """
    search = find_observer_form(as_plant(system))
    if search.form is not None:
        return search.form
    raise NoFormError(
        f"observer form of '{search.system.name}'",
        f"{explanation(search.verdict)}.",
        "Try an output transformation (transformed_observer_form), a high-gain observer or an extended Kalman filter.",
        value=search,
    )


@lru_cache(maxsize=64)
def find_observer_form(system: System) -> ObserverFormSearch:
    """The observer form, or the reason why there is none, as a value."""
    claim = f"'{system.name}' has an observer form"
    straight = straightened_plant(system)
    if straight is not None:
        return _in_old_coordinates(system, straight, find_observer_form(straight.system))
    seen = observability(system)
    conditions = observer_conditions(system) if len(system.outputs) == 1 else None
    known = seen.observable if conditions is None else conditions.exists
    if known.fails or (conditions is not None and not conditions.fields) or not seen.observable.holds:
        verdict = Verdict(claim=claim, status=known.status, evidence={"because": known.claim, **known.evidence})
        return ObserverFormSearch(system=system, form=None, verdict=verdict, conditions=conditions)
    result = attempt(_SECONDS, "search for the coordinates", _searched, seen, conditions, claim)
    form, verdict = result.value or (None, Verdict.undecided(claim, tried=result.reason))
    return ObserverFormSearch(
        system=system,
        form=form,
        verdict=Verdict(claim=claim, status=verdict.status, evidence={"because": verdict.claim, **verdict.evidence}),
        conditions=conditions,
    )


def _searched(
    seen: Observability, conditions: ObserverConditions | None, claim: str
) -> tuple[ObserverForm | None, Verdict]:
    section = output_section(seen.view)
    if conditions is not None:
        chain = search_chain(section, conditions.fields, section.y[0], claim)
    else:
        chain = search_blocks(section, seen, claim)
    if chain.coordinates is None:
        return None, chain.verdict
    form = assemble(section, chain)
    if form is None:
        return None, Verdict.undecided(claim, tried="the inverse of the Jacobian of the coordinates found")
    return (None if form.verdict.fails else form), form.verdict


def _in_old_coordinates(system: System, straight: StraightenedPlant, search: ObserverFormSearch) -> ObserverFormSearch:
    form = None if search.form is None else moved_back(system, straight, search.form)
    verdict = search.verdict if form is None else form.verdict
    if search.form is not None and form is None:
        verdict = Verdict.undecided(search.verdict.claim, tried="the form found in straightened coordinates moved back")
    return ObserverFormSearch(
        system=system,
        form=form,
        verdict=Verdict(
            claim=search.verdict.claim,
            status=verdict.status,
            evidence={"because": verdict.claim, **verdict.evidence, "coordinates": dict(straight.meaning)},
        ),
        conditions=search.conditions,
    )


def moved_back(system: System, straight: StraightenedPlant, form: ObserverForm) -> ObserverForm | None:
    """The form of the straightened plant in the plant's own coordinates by the chain rule, sampled there once more."""
    view = control_affine(system)
    section = output_section(view)
    rename = dict(zip(form.y, section.y, strict=True))
    here = equilibrium_in_numbers(system).where
    forward = sp.ImmutableDenseMatrix(form.map.forward.applyfunc(lambda e: on_branch(straight.in_old(e), here)))
    solved = sp.Matrix([straight.solved.get(x, x) for x in view.x])
    inverse_map = form.map.inverse
    if inverse_map is not None:
        onto = dict(zip(view.x, inverse_map, strict=True))
        inverse_map = sp.ImmutableDenseMatrix([e.xreplace(onto) for e in solved])
    jacobian = (solved.jacobian(list(view.x)) * form.jacobian).applyfunc(straight.in_old)
    moved = replace(
        form,
        view=view,
        map=replace(form.map, forward=forward, inverse=inverse_map, singular=straight.in_old(form.map.singular)),
        jacobian=sp.ImmutableDenseMatrix(jacobian),
        y=section.y,
        measured=tuple(e.xreplace(rename) for e in form.measured),
        drift_injection=form.drift_injection.xreplace(rename),
        input_injection=form.input_injection.xreplace(rename),
    )
    sampled = check_observer_form(
        section,
        forward,
        moved.indices,
        moved.drift_injection,
        moved.input_injection,
        measured=moved.measured,
        test=SampledZero(seconds=0, near=here),
    )
    return moved if sampled.holds else None


def assemble(section: OutputSection, chain: ChainSearch) -> ObserverForm | None:
    """The form of found coordinates and injections, checked by substitution; None if ∂T/∂x could not be inverted."""
    view = section.view
    n = len(view.x)
    T = sp.ImmutableDenseMatrix(n, 1, list(chain.coordinates or ()))
    inverted = inverse(sp.Matrix(T.jacobian(list(view.x))))
    if inverted.solution is None:
        return None
    verdict = check_observer_form(
        section, T, chain.indices, chain.drift_injection, chain.input_injection, measured=chain.measured
    )
    A, C = shift_matrices(chain.indices)
    z = new_symbols("z", n, (*view.x, *view.u, *section.y, *view.system.parameter_symbols))
    return ObserverForm(
        view=view,
        indices=chain.indices,
        map=diffeomorphism(
            T, view.x, z, near=equilibrium(view.system).states, singular=tidy(inverted.determinant, seconds=0.2)
        ),
        jacobian=sp.ImmutableDenseMatrix(inverted.solution),
        A=A,
        C=C,
        y=section.y,
        measured=chain.measured,
        drift_injection=chain.drift_injection,
        input_injection=chain.input_injection,
        verdict=verdict,
    )


def shift_matrices(indices: tuple[int, ...]) -> tuple[sp.ImmutableDenseMatrix, sp.ImmutableDenseMatrix]:
    """A (n, n) with z_k' = z_{k−1} in each block and C (p, n) that picks each block's last coordinate (eq. 33)."""
    n = sum(indices)
    A, C = sp.zeros(n, n), sp.zeros(len(indices), n)
    start = 0
    for i, size in enumerate(indices):
        for k in range(1, size):
            A[start + k, start + k - 1] = 1
        start += size
        C[i, start - 1] = 1
    return sp.ImmutableDenseMatrix(A), sp.ImmutableDenseMatrix(C)


def explanation(verdict: Verdict) -> str:
    """One line on why there is no form, with the object that fails."""
    if verdict.holds:
        return f"it exists but was not written down: {verdict.evidence.get('reason', verdict.claim)}"
    because = verdict.evidence.get("because", verdict.claim)
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
