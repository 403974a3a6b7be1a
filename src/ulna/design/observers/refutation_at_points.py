"""A no to observer forms from numbers at random points, for plants whose brackets are too long to write down.

With the derivatives ξ_{i,k} = L_f^k h_i as coordinates the columns of Q⁻¹, Q the observability matrix, are the fields
X_{i,k} = ∂/∂ξ_{i,k}. Since Q X is constant, the second derivative of F = L_f^κ h_r along two of them is D²F(X, X') −
dF Q⁻¹ D²ξ(X, X'): slopes of one program, in ball arithmetic, in milliseconds, and a no is certain.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

import sympy as sp
from flint import arb, arb_mat, ctx

from ulna.base import Verdict
from ulna.geometry import Observability
from ulna.program import BITS, balls_by_name, lie_derivatives, slopes_along
from ulna.symbolic.compiling import kernel
from ulna.symbolic.exact import SEED, Point, attempt, exact_ball, random_points

_SECONDS = 4.0
_POINTS = 2
_TRIES = 12
Coordinate = tuple[int, int]
"""(i, k) of ξ_{i,k}."""
Entry = tuple[int, Coordinate, Coordinate]
"""(r, a, b) of ∂²L_f^{κ_r} h_r / ∂ξ_a ∂ξ_b."""
_Balls = Callable[[Mapping[str, arb]], dict[str, arb]]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Derivatives:
    """Slopes of `h i:k` = L_f^k h_i over states and parameters, the symbols, along x/1, and along x/1 and x/2."""

    symbols: tuple[sp.Symbol, ...]
    first: _Balls
    second: _Balls


def refutation_at_a_point(seen: Observability) -> Verdict:
    """Refuted with a `point` and the direction's `name` if the form is impossible there, undecided otherwise.

    With one output the slope of a_n(y) is μ = ∂L_f^n h/∂ξ_{n−1}, which must be a function of y: ∂μ/∂ξ_m = 0 for m ≥ 1.
    The brackets begin with [τ, ad_f τ] = ±(L_τ μ) τ, so for n ≥ 3 no output transformation helps where
    L_τ μ = ∂μ/∂ξ_{n−1} is not 0.

    Args:
        seen: an observable plant with one output and n ≥ 2 states. The evidence's `any_psi` says that no output
            transformation helps either.
    """
    n = len(seen.view.x)
    claim = f"L_v μ = 0 along ker dh, μ the slope of a_n(y) in '{seen.system.name}'"
    entries: list[Entry] = [(0, (0, n - 1), (0, m)) for m in range(n - 1, 0, -1)]
    found = attempt(_SECONDS, "slopes at a point", lambda: list(islice(_at_points(seen, entries), _POINTS)))
    if found.value is None:
        return Verdict.undecided(claim, tried=found.reason)
    for point, slopes in found.value:
        if n >= 3 and not slopes[0].contains(0):
            return Verdict.refuted(claim, point=point, name="τ", value=_decimal(slopes[0]), any_psi=True)
        along_kernel = next((value for value in slopes if not value.contains(0)), None)
        if along_kernel is not None:
            return Verdict.refuted(claim, point=point, name="ker dh", value=_decimal(along_kernel), any_psi=False)
    return Verdict.undecided(claim, tried=f"{len(found.value)} random points")


def _at_points(seen: Observability, entries: Sequence[Entry]) -> Iterator[tuple[Point, list[arb]]]:
    """Random points where Q is regular, with the second derivatives there."""
    derivatives = _derivatives(seen)
    for point in islice(random_points(derivatives.symbols, seed=SEED), _TRIES):
        values = _second_derivatives(derivatives, seen, entries, point)
        if values is not None:
            yield point, values


def refuted_by_two_points(seen: Observability, entries: Sequence[Entry]) -> Verdict:
    """Refuted with two points of the same outputs at which a second derivative differs; undecided otherwise.

    Args:
        seen: an observable plant whose outputs are states.
        entries: the derivatives that must be functions of the outputs, whatever the output transformation.
    """
    claim = "the coefficients of the fastest terms are functions of the outputs"
    derivatives = _derivatives(seen)
    fixed = set(derivatives.symbols) - set(seen.view.x) | set(seen.view.h)
    points = list(islice(random_points(derivatives.symbols, seed=SEED), _TRIES))
    for first, other in zip(points[::2], points[1::2], strict=True):
        second = {s: first[s] if s in fixed else value for s, value in other.items()}
        here, there = (_second_derivatives(derivatives, seen, entries, place) for place in (first, second))
        if here is None or there is None:
            continue
        for entry, a, b in zip(entries, here, there, strict=True):
            if not (a - b).contains(0):
                values = (_decimal(a), _decimal(b))
                return Verdict.refuted(claim, entry=entry, points=(first, second), values=values, any_psi=True)
        break
    return Verdict.undecided(claim, tried="two random points")


def _derivatives(seen: Observability) -> _Derivatives:
    view = seen.view
    held = sorted((view.f.free_symbols | view.h.free_symbols) - set(view.x), key=str)
    rates = {f"rate {x.name}": rate for x, rate in zip(view.x, view.f, strict=True)}
    drift = kernel("drift", (*view.x, *held), {**rates, **{f"h {i}": h for i, h in enumerate(view.h)}})
    names = [x.name for x in view.x]
    program = lie_derivatives(drift, names, list(rates), max(seen.indices))
    once = slopes_along(program, {x: f"{x}/1" for x in names})
    return _Derivatives(
        symbols=(*view.x, *held),
        first=balls_by_name(once),
        second=balls_by_name(slopes_along(once, {x: f"{x}/2" for x in names})),
    )


def _second_derivatives(
    derivatives: _Derivatives, seen: Observability, entries: Sequence[Entry], point: Point
) -> list[arb] | None:
    """The entries at a point; None where Q is singular or a value does not exist."""
    names = [x.name for x in seen.view.x]
    n, sizes = len(names), seen.indices
    place = {s.name: exact_ball(value) for s, value in point.items()}
    columns = [derivatives.first({**place, **{f"{y}/1": arb(int(x == y)) for y in names}}) for x in names]
    rows = [(i, k) for i, size in enumerate(sizes) for k in range(size)]
    with ctx.workprec(BITS):
        Q = arb_mat([[column[f"h {i}:{k}"] for column in columns] for i, k in rows])
        try:
            fields = Q.solve(arb_mat([[arb(int(i == j)) for j in range(n)] for i in range(n)]))
        except ZeroDivisionError:
            return None
    place_of = {row: b for b, row in enumerate(rows)}
    found = []
    for r, *pair in entries:
        top = f"h {r}:{sizes[r]}"
        along = {
            f"{x}/{side}": fields[a, place_of[row]]
            for side, row in enumerate(pair, start=1)
            for a, x in enumerate(names)
        }
        bends = derivatives.second({**place, **along})
        with ctx.workprec(BITS):
            slope = [sum((column[top] * fields[a, b] for a, column in enumerate(columns)), arb(0)) for b in range(n)]
            bent = sum((slope[b] * bends[f"h {i}:{k}"] for b, (i, k) in enumerate(rows)), arb(0))
            found.append(bends[top] - bent)
    return found if all(value.is_finite() for value in found) else None


def _decimal(value: arb) -> sp.Expr:
    return sp.Float(value.mid().str(20, radius=False), 20)
