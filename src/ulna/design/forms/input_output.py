"""Input-output linearisation of square plants: y_i^(r_i) = v_i by static feedback (Isidori, sections 4.1 and 5.3)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp

from ulna.base.errors import NoFormError
from ulna.base.verdict import Verdict
from ulna.design.internal.base_point import base_point
from ulna.geometry.diffeomorphism import new_symbols
from ulna.geometry.relative_degree import RelativeDegree, relative_degree
from ulna.symbolic.exact.linear import solve_linear
from ulna.symbolic.exact.rank import rank_at
from ulna.symbolic.exact.simplify import tidy
from ulna.symbolic.formulas.text import formula, listing
from ulna.system.affine import ControlAffine
from ulna.system.signal import Signal
from ulna.system.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class InputOutputForm:
    """y_i^(r_i) = α_i(x) + (β(x) u)_i with β generically invertible, and the law u = β⁻¹ (v − α).

    Attributes:
        degree: relative degrees and decoupling matrix.
        outputs: (m,) h; indices: (m,) relative degrees r_i.
        chain: (Σ r, 1) h_1, L_f h_1, …, L_f^{r_1 − 1} h_1, h_2, …
        alpha: (m, 1) L_f^{r_i} h_i; beta: (m, m) decoupling matrix.
        new_inputs: (m,) symbols v.
        control: (m, 1) u as a function of x and v.
        singular: expression in x at whose zeros the law is not defined.
        regular: whether the law is defined at the operating point, parameters at their values.
    """

    degree: RelativeDegree
    outputs: tuple[sp.Expr, ...]
    indices: tuple[int, ...]
    chain: sp.ImmutableDenseMatrix
    alpha: sp.ImmutableDenseMatrix
    beta: sp.ImmutableDenseMatrix
    new_inputs: tuple[sp.Symbol, ...]
    control: sp.ImmutableDenseMatrix
    singular: sp.Expr
    regular: Verdict

    @property
    def view(self) -> ControlAffine:
        """The plant as x' = f + g u."""
        return self.degree.view

    @property
    def system(self) -> System:
        """The plant."""
        return self.degree.view.system

    @property
    def internal_dimension(self) -> int:
        """N − Σ r, the number of states that the law makes unobservable from the outputs."""
        return len(self.view.x) - sum(self.indices)

    @property
    def law(self) -> System:
        """The law as a static system: inputs the plant's states and v, outputs the plant's inputs."""
        new = tuple(Signal(name=v.name, text=f"new input {k + 1}") for k, v in enumerate(self.new_inputs))
        return System(
            name=f"input-output linearising law of {self.system.name}",
            states=(),
            rates=(),
            inputs=(*self.system.states, *new),
            outputs=self.system.inputs,
            readouts=tuple(self.control),
            parameters=self.system.parameters,
        )

    def __repr__(self) -> str:
        rows = zip((u.name for u in self.view.u), self.control, strict=True)
        return listing(f"Input-output linearising law of '{self.system.name}'", rows)

    def _repr_latex_(self) -> str:
        from ulna.symbolic.formulas.latex import equation_latex

        return equation_latex(self.view.u, self.control)


def input_output_form(system: System, *, at: Mapping[sp.Symbol, sp.Expr] | None = None) -> InputOutputForm:
    """The input-output linearising law of a square plant.

    Args:
        system: as many outputs as inputs.
        at: a point (value by state symbol) at which the law must be defined. Left out, it need only be defined on
            an open dense set, and `regular` tells about the operating point.

    Raises:
        NoFormError: if the plant is not square, an output is never reached by an input, or the decoupling matrix is
            singular, generically or at the point asked for. Its value is the `Verdict` that says so.
    """
    asked = f"input-output form of '{system.name}'"
    _require_square(system, asked)
    degree = relative_degree(system)
    _require_invertible(degree, asked)
    indices = tuple(r for r in degree.per_output if r is not None)
    alpha = sp.ImmutableDenseMatrix([chain[-1] for chain in degree.lie_chain])
    new = new_symbols("v", len(indices), _taken(system), plain_if_one=True)
    solution = solve_linear(degree.decoupling, sp.Matrix(list(new)) - alpha)
    if solution.solution is None:
        raise NoFormError(asked, "the decoupling matrix could not be inverted in time.", value=solution.verdict)
    singular = tidy(solution.determinant if degree.singular is None else degree.singular)
    regular = _regular(degree, system, at)
    if at is not None and not regular.holds:
        raise NoFormError(
            asked,
            f"the decoupling matrix is singular at the point asked for: {formula(singular)} = 0 there.",
            "The law exists away from it; dynamic extension may help with two or more inputs.",
            value=regular,
        )
    return InputOutputForm(
        degree=degree,
        outputs=degree.outputs,
        indices=indices,
        chain=sp.ImmutableDenseMatrix([_short(e) for chain in degree.lie_chain for e in chain[:-1]]),
        alpha=alpha.applyfunc(_short),
        beta=degree.decoupling,
        new_inputs=new,
        control=sp.ImmutableDenseMatrix(solution.solution).applyfunc(_short),
        singular=singular,
        regular=regular,
    )


def _short(expression: sp.Expr) -> sp.Expr:
    return tidy(expression, seconds=0.1)


def _taken(system: System) -> tuple[sp.Symbol, ...]:
    return (*system.state_symbols, *system.input_symbols, *system.parameter_symbols)


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


def _regular(degree: RelativeDegree, system: System, at: Mapping[sp.Symbol, sp.Expr] | None) -> Verdict:
    base = base_point(system)
    point = {**base.values, **(dict(at) if at is not None else {})}
    claim = "the decoupling matrix is invertible at the point"
    rank = rank_at(degree.decoupling, point, seconds=0.5)
    shown = {s: point[s] for s in system.state_symbols}
    if not rank.verdict.holds:
        return Verdict.undecided(claim, **{**rank.verdict.evidence, "point": shown})
    if rank.value < len(degree.outputs):
        return Verdict.refuted(claim, rank=rank.value, point=shown, singular=degree.singular)
    return Verdict.proved(claim, point=shown)
