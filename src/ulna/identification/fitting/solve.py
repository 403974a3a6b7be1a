"""The least-squares search: Gauss-Newton steps in a region of trust, by exact slopes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ulna.identification.errors import IdentificationError
from ulna.identification.fitting.problem import Problem, Rows
from ulna.identification.fitting.start import GlobalStart, first_unknowns, tries


@dataclass(frozen=True, slots=True, kw_only=True)
class Robust:
    """Count large residuals less: beyond so many standard deviations of the noise their cost grows only linearly.

    Raises:
        IdentificationError: a number that is not positive.

    Examples:
        >>> loss = ulna.Robust(sigmas=3.0)  # ulna.identify(..., loss=loss)
        >>> loss.sigmas
        3.0
    """

    sigmas: float = 2.0

    def __post_init__(self) -> None:
        if not self.sigmas > 0.0:
            raise IdentificationError(f"Robust(sigmas={self.sigmas})", "it is not positive.", "2 is usual.")


@dataclass(frozen=True, slots=True, kw_only=True)
class MultipleShooting:
    """Cut each run into segments that begin at states of their own and are tied end to end.

    For unstable plants, whose motion over the whole record says nothing of where it began.

    Raises:
        IdentificationError: fewer than two segments.

    Examples:
        >>> ulna.MultipleShooting(segments=40)  # for records that start unstable plants or chaos
        MultipleShooting(segments=40)
    """

    segments: int = 20

    def __post_init__(self) -> None:
        if self.segments < 2:
            raise IdentificationError(f"MultipleShooting(segments={self.segments})", "expected at least two.")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solution:
    """Where a search ended.

    Attributes:
        unknowns: (Q,). rows: there. weights: (R,) by which rows counted, 1 but for a robust loss.
        converged: whether it stopped because nothing improves. stopped: what stopped it, in words.
        evaluations: of the model. held: (Q,) whether an unknown stands at its bound. cost: half the sum of squares.
    """

    unknowns: np.ndarray
    rows: Rows
    weights: np.ndarray
    converged: bool
    stopped: str
    evaluations: int
    held: np.ndarray

    cost: float


SUNK = 0.05
"""A positive parameter that sinks below this share of its start may want to be negative, where it may."""

_STOPPED = {
    0: "the largest number of evaluations",
    1: "the gradient vanished",
    2: "the sum of squares no longer changed",
    3: "the unknowns no longer changed",
    4: "the sum of squares and the unknowns no longer changed",
}


def solved(
    problem: Problem, start: np.ndarray, *, loss: Robust | None = None, most: int = 100, fixed: int | None = None
) -> Solution:
    """The search from a start.

    Args:
        problem: what is solved. start: (Q,). loss: None for squares. most: evaluations. fixed: an unknown that stays.

    Raises:
        IdentificationError: a model without values at the start.
    """
    lower, upper = problem.bounds
    moving = np.ones(problem.size, dtype=bool)
    if fixed is not None:
        moving[fixed] = False
    whole = np.clip(start, lower, upper)
    if not problem.rows(_inside(whole, lower, upper)).finite:
        raise no_value(problem)
    if not moving.any():
        rows = problem.rows(whole)
        return Solution(
            unknowns=whole,
            rows=rows,
            weights=np.ones(len(rows.residual)),
            converged=True,
            stopped="nothing is free",
            evaluations=1,
            held=np.zeros(problem.size, dtype=bool),
            cost=cost_of(rows, loss),
        )

    lows, highs = lower[moving], upper[moving]
    begin = _inside(whole[moving], lows, highs)
    positive = (begin > 0.0) & (np.arange(problem.size)[moving] < len(problem.free))
    search = partial(_searched, problem, whole, moving, loss, most)
    found, ended = search(begin, positive)
    evaluations = int(found.nfev)
    sunk = positive & (lows < 0.0) & (ended < SUNK * begin)
    if sunk.any():
        found, ended = search(ended, positive & ~sunk)
        evaluations += int(found.nfev)
    point = whole.copy()
    point[moving] = ended
    rows = problem.rows(point)
    held = np.zeros(problem.size, dtype=bool)
    held[moving] = (found.active_mask != 0) | _near(ended, lows, highs)
    return Solution(
        unknowns=point,
        rows=rows,
        weights=weights(rows.residual, loss),
        converged=found.status > 0,
        stopped=_STOPPED.get(int(found.status), "the solver failed"),
        evaluations=evaluations,
        held=held,
        cost=cost_of(rows, loss),
    )


def _searched(
    problem: Problem,
    whole: np.ndarray,
    moving: np.ndarray,
    loss: Robust | None,
    most: int,
    begin: np.ndarray,
    positive: np.ndarray,
) -> tuple[Any, np.ndarray]:
    """(what SciPy's search says, the moving unknowns where it ended), those that are `positive` by their logarithms."""
    from scipy.optimize import least_squares

    lower, upper = problem.bounds
    way = _Coordinates(logarithmic=positive, lower=lower[moving], upper=upper[moving])

    def pressed(part: np.ndarray) -> np.ndarray:
        point = whole.copy()
        point[moving] = way.plain(part)
        return compressed(problem.rows(point), loss, moving)

    found = least_squares(
        lambda part: pressed(part)[:, -1],
        way.searched(begin),
        jac=lambda part: pressed(part)[:, :-1] * way.slopes(part),
        bounds=way.bounds,
        x_scale="jac",
        xtol=1e-9,
        ftol=1e-9,
        gtol=1e-12,
        max_nfev=most,
    )
    return found, way.plain(found.x)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Coordinates:
    """What is searched in: positive parameters by their logarithms, in which products and ratios are straight.

    Plants are made of these; along them the valleys of the sum of squares are curved else, and steps are short.
    """

    logarithmic: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    def plain(self, part: np.ndarray) -> np.ndarray:
        with np.errstate(over="ignore"):
            return np.where(self.logarithmic, np.exp(np.where(self.logarithmic, part, 0.0)), part)

    def searched(self, values: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore"):
            logarithms = np.log(np.where(self.logarithmic, np.maximum(values, 0.0), 1.0))
        return np.where(self.logarithmic, logarithms, values)

    def slopes(self, part: np.ndarray) -> np.ndarray:
        """∂ plain / ∂ searched."""
        return np.where(self.logarithmic, self.plain(part), 1.0)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return self.searched(self.lower), self.searched(self.upper)


def compressed(rows: Rows, loss: Robust | None, moving: np.ndarray) -> np.ndarray:
    """(q + 1, q + 1) R of Q R = [slopes, residual]: as many rows as unknowns, with the same sums of squares and slopes.

    A robust loss ρ is written as squares, of sign(r) √(2 ρ(r)).
    """
    residual, slopes = rows.residual, rows.slopes[:, moving]
    count = slopes.shape[1] + 1
    if not rows.finite:
        return np.full((count, count), np.inf)
    if loss is not None:
        size, limit = np.abs(residual), loss.sigmas
        bent = np.sqrt(np.maximum(2.0 * limit * size - limit**2, 0.0))
        beyond = size > limit
        slopes = slopes * np.where(beyond, limit / np.where(beyond, bent, 1.0), 1.0)[:, None]
        residual = np.where(beyond, np.sign(residual) * bent, residual)
    return triangle(np.concatenate([slopes, residual[:, None]], axis=1))


def triangle(rows: np.ndarray) -> np.ndarray:
    """(q, q) R of Q R = (N, q) rows, rows of zeros below where N < q.

    Block by block: on a matrix so tall and narrow the library's threads cost a hundred times what they bring.
    """
    count, width = rows.shape
    block = max(128, 4 * width)
    if count > 2 * block:
        cut = count // block * block
        reduced = np.asarray(np.linalg.qr(rows[:cut].reshape(-1, block, width), mode="r"))
        return triangle(np.concatenate([reduced.reshape(-1, width), rows[cut:]]))
    found = np.asarray(np.linalg.qr(rows, mode="r"))
    return found if count >= width else np.concatenate([found, np.zeros((width - count, width))])


def begun(problem: Problem, how: GlobalStart | None, loss: Robust | None) -> np.ndarray:
    """(Q,) where to begin: at the starts of the parameters or, where asked, at the best of many tries."""
    start = first_unknowns(problem)
    if how is None or not problem.free:
        return start
    count, found = len(problem.free), []
    for row in tries(problem.free, how):
        point = start.copy()
        point[:count] = row
        rows = problem.rows(point)
        if rows.finite:
            found.append((cost_of(rows, loss), point))
    found.sort(key=lambda pair: pair[0])
    short = [solved(problem, point, loss=loss, most=15) for _, point in found[: how.fitted]]
    return min(short, key=lambda each: each.cost).unknowns if short else start


def cost_of(rows: Rows, loss: Robust | None) -> float:
    """Half the sum of squares or, beyond the limit of a robust loss, what grows linearly."""
    if loss is None:
        return 0.5 * float(rows.residual @ rows.residual)
    size = np.abs(rows.residual)
    return float(np.where(size > loss.sigmas, loss.sigmas * size - 0.5 * loss.sigmas**2, 0.5 * size**2).sum())


def weights(residual: np.ndarray, loss: Robust | None) -> np.ndarray:
    """(R,) what each row counts by: 1, beyond the limit of a robust loss limit / |residual|."""
    if loss is None:
        return np.ones(len(residual))
    return np.minimum(1.0, loss.sigmas / np.maximum(np.abs(residual), 1e-300))


def no_value(problem: Problem) -> IdentificationError:
    """That the model has no value at the start."""
    own = {p.name: float(v) for p in problem.system.parameters if (v := p.si_value) is not None}
    turned = [each.name for each in problem.free if own.get(each.name, 0.0) * each.start < 0.0]
    values = ", ".join(
        f"{each.name} = {each.start:g}{f' (the plant has {own[each.name]:g})' if each.name in turned else ''}"
        for each in problem.free
    )
    sign = f"Is the sign of {', '.join(turned)} right? " if turned else ""
    return IdentificationError(
        f"identification of '{problem.system.name}'",
        f"the motion diverges or has no value for the parameters at which the search starts: {values}.",
        f"{sign}Start nearer: priors={{…}}, or initial={{…}}; for an unstable plant shooting=MultipleShooting(), for a "
        "rough idea of the parameters start=GlobalStart().",
    )


def _inside(point: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """The point moved off its bounds, which the search must begin between."""
    room = np.where(np.isfinite(upper - lower), upper - lower, np.maximum(np.abs(point), 1.0))
    return np.clip(point, lower + 1e-8 * room, upper - 1e-8 * room)


def _near(point: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    room = np.where(np.isfinite(upper - lower), upper - lower, np.maximum(np.abs(point), 1.0))
    return (point - lower < 1e-5 * room) | (upper - point < 1e-5 * room)
