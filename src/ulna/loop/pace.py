"""How fast the plant moves: what tells whether the steps between two samples are short enough."""

from __future__ import annotations

import math
from typing import Any

from ulna.base import UlnaError
from ulna.loop.fitted import Fitted
from ulna.loop.rows import roles, row_of
from ulna.program import Assembly, Kernel, Scalar, tangents

ROUNDS = 16
"""Products of the slopes with a vector: the root of this order leaves little of units and of the vector."""


def pace(loop: Fitted, plant: Kernel, *, constants: dict[str, str], disturbances: int) -> Kernel:
    """The kernel of `pace`: (period · fastest rate of the plant at a sample)^(2 · ROUNDS), see `periods_of`.

    The rate is the growth of a vector under the slopes ∂x'/∂x, which tends to their largest eigenvalue in size.

    Args:
        loop: hardware and wiring. plant: rates `x'k`. constants: slot of each number that depends on parameters.
        disturbances: how many are slots.
    """
    w, n = Assembly("pace"), len(loop.wiring.plant.states)
    best = w.input("pace")
    if loop.wiring.plant.discrete:
        return loop.finished(w.finished({"pace": best}))
    try:
        slopes = tangents(row_of(plant, "x'"), [f"x{k}" for k in range(n)], piecewise=True)
    except UlnaError:
        # A function without a rule: nothing is known of the rate.
        return w.finished({"pace": best})
    known = roles(
        x=w.inputs("x", n),
        u=[w.input(f"ub{k}") for k in range(len(loop.wiring.driven))],
        d=w.inputs("d", disturbances),
    )
    known |= {name: w.input(slot) for name, slot in constants.items()} | {"t": w.input("time")}
    found = w.call(loop.written(slopes), known)
    rows = [[found[f"x'{i}/x{j}"] for j in range(n)] for i in range(n)]
    zero = w.constant(0.0)
    rows = [[None if each.index == zero.index else each for each in row] for row in rows]
    # No direction of a plant with symmetries is orthogonal to this one.
    start = [0.5 + math.modf((k + 1) * (math.sqrt(5.0) - 1.0) / 2.0)[0] for k in range(n)]
    vector: list[Scalar | None] = [w.constant(each) for each in start]
    period = w.input("period")
    for _ in range(ROUNDS if n else 0):
        vector = [_scaled(period, _sum(row, vector)) for row in rows]
    size = _sum(vector, vector)
    total = zero if size is None else size / sum(each**2 for each in start)
    return loop.finished(w.finished({"pace": total.more(best).where(total, best)}))


def _sum(row: list[Scalar | None], vector: list[Scalar | None]) -> Scalar | None:
    """Σ row · vector; None is zero."""
    total: Scalar | None = None
    for factor, value in zip(row, vector, strict=True):
        if factor is not None and value is not None:
            total = factor * value if total is None else factor.fused(value, total)
    return total


def _scaled(period: Scalar, value: Scalar | None) -> Scalar | None:
    return None if value is None else period * value


def periods_of(pace: Any) -> Any:
    """period · fastest rate, of the number that a run answers with."""
    return pace ** (1.0 / (2 * ROUNDS))


def pace_of(periods: float) -> float:
    """The number of a period · rate."""
    return periods ** (2 * ROUNDS)
