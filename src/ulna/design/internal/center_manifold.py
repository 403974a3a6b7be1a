"""Centre manifolds: a critical equilibrium reduced to the modes on the imaginary axis, exactly, to a finite order.

J. Carr, Applications of Centre Manifold Theory (1981), theorems 1 to 3: the equilibrium is stable, asymptotically
stable or unstable as it is in the reduced dynamics, provided the other modes are stable.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import sympy as sp

from ulna.symbolic.exact import generic_rank, null_space, tidy
from ulna.symbolic.solving import taylor_coefficients

Row = tuple[sp.Expr, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CenterModes:
    """A splitting of the linear part A: A E = E J with the spectrum of J on the axis, A S = S P with that of P left.

    Attributes:
        center: (n, c) E; reduced: (c, c) J; stable: (n, n − c) S; rest: (n − c, n − c) P.
        coordinates: (c,) symbols of the reduced state.
    """

    center: sp.ImmutableDenseMatrix
    reduced: sp.ImmutableDenseMatrix
    stable: sp.ImmutableDenseMatrix
    rest: sp.ImmutableDenseMatrix
    coordinates: tuple[sp.Symbol, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReducedOrder:
    """The terms of one degree: reduced rates R_k and centre manifold h_k, homogeneous polynomials in ξ."""

    degree: int
    rates: Row
    manifold: Row


def center_modes(A: sp.MatrixBase, *, zero: int, squares: Sequence[sp.Expr]) -> CenterModes:
    """The splitting for at most two critical modes: 0 once or twice, or one pair ±iω.

    In the reduced coordinates J is 0, the Jordan block [[0, 1], [0, 0]], or [[0, 1], [−ω², 0]].

    Args:
        A: (n, n) exact numbers.
        zero: multiplicity of the eigenvalue 0.
        squares: ω² of the pairs.
    """
    n = A.rows
    annihilator = A**zero
    for square in squares:
        annihilator = annihilator * (A**2 + square * sp.eye(n))
    annihilator = annihilator.applyfunc(sp.expand)
    kernel = null_space(A if zero == 1 and not squares else annihilator)
    chain = next((b for b in kernel if any(e != 0 for e in (A * b).applyfunc(tidy))), None)
    if chain is not None and len(kernel) == 2:
        kernel = ((A * chain).applyfunc(sp.expand), chain)
    center = sp.Matrix.hstack(*kernel)
    c = center.cols
    stable = sp.Matrix(annihilator)[:, list(generic_rank(annihilator).columns)]
    both = center.row_join(stable)
    blocks = (both.inv() * A * both).applyfunc(tidy)
    return CenterModes(
        center=sp.ImmutableDenseMatrix(center),
        reduced=sp.ImmutableDenseMatrix(blocks[:c, :c]),
        stable=sp.ImmutableDenseMatrix(stable),
        rest=sp.ImmutableDenseMatrix(blocks[c:, c:]),
        coordinates=tuple(sp.Symbol(f"s{k + 1}", real=True) for k in range(c)),
    )


def reduced_orders(
    rates: Sequence[sp.Expr], coordinates: Sequence[sp.Symbol], modes: CenterModes, order: int
) -> Iterator[ReducedOrder]:
    """The reduced dynamics ξ' = J ξ + R_2 + R_3 + …, one degree after the other, up to `order`.

    Degree k of the invariance condition: Dh_k J ξ − P h_k = N_k − Σ_{j<k} Dh_j R_{k+1−j}.

    Args:
        rates: F(x) with F(0) = 0 and ∂F/∂x(0) = A; coordinates: x.
        modes: the splitting of A.
        order: highest degree.
    """
    xi, c = modes.coordinates, len(modes.coordinates)
    if c == 1:
        yield from _scalar_orders(rates, coordinates, modes, order)
        return
    both = modes.center.row_join(modes.stable)
    back = both.inv()
    linear = modes.reduced * sp.Matrix(list(xi))
    start = modes.center * sp.Matrix(list(xi))
    curve: dict[sp.Symbol, list[sp.Expr]] = {x: [sp.Integer(0), start[i]] for i, x in enumerate(coordinates)}
    lower: list[ReducedOrder] = []
    for degree in range(2, order + 1):
        series = taylor_coefficients(rates, curve, degree)
        forcing = (back * sp.Matrix([s[degree] for s in series])).applyfunc(sp.expand)
        right = forcing[c:, :]
        for one in lower:
            partner = next((r for r in lower if r.degree == degree + 1 - one.degree), None)
            if partner is not None and one.manifold:
                right -= sp.Matrix(list(one.manifold)).jacobian(list(xi)) * sp.Matrix(list(partner.rates))
        manifold = _homological(right.applyfunc(sp.expand), modes, linear, degree)
        found = ReducedOrder(degree=degree, rates=tuple(forcing[:c, :]), manifold=manifold)
        lower.append(found)
        bend = modes.stable * sp.Matrix(list(manifold)) if manifold else sp.zeros(len(coordinates), 1)
        for i, x in enumerate(coordinates):
            curve[x].append(sp.expand(bend[i]))
        yield found


def _scalar_orders(
    rates: Sequence[sp.Expr], coordinates: Sequence[sp.Symbol], modes: CenterModes, order: int
) -> Iterator[ReducedOrder]:
    """The same for one reduced coordinate with J = 0, in plain numbers: −P h_k = N_k − Σ_j j h_j r_{k+1−j}."""
    [s] = modes.coordinates
    both = modes.center.row_join(modes.stable)
    back = both.inv()
    resolved = modes.rest.inv() if modes.rest.rows else modes.rest
    curve = {x: [sp.Integer(0), modes.center[i, 0]] for i, x in enumerate(coordinates)}
    slopes: dict[int, sp.Expr] = {}
    bends: dict[int, sp.MatrixBase] = {}
    for degree in range(2, order + 1):
        series = taylor_coefficients(rates, curve, degree)
        forcing = back * sp.Matrix([one[degree] for one in series])
        right = forcing[1:, :]
        for j, bend in bends.items():
            right -= j * slopes.get(degree + 1 - j, 0) * bend
        slopes[degree] = sp.expand(forcing[0, 0])
        bends[degree] = (-resolved * right).applyfunc(sp.expand)
        moved = modes.stable * bends[degree]
        for i, x in enumerate(coordinates):
            curve[x].append(moved[i, 0] if moved.rows and moved.cols else sp.Integer(0))
        yield ReducedOrder(
            degree=degree,
            rates=(slopes[degree] * s**degree,),
            manifold=tuple(h * s**degree for h in bends[degree]),
        )


def _homological(right: sp.MatrixBase, modes: CenterModes, linear: sp.MatrixBase, degree: int) -> Row:
    """H with Dh J ξ − P h = right, homogeneous of the degree."""
    count = right.rows
    if not count:
        return ()
    xi = modes.coordinates
    monomials = [sp.Mul(*chosen) for chosen in combinations_with_replacement(xi, degree)]
    unknowns = [[sp.Dummy("h") for _ in monomials] for _ in range(count)]
    h = sp.Matrix([sp.Add(*(a * m for a, m in zip(row, monomials, strict=True))) for row in unknowns])
    residual = h.jacobian(list(xi)) * linear - modes.rest * h - right
    equations = [e for entry in residual for e in sp.Poly(sp.expand(entry), *xi).coeffs()]
    flat = [a for row in unknowns for a in row]
    [solution] = sp.linsolve(equations, flat)
    values = dict(zip(flat, solution, strict=True))
    return tuple(sp.expand(entry.xreplace(values)) for entry in h)


def planar_field(orders: Sequence[ReducedOrder], modes: CenterModes) -> Row:
    """The reduced rates of a two-dimensional centre manifold, all degrees together."""
    linear = modes.reduced * sp.Matrix(list(modes.coordinates))
    return tuple(
        sp.expand(linear[i] + sp.Add(*(one.rates[i] for one in orders))) for i in range(len(modes.coordinates))
    )
