"""The linearising form: chains of integrators that the inputs drive, and the law that leaves nothing else of them.

Isidori, Nonlinear Control Systems, sections 4.1 and 5.3. Where the chains are all coordinates it is the controller form
of the paper (section 3, eq. 22-29).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import sympy as sp

from ulna.base import NoFormError, Verdict, all_of
from ulna.geometry import Diffeomorphism, RelativeDegree, diffeomorphism, new_symbols
from ulna.symbolic.exact import are_zero, generic_rank, inverse, minor_determinant, tidy
from ulna.symbolic.formulas import listing
from ulna.system import ControlAffine, Signal, System, equilibrium

_TIDY_SECONDS = 0.2
_INVERSION_SECONDS = 2.5


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearisingForm:
    """ξ = (h_1, L_f h_1, …, h_2, …) with ξ_k' = ξ_{k+1} inside a chain and ξ_r' = α_i(x) + (β(x) u)_i at its end.

    Attributes:
        relative_degree: the outputs' relative degrees, with the Lie chains.
        chain: (Σ r, 1) ξ in x, the chains one after the other.
        alpha: (m, 1) L_f^{r_i} h_i, in x.
        beta: (m, m) decoupling matrix L_{g_j} L_f^{r_i − 1} h_i, in x; 1 for one input wherever T₁ = ∫q.
        new_inputs: (m,) symbols v.
        singular: expression in x at whose zeros the law is singular, the determinant of β.
        verdict: how sure it is that the inputs enter at the ends of the chains only and β is generically invertible.

    Examples:
        >>> form = ulna.controller_form("duffing")
        >>> form.alpha, form.beta
        (Matrix([[-(a*x1 + b*x1**3 + d*x2)]]), Matrix([[1]]))
    """

    relative_degree: RelativeDegree
    chain: sp.ImmutableDenseMatrix
    alpha: sp.ImmutableDenseMatrix
    beta: sp.ImmutableDenseMatrix
    new_inputs: tuple[sp.Symbol, ...]
    singular: sp.Expr
    verdict: Verdict

    @property
    def view(self) -> ControlAffine:
        """The plant as x' = f + g u."""
        return self.relative_degree.view

    @property
    def system(self) -> System:
        """The plant."""
        return self.view.system

    @property
    def at_point(self) -> Verdict:
        """Whether the form is regular, and the law defined, at the operating point."""
        return self.relative_degree.at_point

    @property
    def indices(self) -> tuple[int, ...]:
        """(m,) lengths r of the chains."""
        return tuple(r for r in self.relative_degree.per_output if r is not None)

    @property
    def outputs(self) -> tuple[sp.Expr, ...]:
        """(m,) the linearising outputs, each the head of a chain."""
        return tuple(self.chain[sum(self.indices[:i])] for i in range(len(self.indices)))

    @property
    def internal_dimension(self) -> int:
        """N − Σ r, the number of states that the law makes unobservable from the outputs; 0 for a controller form."""
        return len(self.view.x) - sum(self.indices)

    @property
    def map(self) -> Diffeomorphism:
        """z = T(x), the chains as coordinates, and the inverse where it is found; singular where det ∂T/∂x vanishes.

        Raises:
            NoFormError: if the chains are not all coordinates.
        """
        if self.internal_dimension:
            raise NoFormError(
                f"the chains of '{self.system.name}' as coordinates",
                f"they are {sum(self.indices)} of {len(self.view.x)}.",
                "Use `normal_form`, which completes them.",
                value=self,
            )
        return _coordinates(self.view, self.chain)

    @property
    def control(self) -> sp.ImmutableDenseMatrix:
        """(m, 1) u = β⁻¹ (v − α), in x and v: with it every chain is ξ_r' = v_i."""
        return _control(self.alpha, self.beta, self.new_inputs)

    @property
    def law(self) -> System:
        """`control` as a static system: inputs the plant's states and v, outputs the plant's inputs."""
        new = tuple(Signal(name=v.name, text=f"new input {k + 1}") for k, v in enumerate(self.new_inputs))
        return System(
            name=f"linearising law of {self.system.name}",
            states=(),
            rates=(),
            inputs=(*self.system.states, *new),
            outputs=self.system.inputs,
            readouts=tuple(self.control),
            parameters=self.system.parameters,
        )

    @property
    def drift_in_z(self) -> sp.ImmutableDenseMatrix:
        """(n, 1) the drift in the coordinates z (eq. 29).

        Raises:
            NoFormError: if the chains are not all coordinates or the inverse of T was not found.
        """
        ends = self._in_z(self.alpha)
        rows: list[sp.Expr] = []
        for i, length in enumerate(self.indices):
            rows += [*self.map.new[len(rows) + 1 : len(rows) + length], ends[i]]
        return sp.ImmutableDenseMatrix(len(rows), 1, rows)

    @property
    def input_fields_in_z(self) -> sp.ImmutableDenseMatrix:
        """(n, m) the input fields in the coordinates z (eq. 29): zero but at the ends of the chains.

        Raises:
            NoFormError: if the chains are not all coordinates or the inverse of T was not found.
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

    def __repr__(self) -> str:
        new = [z.name for z in new_symbols("z", sum(self.indices), _taken(self.view))]
        ends = [new[sum(self.indices[: i + 1]) - 1] for i in range(len(self.indices))]
        rows = [*zip(new, self.chain, strict=True)]
        u = sp.Matrix(len(self.view.u), 1, list(self.view.u))
        rows += [(f"{end}'", rate) for end, rate in zip(ends, self.alpha + self.beta * u, strict=True)]
        kind = "Input-output" if self.internal_dimension else "Controller"
        return listing(f"{kind} form of '{self.system.name}', chains of {', '.join(map(str, self.indices))}", rows)

    def _repr_latex_(self) -> str:
        from ulna.symbolic.formulas import expression_latex

        return f"$$z = {expression_latex(self.chain)},\\quad u = {expression_latex(self.control)}$$"


def form_of(relative: RelativeDegree, verdict: Verdict) -> LinearisingForm:
    """The form of outputs whose decoupling matrix is generically invertible.

    Args:
        relative: their relative degrees, one for each input.
        verdict: on what that rests.
    """
    view = relative.view
    singular = relative.singular if relative.singular is not None else inverse(relative.decoupling).determinant
    return LinearisingForm(
        relative_degree=relative,
        chain=sp.ImmutableDenseMatrix([_readable(e) for chain in relative.lie_chain for e in chain[:-1]]),
        alpha=sp.ImmutableDenseMatrix([_readable(chain[-1]) for chain in relative.lie_chain]),
        beta=relative.decoupling,
        new_inputs=new_symbols("v", len(view.u), _taken(view), plain_if_one=True),
        singular=_readable(singular),
        verdict=verdict,
    )


def substituted_back(form: LinearisingForm) -> Verdict:
    """Whether the form holds for the plant: the chains differentiated along f + g u(x, v) are their right-hand side.

    Independent of how the form was made: it uses only the chains, the law and the plant.
    """
    view = form.view
    rates = form.chain.jacobian(list(view.x)) * (view.f + view.g * form.control)
    wanted: list[sp.Expr] = []
    for length, v in zip(form.indices, form.new_inputs, strict=True):
        wanted += [*form.chain[len(wanted) + 1 : len(wanted) + length], v]
    differences = [rate - right for rate, right in zip(rates, wanted, strict=True)]
    return all_of("the closed plant is a set of chains of integrators", [are_zero(differences)])


@lru_cache(maxsize=64)
def _coordinates(view: ControlAffine, chain: sp.ImmutableDenseMatrix) -> Diffeomorphism:
    jacobian = sp.ImmutableDenseMatrix(chain.jacobian(list(view.x)))
    return diffeomorphism(
        chain,
        view.x,
        new_symbols("z", len(view.x), _taken(view)),
        near={**equilibrium(view.system).states, **view.system.values},
        singular=minor_determinant(jacobian, generic_rank(jacobian, seconds=0)),
        seconds=_INVERSION_SECONDS,
    )


@lru_cache(maxsize=64)
def _control(
    alpha: sp.ImmutableDenseMatrix, beta: sp.ImmutableDenseMatrix, new_inputs: tuple[sp.Symbol, ...]
) -> sp.ImmutableDenseMatrix:
    difference = sp.ImmutableDenseMatrix(list(new_inputs)) - alpha
    if len(new_inputs) == 1:
        return sp.ImmutableDenseMatrix([_readable(difference[0] / beta[0, 0])])
    solved = inverse(beta).solution
    law = (solved if solved is not None else beta.inv(method="ADJ")) * difference
    return sp.ImmutableDenseMatrix(law.applyfunc(_readable))


def _readable(expression: sp.Expr) -> sp.Expr:
    return tidy(expression, seconds=_TIDY_SECONDS)


def _taken(view: ControlAffine) -> tuple[sp.Symbol, ...]:
    return (*view.x, *view.u, *view.system.parameter_symbols)
