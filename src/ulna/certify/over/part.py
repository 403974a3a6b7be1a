"""`Part`: a box of parameter values, the equilibrium over it, and the characteristic polynomial there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import sympy as sp
from flint import arb, arb_mat
from sympy.polys.matrices import DomainMatrix

from ulna.certify.region import Form, Rest, Slopes, ball, decays, slopes_of
from ulna.program import to_balls
from ulna.symbolic.compiling import kernel

_ROUNDS = 12
_INFLATED = 1.1
_SLACK = 0.8
"""Room for the second program, whose balls are other ones."""

ParameterBox = tuple[tuple[sp.Rational, sp.Rational], ...]
"""Middle and half-width of every parameter."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Part:
    """What shows a local claim on a box of parameters.

    Attributes:
        box: of the parameters. found: for each of their values one equilibrium lies in it, and no limit is met there.
    """

    box: ParameterBox
    found: Rest


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Family:
    """A loop whose parameters have no values yet.

    Attributes:
        slopes: by coordinates; of the parameters they get values by `Slopes.at`.
        drift: (n m) slopes of the rates by the parameters, row by row.
        coefficients: c₁ … cₙ of det(λ − A). turns: (n (n + m)) slopes of these, row by row.
    """

    slopes: Slopes
    drift: Callable[..., tuple[arb, ...]]
    coefficients: Callable[..., tuple[arb, ...]]
    turns: Callable[..., tuple[arb, ...]]

    @property
    def sizes(self) -> tuple[int, int]:
        """Coordinates, parameters."""
        return len(self.slopes.form.symbols), len(self.slopes.form.limited.parameters)


def family_of(form: Form) -> Family:
    """The derivatives of a form with parameters, compiled."""
    parameters, given = list(form.limited.parameters), [*form.symbols, *form.limited.parameters]
    closed = sp.Matrix(form.closed)
    coefficients = characteristic(closed.jacobian(list(form.symbols)))
    return Family(
        slopes=slopes_of(form),
        drift=_balls("drift", given, list(closed.jacobian(parameters))),
        coefficients=_balls("coefficients", given, coefficients),
        turns=_balls("turns", given, list(sp.Matrix(coefficients).jacobian(given))),
    )


def characteristic(matrix: sp.Matrix) -> list[sp.Expr]:
    """c₁ … cₙ of det(λ − A), in closed form."""
    # To the field of fractions a function is one more symbol.
    functions = {f: sp.Dummy() for f in sorted(matrix.atoms(sp.Function), key=sp.default_sort_key)}
    entries = DomainMatrix.from_Matrix(matrix.xreplace(functions)).to_field()
    back = {symbol: f for f, symbol in functions.items()}
    return [entries.domain.to_sympy(c).xreplace(back) for c in entries.charpoly()[1:]]


def _balls(name: str, given: list[sp.Symbol], entries: Iterable[sp.Expr]) -> Callable[..., tuple[arb, ...]]:
    return to_balls(kernel(name, given, {f"e{k}": e for k, e in enumerate(entries)}))


def at(box: ParameterBox) -> list[arb]:
    """The box in balls."""
    return [ball(middle) + arb(0, 1) * ball(half) for middle, half in box]


def middle_of(box: ParameterBox) -> ParameterBox:
    """The point in its middle."""
    return tuple((middle, sp.Integer(0)) for middle, _ in box)


