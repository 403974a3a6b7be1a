"""Integration of involutive distributions: the functions that are constant on their leaves.

Frobenius' theorem gives n − d independent ones around a point where the distribution of dimension d is involutive and
regular. Finding them in closed form is another matter: it is a search, and every function found is differentiated.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from sympy import Expr, Integer, Matrix, Symbol

from ulna.base import Verdict, all_of
from ulna.geometry.distributions import Distribution, generic_basis, involutive
from ulna.geometry.lie import Scalar, expression, lie_derivative
from ulna.geometry.representative import simplest_function_of, without_arcsines
from ulna.symbolic.exact import generic_rank, is_zero, time_budget, vanishes
from ulna.symbolic.integration import LeafSearch, along, independent


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstIntegrals:
    """n − d independent functions with L_f T = 0 for every field f of an involutive distribution of dimension d.

    Args:
        distribution: what was integrated.
        functions: the T's; None where there are not as many or not all were found.
        found: the independent ones that were found, all or some.
        verdict: refuted (with the offending bracket) if the distribution is not involutive, undecided if the
            search did not find all.
    """

    distribution: Distribution
    functions: tuple[Expr, ...] | None
    found: tuple[Expr, ...]
    verdict: Verdict


def first_integrals(
    span: Distribution,
    hints: Sequence[Expr] = (),
    *,
    near: Mapping[Symbol, Scalar] | None = None,
    seconds: float = 8.0,
) -> FirstIntegrals:
    """Independent functions whose common level sets are the leaves of the distribution.

    In order: coordinates, polynomials in the functions that occur, one-forms of the annihilator that are integrable by
    themselves; then what was found is held constant, which leaves a smaller problem of the same kind.

    Args:
        span: spanning fields over n coordinates.
        hints: expressions whose factors may occur in integrating factors.
        near: the point around which the functions must be real; the origin if left out.
        seconds: s, for everything together.

    Examples:
        >>> import sympy as sp
        >>> x, y = sp.symbols("x y", real=True)
        >>> ulna.first_integrals(ulna.distribution([sp.Matrix([-y, x])], [x, y])).functions
        (x**2 + y**2,)
    """
    basis = generic_basis(span)
    wanted = len(span.coordinates) - len(basis.fields)
    point = {x: Integer(0) for x in span.coordinates} | {x: expression(value) for x, value in (near or {}).items()}
    found: list[Expr] = []
    search = LeafSearch(fields=basis.fields, coordinates=span.coordinates, point=point, hints=tuple(hints))
    reason = "every method came to its end"
    with time_budget(seconds) as budget:
        _collect(search.cheap_candidates(), found, wanted, basis, point)
        if len(found) < wanted:
            involution = involutive(basis)
            if involution.fails:
                return _refused(span, wanted, involution)
            _collect(search.candidates(wanted), found, wanted, basis, point)
    if budget.ran_out:
        reason = f"out of time after {seconds:g} s"
    functions = tuple(found)
    if len(found) == wanted:
        return FirstIntegrals(distribution=span, functions=functions, found=functions, verdict=verified(found, basis))
    verdict = Verdict.undecided(f"{wanted} independent first integrals are known", found=functions, reason=reason)
    return FirstIntegrals(distribution=span, functions=None, found=functions, verdict=verdict)


def _collect(
    candidates: Iterable[Expr], found: list[Expr], wanted: int, basis: Distribution, point: Mapping[Symbol, Expr]
) -> None:
    """Accepted candidates appended to `found` until there are enough."""
    if len(found) == wanted:
        return
    for candidate in candidates:
        value = _accepted(candidate, found, basis, point)
        if value is not None:
            found.append(value)
        if len(found) == wanted:
            return


def _refused(span: Distribution, wanted: int, involution: Verdict) -> FirstIntegrals:
    claim = f"the distribution has {wanted} independent first integrals"
    verdict = Verdict.refuted(claim, **{**involution.evidence, "because": involution.claim})
    return FirstIntegrals(distribution=span, functions=None, found=(), verdict=verdict)


def verified(functions: Sequence[Expr], span: Distribution) -> Verdict:
    """Whether the functions are independent and constant along every field of the distribution."""
    claim = "the functions are independent first integrals"
    parts = [is_zero(lie_derivative(h, f, span.coordinates)) for h in functions for f in span.fields]
    if functions:
        rank = generic_rank(Matrix([[h.diff(x) for x in span.coordinates] for h in functions]))
        if rank.value < len(functions):
            return Verdict.refuted(claim, rank=rank.value, functions=tuple(functions))
        parts.append(Verdict.proved("the differentials are independent", point=rank.point))
    return all_of(claim, parts)


def _accepted(candidate: Expr, found: Sequence[Expr], basis: Distribution, point: Mapping[Symbol, Expr]) -> Expr | None:
    """The candidate in its simplest form if it is constant along the fields and independent of what was found."""
    if not independent([*found, candidate], basis.coordinates):
        return None
    if not all(vanishes(along(candidate, f, basis.coordinates)) for f in basis.fields):
        return None
    value = simplest_function_of(without_arcsines(candidate), basis.coordinates, near=point)
    if value is None or verified([value], basis).fails:
        return None
    return value
