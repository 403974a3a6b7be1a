"""The controller form: chains of integrators in z = T(x) that the inputs drive (paper section 3, eq. 22-29)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import sympy as sp

from ulna.base import NoFormError, Verdict, all_of
from ulna.design.forms.linearisability import Linearisability
from ulna.design.forms.linearising_outputs import LinearisingOutputs, linearises, linearising_outputs
from ulna.geometry.diffeomorphism import Diffeomorphism, diffeomorphism, new_symbols
from ulna.geometry.relative_degree import RelativeDegree, relative_degree, relative_degree_of
from ulna.symbolic.exact.linear import inverse
from ulna.symbolic.exact.rank import generic_rank, minor_determinant
from ulna.symbolic.exact.simplify import tidy
from ulna.symbolic.exact.zero import are_zero
from ulna.symbolic.formulas.text import formula, listing
from ulna.system.affine import ControlAffine, control_affine
from ulna.system.system import System

_TIDY_SECONDS = 0.2
_INVERSION_SECONDS = 2.5


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerForm:
    """z = (h_1, L_f h_1, …, h_2, …) with z_k' = z_{k+1} inside a chain and z_r' = α_i + β_i u at its end.

    Attributes:
        system: the plant; view: its control-affine view.
        outputs: (m,) the linearising outputs, each the head of a chain.
        indices: (m,) lengths of the chains; they add up to n.
        map: z = T(x), its inverse where it was found; singular where det ∂T/∂x vanishes.
        alpha: (m, 1) L_f^{r_i} h_i, in x.
        beta: (m, m) decoupling matrix L_{g_j} L_f^{r_i − 1} h_i, in x; 1 for one input wherever T₁ = ∫q.
        new_inputs: (m,) symbols v.
        singular: expression in x at whose zeros the law is singular, the determinant of β.
        verdict: how sure it is that the inputs enter at the ends of the chains only and β is generically invertible.
        at_point: whether the form is regular at the operating point.
        relative_degree: the outputs' relative degrees, with the Lie chains.
    """

    system: System
    view: ControlAffine
    outputs: tuple[sp.Expr, ...]
    indices: tuple[int, ...]
    map: Diffeomorphism
    alpha: sp.ImmutableDenseMatrix
    beta: sp.ImmutableDenseMatrix
    new_inputs: tuple[sp.Symbol, ...]
    singular: sp.Expr
    verdict: Verdict
    at_point: Verdict
    relative_degree: RelativeDegree

    @property
    def chain(self) -> sp.ImmutableDenseMatrix:
        """(n, 1) T(x), the chains one after the other."""
        return self.map.forward

    @property
    def drift_in_z(self) -> sp.ImmutableDenseMatrix:
        """(n, 1) the drift in the new coordinates (eq. 29).

        Raises:
            NoFormError: if the inverse of T was not found.
        """
        ends = self._in_z(self.alpha)
        rows: list[sp.Expr] = []
        for i, length in enumerate(self.indices):
            rows += [*self.map.new[len(rows) + 1 : len(rows) + length], ends[i]]
        return sp.ImmutableDenseMatrix(len(rows), 1, rows)

    @property
    def input_fields_in_z(self) -> sp.ImmutableDenseMatrix:
        """(n, m) the input fields in the new coordinates (eq. 29): zero but at the ends of the chains.

        Raises:
            NoFormError: if the inverse of T was not found.
        """
        ends = self._in_z(self.beta)
        fields = sp.zeros(sum(self.indices), len(self.indices))
        last = -1
        for i, length in enumerate(self.indices):
            last += length
            fields[last, :] = ends[i, :]
        return sp.ImmutableDenseMatrix(fields)

    def _in_z(self, expressions: sp.ImmutableDenseMatrix) -> sp.ImmutableDenseMatrix:
        inverse_map = self.map.inverse
        if inverse_map is not None and all(e.is_Symbol for e in inverse_map):
            # The states are only renamed: what is tidy stays so.
            return expressions.xreplace(dict(zip(self.map.old, inverse_map, strict=True)))
        return self.map.to_new(expressions)

    def control(self, new_inputs: Sequence[sp.Expr] | None = None) -> sp.ImmutableDenseMatrix:
        """(m, 1) u = β⁻¹ (v − α), in x: with it every chain is z_r' = v_i.

        Args:
            new_inputs: (m,) expressions for v; the form's own symbols if left out.
        """
        v = sp.Matrix(len(self.indices), 1, list(self.new_inputs if new_inputs is None else new_inputs))
        difference = v - self.alpha
        if len(self.indices) == 1:
            return sp.ImmutableDenseMatrix([tidy(difference[0] / self.beta[0, 0], seconds=_TIDY_SECONDS)])
        solved = inverse(self.beta).solution
        law = (solved if solved is not None else self.beta.inv(method="ADJ")) * difference
        return sp.ImmutableDenseMatrix(law.applyfunc(lambda e: tidy(e, seconds=_TIDY_SECONDS)))

    def __repr__(self) -> str:
        new = [z.name for z in self.map.new]
        ends = [new[sum(self.indices[: i + 1]) - 1] for i in range(len(self.indices))]
        rows = [*zip(new, self.map.forward, strict=True)]
        u = sp.Matrix(len(self.view.u), 1, list(self.view.u))
        rows += [(f"{end}'", rate) for end, rate in zip(ends, self.alpha + self.beta * u, strict=True)]
        return listing(f"Controller form of '{self.system.name}', chains of {', '.join(map(str, self.indices))}", rows)

    def _repr_latex_(self) -> str:
        return self.map._repr_latex_()


@lru_cache(maxsize=32)
def controller_form(system: System, outputs: tuple[sp.Expr, ...] | None = None) -> ControllerForm:
    """The controller form of a plant, for the given outputs or for ones that are found.

    For one input and q closed up to a constant, T₁ = ∫q with T₁ = 0 where the output that was found is 0, so that
    z_n' = f_n(z) + u exactly as in eq. 22.

    Args:
        system: the plant.
        outputs: (m,) functions of the state to use; left out, they are found.

    Raises:
        NoFormError: if the plant has no such form or none was found; its `value` is the verdict's owner.
        NotAffineError: if the plant is not affine in its inputs.
        UlnaError: if something that has to be differentiated is not smooth.
    """
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


def _form(relative: RelativeDegree, verdict: Verdict) -> ControllerForm:
    view = relative.view
    indices = tuple(r for r in relative.per_output if r is not None)
    forward = sp.ImmutableDenseMatrix(
        [_readable(e) for chain, r in zip(relative.lie_chain, indices, strict=True) for e in chain[:r]]
    )
    alpha = sp.ImmutableDenseMatrix([_readable(chain[r]) for chain, r in zip(relative.lie_chain, indices, strict=True)])
    taken = (*view.x, *view.u, *view.system.parameter_symbols)
    jacobian = sp.ImmutableDenseMatrix(forward.jacobian(list(view.x)))
    singular = relative.singular if relative.singular is not None else sp.Integer(1)
    return ControllerForm(
        system=view.system,
        view=view,
        outputs=tuple(forward[sum(indices[:i])] for i in range(len(indices))),
        indices=indices,
        map=diffeomorphism(
            forward,
            view.x,
            new_symbols("z", len(view.x), taken),
            near={**relative.point, **view.system.values},
            singular=minor_determinant(jacobian, generic_rank(jacobian, seconds=0)),
            seconds=_INVERSION_SECONDS,
        ),
        alpha=alpha,
        beta=relative.decoupling,
        new_inputs=new_symbols("v", len(view.u), taken, plain_if_one=True),
        singular=singular,
        verdict=all_of("the plant has this controller form", [verdict, linearises(relative)]),
        at_point=relative.at_point,
        relative_degree=relative,
    )


def substituted_back(form: ControllerForm) -> Verdict:
    """Whether the form holds for the plant: T differentiated along f + g u(x, v) is the chains' right-hand side.

    Independent of how the form was made: it uses only T, the law and the plant.
    """
    view, law = form.view, form.control()
    rates = form.map.jacobian * (view.f + view.g * law)
    wanted: list[sp.Expr] = []
    for length, v in zip(form.indices, form.new_inputs, strict=True):
        wanted += [*form.chain[len(wanted) + 1 : len(wanted) + length], v]
    differences = [rate - right for rate, right in zip(rates, wanted, strict=True)]
    return all_of("the closed plant is a set of chains of integrators", [are_zero(differences)])


def _readable(expression: sp.Expr) -> sp.Expr:
    return tidy(expression, seconds=_TIDY_SECONDS)


def _named(view: ControlAffine) -> str:
    n, m = len(view.x), len(view.u)
    return f"'{view.system.name}' ({n} state{'s' * (n != 1)}, {m} input{'s' * (m != 1)})"


def _reason(verdict: Verdict) -> str:
    return str(verdict.evidence.get("reason") or verdict.evidence.get("because") or verdict.claim)


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
        return f"span{{{fields}}} has rank {found.rank} instead of {n}, so some of the state cannot be reached"
    evidence = conditions.involutive.evidence
    at = ", ".join(f"{s} = {float(v):.3g}" for s, v in evidence["point"].items())
    near = f" near {at}" if at else ""
    return (
        f"{evidence['bracket']} leaves span{{{', '.join(evidence['span'])}}}{near}, "
        f"rank {evidence['rank_after']} instead of {evidence['rank_before']}"
    )
