"""A no to the observer form at one point, for plants whose brackets are too large to write down.

With μ = dL_f^n h (τ) the brackets begin with [τ, ad_f τ] = ±(L_τ μ) τ, so for n ≥ 3 the form, under any output
transformation, needs L_τ μ = 0; and without one a_n' = μ must be a function of y, L_v μ = 0 for all v in ker dh. Since
Q τ = e_n, the slope of μ along v needs only numbers: L_v μ = (∂_v r) τ − r Q⁻¹ (∂_v Q) τ with r = dL_f^n h. They
come from jets (`symbolic.jet`, `symbolic.second_slopes`) in ball arithmetic: milliseconds, and a no is certain.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import islice

import sympy as sp
from flint import arb, arb_mat, ctx

from ulna.base import Verdict
from ulna.geometry import Observability
from ulna.program import BITS, Kernel, lie_derivatives, second_slopes
from ulna.symbolic.compiling import kernel
from ulna.symbolic.exact import SEED, Point, attempt, exact_ball, random_points
from ulna.system import ControlAffine

_SECONDS = 4.0
_POINTS = 2
_TRIES = 12


def refutation_at_a_point(seen: Observability) -> Verdict:
    """Refuted with a `point` and the direction's `name` if the form is impossible there, undecided otherwise.

    Args:
        seen: an observable plant with one output and n ≥ 2 states. The evidence's `any_psi` says that no output
            transformation helps either.
    """
    claim = f"L_v μ = 0 along ker dh, μ the slope of a_n(y) in '{seen.system.name}'"
    found = attempt(_SECONDS, "slopes at a point", _slopes, seen)
    if found.value is None:
        return Verdict.undecided(claim, tried=found.reason)
    for point, along_start, along_kernel in found.value:
        if len(seen.view.x) >= 3 and not along_start.contains(0):
            return Verdict.refuted(claim, point=point, name="τ", value=_decimal(along_start), any_psi=True)
        if along_kernel is not None:
            return Verdict.refuted(claim, point=point, name="ker dh", value=_decimal(along_kernel), any_psi=False)
    return Verdict.undecided(claim, tried=f"{len(found.value)} random points")


def _slopes(seen: Observability) -> list[tuple[Point, arb, arb | None]]:
    """(point, L_τ μ, a nonzero L_v μ if there is one) at random points where Q is regular."""
    view = seen.view
    program, parameters = _derivatives(view)
    results: list[tuple[Point, arb, arb | None]] = []
    for point in islice(random_points([*view.x, *parameters], seed=SEED), _TRIES):
        found = _slopes_at(program, {s.name: exact_ball(value) for s, value in point.items()}, view.x)
        if found is not None:
            results.append((point, *found))
        if len(results) == _POINTS:
            break
    return results


def _derivatives(view: ControlAffine) -> tuple[Kernel, tuple[sp.Symbol, ...]]:
    """The kernel of h, L_f h, …, L_f^n h over the states and the parameters, and the latter."""
    held = tuple(sorted((view.f.free_symbols | view.h.free_symbols) - set(view.x), key=str))
    rates = {f"rate {x.name}": rate for x, rate in zip(view.x, view.f, strict=True)}
    drift = kernel("drift", (*view.x, *held), {**rates, "h": view.h[0]})
    return lie_derivatives(drift, [x.name for x in view.x], list(rates), len(view.x)), held


def _slopes_at(
    program: Kernel, place: Mapping[str, arb], states: tuple[sp.Symbol, ...]
) -> tuple[arb, arb | None] | None:
    """L_τ μ and a nonzero L_v μ at one point; None where Q is singular or a value does not exist."""
    n = len(states)
    names = [x.name for x in states]
    first = [second_slopes(program, place, {x: arb(1)}) for x in names]
    with ctx.workprec(BITS):
        rows = [[first[j][f"h:{k}"][1] for j in range(n)] for k in range(n + 1)]
        Q = arb_mat(rows[:n])
        try:
            start = Q.solve(arb_mat([[arb(int(k == n - 1))] for k in range(n)]))
            weights = Q.transpose().solve(arb_mat([[entry] for entry in rows[n]]))
        except ZeroDivisionError:
            return None
    along = {x: start[k, 0] for k, x in enumerate(names)}
    mixed = [second_slopes(program, place, along, {x: arb(1)}) for x in names]
    with ctx.workprec(BITS):
        slopes = []
        for jets in mixed:
            taken = sum((weights[k, 0] * jets[f"h:{k}"][3] for k in range(n)), arb(0))
            slopes.append(jets[f"h:{n}"][3] - taken)
        along_start = sum((slopes[k] * start[k, 0] for k in range(n)), arb(0))
        if not along_start.is_finite():
            return None
        return along_start, _along_kernel(slopes, [Q[0, k] for k in range(n)])


def _along_kernel(slopes: list[arb], dh: list[arb]) -> arb | None:
    """A slope along some v with dh(v) = 0 that is certainly not zero."""
    for i in range(len(dh)):
        for j in range(i):
            value = slopes[i] * dh[j] - slopes[j] * dh[i]
            if not value.contains(0):
                return value
    return None


def _decimal(value: arb) -> sp.Expr:
    return sp.Float(value.mid().str(20, radius=False), 20)
