"""The coefficients Γ^r_{jm} of `transformed_blocks` in numbers, for plants whose derivatives are long.

X_j = Q⁻¹ e_j are the fields ∂/∂ξ_j of the observability matrix Q. Since Q X_j is constant, the second derivative of
F = L_f^κ h_r along X_j and X_m in the coordinates ξ is D²F(X_j, X_m) − dF Q⁻¹ D²ξ(X_j, X_m): slopes of one program, in
ball arithmetic (`second_slopes`). Two points with the same outputs and another Γ are a certain no to every Ψ.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice

import sympy as sp
from flint import arb, arb_mat, ctx

from ulna.base import Verdict
from ulna.geometry import Observability
from ulna.program import BITS, Kernel, lie_derivatives, second_slopes
from ulna.symbolic.compiling import kernel
from ulna.symbolic.exact import SEED, Point, exact_ball, random_points

_TRIES = 10
Entry = tuple[int, int, int]


def refuted_by_two_points(seen: Observability, entries: Sequence[Entry]) -> Verdict:
    """Refuted with two points of the same outputs at which a Γ^r_{jm} differs; undecided otherwise.

    Args:
        seen: an observable plant whose outputs are states.
        entries: (r, j, m) to be looked at.
    """
    view = seen.view
    claim = "the coefficients of the fastest terms are functions of the outputs"
    held = sorted((view.f.free_symbols | view.h.free_symbols) - set(view.x), key=str)
    rates = {f"rate {x.name}": rate for x, rate in zip(view.x, view.f, strict=True)}
    outputs = {f"h {i}": h for i, h in enumerate(view.h)}
    drift = kernel("drift", (*view.x, *held), {**rates, **outputs})
    program = lie_derivatives(drift, [x.name for x in view.x], list(rates), max(seen.indices))
    points = list(islice(random_points([*view.x, *held], seed=SEED), _TRIES))
    for first, other in zip(points[::2], points[1::2], strict=True):
        second = {s: value if s in view.x and s not in view.h else first[s] for s, value in other.items()}
        here, there = (_at(program, seen, entries, place) for place in (first, second))
        if here is None or there is None:
            continue
        for entry, a, b in zip(entries, here, there, strict=True):
            if not (a - b).contains(0):
                values = (_decimal(a), _decimal(b))
                return Verdict.refuted(claim, entry=entry, points=(first, second), values=values, any_psi=True)
        break
    return Verdict.undecided(claim, tried="two random points")


def _decimal(value: arb) -> sp.Expr:
    return sp.Float(value.mid().str(20, radius=False), 20)


def _at(program: Kernel, seen: Observability, entries: Sequence[Entry], point: Point) -> list[arb] | None:
    """Γ at a point; None where the observability matrix is singular or a value does not exist."""
    names = [x.name for x in seen.view.x]
    n, sizes = len(names), seen.indices
    place = {s.name: exact_ball(value) for s, value in point.items()}
    columns = [second_slopes(program, place, {x: arb(1)}) for x in names]
    rows = [(i, k) for i, size in enumerate(sizes) for k in range(size)]
    with ctx.workprec(BITS):
        Q = arb_mat([[columns[j][f"h {i}:{k}"][1] for j in range(n)] for i, k in rows])
        try:
            fields = Q.solve(arb_mat([[arb(int(i == j)) for j in range(n)] for i in range(n)]))
        except ZeroDivisionError:
            return None
    along = {row: {x: fields[a, b] for a, x in enumerate(names)} for b, row in enumerate(rows)}
    found = []
    for r, j, m in entries:
        size = sizes[r]
        jets = second_slopes(program, place, along[j, size - 1], along[m, 1])
        with ctx.workprec(BITS):
            slope = [sum((columns[a][f"h {r}:{size}"][1] * fields[a, b] for a in range(n)), arb(0)) for b in range(n)]
            bent = sum((slope[b] * jets[f"h {i}:{k}"][3] for b, (i, k) in enumerate(rows)), arb(0))
            found.append(jets[f"h {r}:{size}"][3] - bent)
    return found if all(value.is_finite() for value in found) else None
