"""Integration of a one-form up to a factor: T₁ with dT₁ = μ ω.

Needed whenever a function must be found from its level sets: the linearising output of a plant from its last
covector field q, which is often not closed although the plant is linearisable.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sympy import Expr, Integer, Pow, Symbol, expand_power_exp

from ulna.base import UlnaError, Verdict, all_of
from ulna.geometry.lie import Scalar, expression
from ulna.geometry.oneform import OneForm, closed, frobenius
from ulna.geometry.representative import (
    real_logarithms,
    simplest_function_of,
    without_arcsines,
    without_offset,
)
from ulna.symbolic.exact import is_zero, normal, time_budget, vanishes
from ulna.symbolic.integration import FormSearch, pivot_of, potentials

_CLAIM = "the one-form has an integrating factor"


@dataclass(frozen=True, slots=True, kw_only=True)
class Potential:
    """T₁ and the factor μ with dT₁ = μ ω.

    Args:
        form: ω.
        value: T₁, None if none was found.
        factor: μ, None if none was found.
        method: how T₁ was found, in words; empty if it was not.
        verdict: on "dT₁ = μ ω"; refuted if ω violates Frobenius' condition, undecided with the list `tried` otherwise.
    """

    form: OneForm
    value: Expr | None
    factor: Expr | None
    method: str
    verdict: Verdict


def integrate(
    form: OneForm,
    hints: Sequence[Expr] = (),
    *,
    near: Mapping[Symbol, Scalar] | None = None,
    seconds: float = 6.0,
) -> Potential:
    """A function T₁ whose differential is parallel to ω, the simplest of its kind.

    In order: a coordinate or a polynomial in the functions that occur; a potential if ω is closed; the same after
    the common factor is taken out and after division by each component; an integrating factor built from the factors of
    ω and of the hints; a reciprocal factor polynomial in these functions; the Pfaffian equation. Every candidate is
    differentiated back before it is returned.

    Args:
        form: ω over n coordinates.
        hints: expressions whose factors may occur in μ (the determinant of the controllability matrix).
        near: the point around which T₁ must be real, and where it is set to 0 if it is finite; the origin if left out.
        seconds: s, for everything together.

    Raises:
        UlnaError: ω is identically zero.

    Examples:
        >>> import sympy as sp
        >>> x, y = sp.symbols("x y", real=True)
        >>> found = ulna.integrate(ulna.one_form([y, -x], [x, y]))
        >>> found.value, found.factor
        (y/x, -1/x**2)
    """
    coordinates = form.coordinates
    # x^(a − 1) as x^a / x: one function x^a for all of them.
    written = (expand_power_exp(w) if w.has(Pow) else w for w in form.components)
    components = tuple(Integer(0) if vanishes(w) else w for w in written)
    if all(w == 0 for w in components):
        raise UlnaError("a function with the differential μ ω", "the one-form is identically zero.")
    point = {x: Integer(0) for x in coordinates} | {x: expression(value) for x, value in (near or {}).items()}
    search = FormSearch(components=components, coordinates=coordinates, hints=tuple(hints), point=point)
    tried: list[str] = []
    integrable: Verdict | None = None
    with time_budget(seconds) as budget:
        for method, candidate in search.cheap_candidates(tried):
            found = _accepted(form, candidate, method, point)
            if found is not None:
                return found
        integrable = frobenius(form)
        if integrable.fails:
            return _none(form, Verdict.refuted(_CLAIM, **{**integrable.evidence, "because": integrable.claim}))
        for method, candidate in search.candidates(tried):
            found = _accepted(form, candidate, method, point)
            if found is not None:
                return found
    if budget.ran_out:
        tried.append(f"out of time after {seconds:g} s")
    return _none(form, Verdict.undecided(_CLAIM, tried=tuple(tried), frobenius=integrable))


def exact_potential(form: OneForm, *, near: Mapping[Symbol, Scalar] | None = None, seconds: float = 6.0) -> Potential:
    """T with dT = ω, with T = 0 at the point where it is finite there; refuted if ω is not closed.

    Args:
        form: ω over n coordinates.
        near: the point around which T must be real, and where it is set to 0; the origin if left out.
        seconds: s, for everything together.
    """
    claim = "the one-form is the differential of a function"
    point = {x: Integer(0) for x in form.coordinates} | {x: expression(v) for x, v in (near or {}).items()}
    exact = closed(form)
    if exact.fails:
        return _none(form, Verdict.refuted(claim, **{**exact.evidence, "because": exact.claim}))
    tried = ("potential in a space of functions", "quadrature")
    with time_budget(seconds) as budget:
        for method, candidate in zip(tried, potentials(form.components, form.coordinates, point), strict=False):
            if candidate is None:
                continue
            value = without_offset(real_logarithms(candidate, point), point)
            slopes = zip(form.coordinates, form.components, strict=True)
            verdict = all_of(claim, [is_zero(value.diff(x) - w) for x, w in slopes])
            if verdict.holds:
                return Potential(form=form, value=value, factor=Integer(1), method=method, verdict=verdict)
    if budget.ran_out:
        tried = (*tried, f"out of time after {seconds:g} s")
    return _none(form, Verdict.undecided(claim, tried=tried))


def _none(form: OneForm, verdict: Verdict) -> Potential:
    return Potential(form=form, value=None, factor=None, method="", verdict=verdict)


def parallel(function: Expr, form: OneForm) -> Verdict:
    """Whether d(function) ∧ ω = 0 with d(function) ≠ 0."""
    claim = "the differential is parallel to the one-form"
    x, w = form.coordinates, form.components
    slopes = [function.diff(c) for c in x]
    if all(vanishes(s) for s in slopes):
        return Verdict.refuted(claim, reason="the function is constant")
    p = next(i for i in range(len(x)) if not vanishes(w[i]))
    parts = [is_zero(slopes[j] * w[p] - slopes[p] * w[j]) for j in range(len(x)) if j != p]
    return all_of(claim, parts)


def _accepted(form: OneForm, candidate: Expr, method: str, point: Mapping[Symbol, Expr]) -> Potential | None:
    candidate = without_arcsines(candidate)
    if not _probably_parallel(candidate, form):
        return None
    value = simplest_function_of(candidate, form.coordinates, near=point)
    if value is None:
        return None
    verdict = parallel(value, form)
    if not verdict.holds:
        return None
    p = pivot_of([Integer(0) if vanishes(w) else w for w in form.components])
    factor = normal(value.diff(form.coordinates[p]) / form.components[p])
    claim = "the differential of the function is the factor times the one-form"
    stated = Verdict(claim=claim, status=verdict.status, evidence=verdict.evidence)
    return Potential(form=form, value=value, factor=factor, method=method, verdict=stated)


def _probably_parallel(candidate: Expr, form: OneForm) -> bool:
    """Cheap refusal of wrong candidates before anything is done with them."""
    return not parallel(candidate, form).fails
