"""The nonlinear observer form (paper eq. 33-48) as a value, and its check by substitution.

z' = A z + γ(y, u), and in each block z_1' = γ_1, z_k' = z_{k−1} + γ_k, the last coordinate a function of the outputs.
With one output there is one block; A − L C then has any poles wanted and the error of the observer is linear.
Sources: Krener and Isidori, Syst. Contr. Lett. 3 (1983); Krener and Respondek, SIAM J. Contr. Opt. 23 (1985).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import sympy as sp

from ulna.base import Verdict, all_of
from ulna.design.observers.observer_chain import ObserverChain
from ulna.design.observers.output_functions import OutputSection
from ulna.geometry import Diffeomorphism, diffeomorphism, lie_derivative, new_symbols
from ulna.symbolic.exact import SampledZero, ZeroTest, generic_rank, inverse, is_zero, tidy
from ulna.symbolic.formulas import listing
from ulna.system import ControlAffine, System, equilibrium

_TEST = SampledZero(seconds=0.6)


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

    Examples:
        >>> ulna.observer_form("duffing").map.forward
        Matrix([
        [d*x1 + x2],
        [       x1]])
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
        from ulna.symbolic.formulas import expression_latex

        return f"$$z = {expression_latex(self.map.forward)},\\quad \\gamma = {expression_latex(self.injection)}$$"


def assembled(section: OutputSection, chain: ObserverChain) -> ObserverForm | None:
    """The form of found coordinates and injections, checked by substitution; None if ∂T/∂x could not be inverted."""
    view = section.view
    n = len(view.x)
    T = sp.ImmutableDenseMatrix(n, 1, list(chain.coordinates))
    inverted = inverse(sp.Matrix(T.jacobian(list(view.x))))
    if inverted.solution is None:
        return None
    A, C = shift_matrices(chain.indices)
    z = new_symbols("z", n, (*view.x, *view.u, *section.y, *view.system.parameter_symbols))
    form = ObserverForm(
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
        verdict=Verdict.undecided("the form found is one", tried="nothing yet"),
    )
    return replace(form, verdict=check_observer_form(form))


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


def check_observer_form(form: ObserverForm, *, test: ZeroTest = _TEST) -> Verdict:
    """Whether z = T(x) obeys z' = A z + a(y) + c(y) u with each block's last coordinate the given function of y.

    Every equation is put into the plant's coordinates and tested: nothing of how T was found is trusted.
    """
    view = form.view
    claim = f"'{view.system.name}' takes the observer form in these coordinates"
    regular = generic_rank(sp.Matrix(form.map.jacobian), seconds=0)
    if regular.value < len(view.x):
        return Verdict.refuted(claim, reason="the coordinates are dependent", rank=regular.value)
    stray = {*view.x, *view.u} - set(form.y)
    for row, injected in (("a", form.drift_injection), ("c", form.input_injection)):
        if any(e.free_symbols & stray for e in injected):
            return Verdict.refuted(claim, reason=f"the injection {row} contains states or inputs")
    parts = []
    for row, what, residual in _residuals(form):
        part = is_zero(residual, test=test)
        if part.fails:
            return Verdict.refuted(claim, **{**part.evidence, "row": row + 1, "equation": what, "function": residual})
        parts.append(part)
    return all_of(claim, parts, method="substitution")


def _residuals(form: ObserverForm) -> Iterator[tuple[int, str, sp.Expr]]:
    """Row, kind and left minus right side of every equation, in the plant's coordinates."""
    view, z = form.view, form.map.forward
    at_states = dict(zip(form.y, view.h, strict=True))
    drift, inputs = form.drift_injection.xreplace(at_states), form.input_injection.xreplace(at_states)
    row = 0
    for size, last in zip(form.indices, form.measured, strict=True):
        for k in range(size):
            shifted = z[row - 1] if k else sp.Integer(0)
            yield row, "drift", lie_derivative(z[row], view.f, view.x) - shifted - drift[row]
            for j, column in enumerate(view.input_fields):
                yield row, "input", lie_derivative(z[row], column, view.x) - inputs[row, j]
            row += 1
        yield row - 1, "output", z[row - 1] - last.xreplace(at_states)
