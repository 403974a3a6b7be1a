"""Relative degree: how often each output must be differentiated before an input appears."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import sympy as sp

from ulna.base import Verdict, all_of
from ulna.geometry.lie import lie_derivative
from ulna.geometry.smoothness import require_slopes, without_signs
from ulna.symbolic.exact import SampledZero, attempt, generic_rank, minor_determinant, rank_at, tidy
from ulna.system import ControlAffine, System, control_affine, equilibrium

_TEST = SampledZero(seconds=0.5)
_SECONDS = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RelativeDegree:
    """The relative degrees of outputs, generically and at the operating point.

    Attributes:
        view: the plant x' = f + g u.
        outputs: (p,) functions h_i of the state.
        per_output: (p,) the smallest r with L_g L_f^{r−1} h ≠ 0, None where no input ever reaches the output.
        decoupling: (p, m) row i is L_g L_f^{r_i − 1} h_i; zero where r_i is None.
        lie_chain: (p,) tuples h, L_f h, … , L_f^r h, as they come, not simplified.
        invertible: whether the rows of the decoupling matrix are independent on an open dense set, for a square plant
            that it is invertible there.
        at_point: whether the vector relative degree is well defined at the operating point: no row vanishes and all
            are independent there. Its evidence tells "generically, but not here" (`generically=True`) from "never".
        singular: expression at whose zeros the rows are dependent (the determinant, or a minor where m > p); None if
            they are so everywhere.
        point: the operating point, value by state symbol.
        certainty: how sure it is that the derivatives before r_i are free of the inputs.
    """

    view: ControlAffine
    outputs: tuple[sp.Expr, ...]
    per_output: tuple[int | None, ...]
    decoupling: sp.ImmutableDenseMatrix
    lie_chain: tuple[tuple[sp.Expr, ...], ...]
    invertible: Verdict
    at_point: Verdict
    singular: sp.Expr | None
    point: Mapping[sp.Symbol, sp.Expr]
    certainty: Verdict

    @property
    def total(self) -> int | None:
        """The sum of the relative degrees; None if some output is never reached."""
        degrees = [r for r in self.per_output if r is not None]
        return sum(degrees) if len(degrees) == len(self.per_output) else None


@lru_cache(maxsize=32)
def relative_degree(system: System) -> RelativeDegree:
    """The relative degrees of the system's own outputs (Isidori, Nonlinear Control Systems, sections 4.1 and 5.1).

    Raises:
        NotAffineError: if the plant is not affine in its inputs.
        UlnaError: if something that has to be differentiated is not smooth.

    Examples:
        >>> ulna.relative_degree(ulna.model("one_link_arm")).per_output
        (3,)
    """
    view = control_affine(system)
    return relative_degree_of(tuple(view.h), view)


def relative_degree_of(
    outputs: Sequence[sp.Expr], view: ControlAffine, *, point: Mapping[sp.Symbol, sp.Expr] | None = None
) -> RelativeDegree:
    """The relative degrees of any functions of the state.

    Args:
        outputs: (p,) functions of the state.
        view: the plant.
        point: where to judge; the plant's operating point if left out.

    Raises:
        UlnaError: if something that has to be differentiated is not smooth.
    """
    here = equilibrium(view.system) if point is None else None
    where = dict(point or {}) if here is None else dict(here.states)
    found = [_differentiated(h, view) for h in outputs]
    degrees = tuple(one.degree for one in found)
    rows = [entry for one in found for entry in one.row]
    decoupling = sp.ImmutableDenseMatrix(len(found), len(view.u), rows)
    certainty = all_of("earlier derivatives are free of the inputs", [v for one in found for v in one.free])
    invertible, singular = _independent_rows(decoupling, degrees, certainty, view)
    return RelativeDegree(
        view=view,
        outputs=tuple(outputs),
        per_output=degrees,
        decoupling=decoupling,
        lie_chain=tuple(one.chain for one in found),
        invertible=invertible,
        at_point=_at_point(decoupling, degrees, invertible, where if here is None else here.where, view),
        singular=singular,
        point=where,
        certainty=certainty,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Differentiated:
    degree: int | None
    row: tuple[sp.Expr, ...]
    chain: tuple[sp.Expr, ...]
    free: tuple[Verdict, ...]


def _differentiated(output: sp.Expr, view: ControlAffine) -> _Differentiated:
    """Differentiate along f until an input appears; n times at most, since dh … dL_f^{r−1}h are independent."""
    asked = f"the relative degree of {output} in '{view.system.name}'"
    none = (sp.Integer(0),) * len(view.u)
    chain, free = [output], []
    if not view.u:
        return _Differentiated(degree=None, row=none, chain=tuple(chain), free=())
    for order in range(1, len(view.x) + 1):
        require_slopes(chain[-1], view.x, asked)
        step = attempt(_SECONDS, f"derivative {order} of {output}", _derivatives, chain[-1], view).value
        if step is None:
            claim = f"derivative {order} is free of the inputs"
            free.append(Verdict.undecided(claim, tried=f"no derivative within {_SECONDS:g} s"))
            break
        derivative, row, verdicts = step
        if any(v.fails for v in verdicts):
            entries = [sp.Integer(0) if v.holds else tidy(e, seconds=0.2) for e, v in zip(row, verdicts, strict=True)]
            return _Differentiated(degree=order, row=tuple(entries), chain=(*chain, derivative), free=tuple(free))
        free += verdicts
        if not derivative.free_symbols & set(view.x):
            break
        chain.append(derivative)
    return _Differentiated(degree=None, row=none, chain=tuple(chain), free=tuple(free))


def _derivatives(function: sp.Expr, view: ControlAffine) -> tuple[sp.Expr, list[sp.Expr], list[Verdict]]:
    """L_f φ, the L_{g_j} φ, and whether each of the latter vanishes."""
    row = [lie_derivative(function, field, view.x) for field in view.input_fields]
    derivative = lie_derivative(function, view.f, view.x)
    if derivative.has(sp.sign):
        row, derivative = [without_signs(entry) for entry in row], without_signs(derivative)
    return derivative, row, [_TEST(entry) for entry in row]


def _names(degrees: Sequence[int | None]) -> str:
    return ", ".join(f"number {i + 1}" for i, r in enumerate(degrees) if r is None)


def _independent_rows(
    decoupling: sp.ImmutableDenseMatrix, degrees: tuple[int | None, ...], certainty: Verdict, view: ControlAffine
) -> tuple[Verdict, sp.Expr | None]:
    outputs, inputs = len(degrees), len(view.u)
    claim = f"the decoupling matrix is generically {'invertible' if outputs == inputs else 'of full row rank'}"
    if not outputs or not inputs:
        return Verdict.refuted(claim, reason=f"there are no {'outputs' if inputs else 'inputs'}"), None
    if not certainty.holds:
        return Verdict.undecided(claim, **{**certainty.evidence, "because": certainty.claim}), None
    if None in degrees:
        return Verdict.refuted(claim, reason=f"no input ever reaches output {_names(degrees)}", rank=None), None
    rank = generic_rank(decoupling, seconds=1.0)
    if rank.point is None:
        return Verdict.undecided(claim, **rank.verdict.evidence), None
    if rank.value < outputs:
        reason = "more outputs than inputs" if outputs > inputs else "its rows are dependent"
        if not rank.verdict.holds:
            return Verdict.undecided(claim, **rank.verdict.evidence), None
        return Verdict.refuted(claim, rank=rank.value, outputs=outputs, inputs=inputs, reason=reason), None
    singular = attempt(1.0, "minor", minor_determinant, decoupling, rank).value
    return Verdict.proved(claim, rank=rank.value, point=dict(rank.point), singular=singular), singular


def _at_point(
    decoupling: sp.ImmutableDenseMatrix,
    degrees: tuple[int | None, ...],
    invertible: Verdict,
    point: Mapping[sp.Symbol, sp.Expr],
    view: ControlAffine,
) -> Verdict:
    claim = "the relative degree is well defined at the operating point"
    if not invertible.holds:
        status = Verdict.refuted if invertible.fails else Verdict.undecided
        return status(claim, **{**invertible.evidence, "generically": False if invertible.fails else None})
    for i, degree in enumerate(degrees):
        row = rank_at(decoupling[i, :], point, seconds=0.5)
        if row.verdict.holds and row.value == 0:
            shown = decoupling[i, :] if len(view.u) > 1 else decoupling[i, 0]
            return Verdict.refuted(
                claim, generically=True, output=i + 1, degree=degree, vanishing=shown, point=dict(point)
            )
    rank = rank_at(decoupling, point, seconds=0.5)
    if not rank.verdict.holds:
        return Verdict.undecided(claim, **{**rank.verdict.evidence, "generically": True, "point": dict(point)})
    if rank.value < len(degrees):
        return Verdict.refuted(
            claim, generically=True, rank=rank.value, vanishing=invertible.evidence["singular"], point=dict(point)
        )
    return Verdict.proved(claim, point=dict(point))
