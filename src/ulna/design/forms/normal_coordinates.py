"""The normal form of a square plant: chains of integrators and internal states (Isidori, sections 4.1 and 5.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from ulna.base import Verdict
from ulna.design.forms.input_output import input_output_form
from ulna.design.forms.linearising_form import LinearisingForm
from ulna.geometry import Diffeomorphism, diffeomorphism, distribution, first_integrals, lie_derivative, new_symbols
from ulna.plants import PlantLike
from ulna.symbolic.exact import SampledZero, are_zero, generic_rank, is_zero, minor_determinant, rank_at, tidy
from ulna.system import System, equilibrium_in_numbers

_QUICK = SampledZero(seconds=0.3)
_CLAIM = "the internal coordinates are free of the inputs"


@dataclass(frozen=True, slots=True, kw_only=True)
class NormalForm:
    """ξ_i^(r_i) = α_i + β_i u with internal coordinates η, where possible such that η' = q(ξ, η) without u.

    Attributes:
        form: the chains, with α and β.
        internal: (n − Σ r,) η as functions of x.
        slopes: (n − Σ r, m) L_g η in x; zero where `input_free` holds.
        rates: (n − Σ r,) L_f η in x.
        input_free: whether L_g η = 0: refuted with the bracket if span{g} is not involutive, undecided if the
            partial differential equation was not solved. η then completes the chain without that property.
        map: z = (ξ, η) as a change of coordinates.
    """

    form: LinearisingForm
    internal: tuple[sp.Expr, ...]
    slopes: sp.ImmutableDenseMatrix
    rates: tuple[sp.Expr, ...]
    input_free: Verdict
    map: Diffeomorphism

    @property
    def system(self) -> System:
        """The plant."""
        return self.form.system

    @property
    def coordinates(self) -> tuple[sp.Expr, ...]:
        """All n coordinates: the chains first, then η."""
        return tuple(self.map.forward)

    def _repr_latex_(self) -> str:
        return self.map._repr_latex_()


def normal_form(system: PlantLike, *, seconds: float = 4.0) -> NormalForm:
    """The normal form of a square plant whose decoupling matrix is generically invertible.

    Internal coordinates are sought among the functions that are constant along the input fields: states, then simple
    functions. They exist if and only if span{g_1, …, g_m} is involutive, always so for one input.

    Args:
        system: as many outputs as inputs.
        seconds: s, for the search.

    Raises:
        NoFormError: if there is no input-output form.

    Examples:
        >>> form = ulna.normal_form("cart_pole")
        >>> form.input_free.holds, len(form.internal)
        (True, 2)
    """
    form = input_output_form(system)
    system = form.system
    view, point = form.view, equilibrium_in_numbers(system).where
    missing = form.internal_dimension
    internal: tuple[sp.Expr, ...] = ()
    input_free = Verdict.proved(_CLAIM, reason="there are none")
    if missing:
        integrals, reason = _constant_along_inputs(form, seconds)
        chosen = _completed(form.chain, integrals, view.x, point, missing)
        if chosen is not None:
            internal = tuple(_zero_at_point(h, view.x, point) for h in chosen)
            input_free = _checked(internal, form)
        else:
            rest = _completed(form.chain, [*integrals, *view.x], view.x, point, missing)
            internal = tuple(rest or ())
            input_free = reason
    forward = sp.ImmutableDenseMatrix([*form.chain, *internal])
    jacobian = sp.Matrix(forward.jacobian(list(view.x)))
    rank = generic_rank(jacobian, seconds=0.0)
    new = new_symbols("z", len(view.x), (*view.x, *system.parameter_symbols, *system.input_symbols))
    return NormalForm(
        form=form,
        internal=internal,
        slopes=sp.ImmutableDenseMatrix(len(internal), len(view.u), _slopes(internal, form)),
        rates=tuple(tidy(lie_derivative(h, view.f, view.x), seconds=0.2) for h in internal),
        input_free=input_free,
        map=diffeomorphism(
            forward, view.x, new, near=point, singular=minor_determinant(jacobian, rank, seconds=0.5), seconds=1.0
        ),
    )


def _constant_along_inputs(form: LinearisingForm, seconds: float) -> tuple[list[sp.Expr], Verdict]:
    """First integrals of span{g}, and the verdict to give if they do not suffice."""
    view = form.view
    states = [x for k, x in enumerate(view.x) if all(view.g[k, j] == 0 for j in range(view.g.cols))]
    near = equilibrium_in_numbers(form.system).states
    found = first_integrals(distribution(view.input_fields, view.x), near=near, seconds=seconds)
    if found.verdict.fails:
        evidence = {**found.verdict.evidence, "reason": "the input fields do not span an involutive distribution"}
        return list(states), Verdict.refuted(_CLAIM, **evidence)
    functions = [h for h in found.found if h not in states]
    reason = Verdict.undecided(_CLAIM, tried=found.verdict.claim, found=found.found)
    return [*states, *sorted(functions, key=sp.count_ops)], reason


def _completed(
    chain: sp.MatrixBase,
    candidates: Sequence[sp.Expr],
    x: Sequence[sp.Symbol],
    point: dict[sp.Symbol, sp.Expr],
    missing: int,
) -> list[sp.Expr] | None:
    """The first candidates that complete the chain to coordinates: around the point if possible, else generically."""
    for local in (True, False):
        chosen: list[sp.Expr] = []
        rows = sp.Matrix(chain.jacobian(list(x)))
        rank = _rank(rows, point, local)
        for h in candidates:
            if len(chosen) == missing:
                break
            more = rows.col_join(sp.Matrix([[h.diff(z) for z in x]]))
            larger = _rank(more, point, local)
            if larger > rank:
                chosen.append(h)
                rows, rank = more, larger
        if len(chosen) == missing and rank == len(x):
            return chosen
    return None


def _rank(rows: sp.MatrixBase, point: dict[sp.Symbol, sp.Expr], local: bool) -> int:
    if not local:
        return generic_rank(rows, seconds=0.0).value
    found = rank_at(rows, point, seconds=0.0)
    return found.value if found.verdict.holds else 0


def _zero_at_point(function: sp.Expr, x: Sequence[sp.Symbol], point: dict[sp.Symbol, sp.Expr]) -> sp.Expr:
    """The function less its value at the operating point; a state stays as it is."""
    if function in x:
        return function
    states = {z: point[z] for z in x}
    value = function.xreplace(states)
    if value.has(sp.nan, sp.zoo, sp.oo) or is_zero(value, test=_QUICK).holds:
        return function
    return function - value


def _slopes(internal: Sequence[sp.Expr], form: LinearisingForm) -> list[sp.Expr]:
    view = form.view
    found = [lie_derivative(h, g, view.x) for h in internal for g in view.input_fields]
    return [sp.Integer(0) if e == 0 or is_zero(e, test=_QUICK).holds else tidy(e, seconds=0.1) for e in found]


def _checked(internal: Sequence[sp.Expr], form: LinearisingForm) -> Verdict:
    view = form.view
    slopes = [lie_derivative(h, g, view.x) for h in internal for g in view.input_fields]
    return are_zero(slopes, test=_QUICK).restated(_CLAIM, internal=tuple(internal))