def rest_over(family: Family, box: ParameterBox, x: np.ndarray) -> Rest | None:
    """A box with an equilibrium for every value of the parameters; None where none is shown.

    Krawczyk's test for δ in x₀ + S (p − p₀) + δ, S the slope of the equilibrium at the middle: what is left for δ is
    of second order.
    """
    n, m = family.sizes
    center = tuple(sp.Rational(repr(float(v))) for v in x)
    point, values, sides = [ball(c) for c in center], at(box), [float(half) for _, half in box]
    still, whole = family.slopes.at([ball(p) for p, _ in box]), family.slopes.at(values)
    inverse = _inverse(still, x)
    if inverse is None:
        return None
    drift = arb_mat(n, m, list(family.drift(*point, *[ball(p) for p, _ in box])))
    slope = np.array([[-float((inverse * drift)[i, j].mid()) for j in range(m)] for i in range(n)]).reshape(n, m)
    reach = [sum(abs(slope[i, j]) * sides[j] for j in range(m)) * (1 + 1e-9) for i in range(n)]
    moved = [c + arb(0, r) for c, r in zip(point, reach, strict=True)]
    start = arb_mat(n, 1, list(still.values(*point)[:n]))
    turn = whole.free(moved) * arb_mat(n, m, [arb(v) for v in slope.ravel()])
    turn = turn + arb_mat(n, m, list(family.drift(*moved, *values)))
    offset = inverse * (start + turn * arb_mat(m, 1, [arb(0, 1) * ball(half) for _, half in box]))
    radii = [1.5 * float(offset[i, 0].abs_upper()) + 1e-13 * (1 + abs(float(x[i]))) for i in range(n)]
    for _ in range(_ROUNDS):
        around = [arb(0, r) for r in radii]
        product = inverse * whole.free([c + d for c, d in zip(moved, around, strict=True)])
        tested = []
        for i in range(n):
            total = -offset[i, 0]
            for j in range(n):
                total += ((arb(1) if i == j else arb(0)) - product[i, j]) * around[j]
            tested.append(float(total.abs_upper()))
        if not np.isfinite(tested).all():
            return None
        if all(a < _SLACK * r for a, r in zip(tested, radii, strict=True)):
            return Rest(center=center, radii=tuple(sp.Rational(r + a) for r, a in zip(radii, reach, strict=True)))
        radii = [max(_INFLATED * a / _SLACK, r) for a, r in zip(tested, radii, strict=True)]
    return None


def _inverse(slopes: Slopes, x: np.ndarray) -> arb_mat | None:
    """About that of the slopes at a point."""
    try:
        near = la.inv(slopes.numbers(x))
    except (la.LinAlgError, ValueError):
        return None
    n = len(x)
    return arb_mat(n, n, [arb(float(v)) for v in near.ravel()]) if np.isfinite(near).all() else None


def within_limits(slopes: Slopes, found: Rest) -> bool:
    """Whether the loop is defined and no limit is met at the equilibrium."""
    n, m = slopes.sizes
    box, limited = found.balls, slopes.form.limited
    commands = slopes.values(*box)[n : n + m]
    bounds = zip(commands, limited.lower, limited.upper, strict=True)
    return all(value > ball(low) and value < ball(high) for value, low, high in bounds) and slopes.domain.holds(box)


def coefficients_over(family: Family, box: ParameterBox, found: Rest) -> tuple[list[arb], np.ndarray] | None:
    """c₁ … cₙ of det(λ − A) at the equilibrium, and by how much each parameter moves each of them, (n, m).

    By the mean-value form in the parameters along the equilibrium as it moves.
    """
    n, m = family.sizes
    still = rest_over(family, middle_of(box), found.numbers)
    if still is None:
        return None
    point, values = found.balls, at(box)
    inverse = _inverse(family.slopes.at([ball(p) for p, _ in box]), found.numbers)
    drift = arb_mat(n, m, list(family.drift(*point, *values)))
    try:
        # Times an inverse of the middle the matrix is nearly 1.
        moved = None if inverse is None else (inverse * family.slopes.at(values).free(point)).solve(inverse * drift)
    except ZeroDivisionError:
        return None
    if moved is None:
        return None
    start = family.coefficients(*still.balls, *at(middle_of(box)))
    turns = family.turns(*point, *values)
    steps = np.zeros((n, m))
    whole = list(start)
    for k in range(n):
        for j in range(m):
            turn = turns[k * (n + m) + n + j]
            for i in range(n):
                turn -= turns[k * (n + m) + i] * moved[i, j]
            step = turn * arb(0, 1 / _SLACK) * ball(box[j][1])
            whole[k] += step
            steps[k, j] = float(step.abs_upper())
    return whole, steps


def all_decay(coefficients: Sequence[arb]) -> bool:
    """Whether every polynomial λⁿ + c₁λⁿ⁻¹ + … with coefficients in these balls has all roots left of the axis.

    V. L. Kharitonov, "Asymptotic stability of an equilibrium position of a family of systems of linear differential
    equations", Differential Equations 14 (1979): four of them are enough.
    """
    if not all(c.is_finite() for c in coefficients):
        return False
    n = len(coefficients)
    # From the constant term up each of the four takes two lower ends and two upper ones by turns.
    for turn in range(4):
        corner = [arb(1)]
        for k, c in enumerate(coefficients, 1):
            corner.append(c.lower() if (n - k + turn) % 4 < 2 else c.upper())
        if not decays(corner):
            return False
    return True


def halves_of(box: ParameterBox, axis: int) -> Iterator[ParameterBox]:
    """The lower half, then the upper one."""
    middle, half = box[axis]
    for sign in (-1, 1):
        yield (*box[:axis], (middle + sign * half / 2, half / 2), *box[axis + 1 :])
