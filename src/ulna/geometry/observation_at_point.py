"""The rank at a point of all differentials dL_f^k h_i, k < n, in balls: the functions themselves are not formed.

Where a point is singular the rows that suffice elsewhere do not, and the higher ones grow by a factor each. Their
values come from Taylor coefficients of the flow and slopes of that program: milliseconds.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import islice

import sympy as sp
from flint import arb, ctx

from ulna.program import BITS, balls_by_name, lie_derivatives, slopes_along
from ulna.symbolic.compiling import kernel
from ulna.symbolic.exact import SEED, Rank, exact_ball, random_points, rank_of_balls
from ulna.system import ControlAffine


def rank_of_all_rows(view: ControlAffine, point: Mapping[sp.Symbol, sp.Expr]) -> Rank:
    """The rank at the point of all dL_f^k h_i, k < n; parameters without a value there stand at random numbers.

    The value is certain from below; the verdict is proved where what is left after elimination is exactly zero.

    Args:
        view: the plant.
        point: a value for every state.

    Raises:
        UlnaError: for terms without derivatives.
    """
    n = len(view.x)
    held = sorted((view.f.free_symbols | view.h.free_symbols) - set(view.x), key=str)
    rates = {f"rate {x.name}": rate for x, rate in zip(view.x, view.f, strict=True)}
    outputs = {f"h {i}": h for i, h in enumerate(view.h)}
    drift = kernel("drift", (*view.x, *held), {**rates, **outputs})
    program = lie_derivatives(drift, [x.name for x in view.x], list(rates), n - 1)
    free = [s for s in held if s not in point]
    numbers = next(islice(random_points(free, seed=SEED), 1, None)) | {s: point[s] for s in held if s in point}
    place = {s.name: exact_ball(value) for s, value in numbers.items()}
    with ctx.workprec(BITS):
        place |= {x.name: exact_ball(point[x].xreplace(numbers)) for x in view.x}
    names = [x.name for x in view.x]
    slopes = balls_by_name(slopes_along(program, {x: f"{x}/1" for x in names}))
    columns = [slopes({**place, **{f"{y}/1": arb(int(x == y)) for y in names}}) for x in names]
    rows = [[column[f"{name}:{k}"] for column in columns] for k in range(n) for name in outputs]
    with ctx.workprec(BITS):
        return rank_of_balls(rows, point={**numbers, **point})
