"""How sure the unknowns of a fit are: covariance, directions that the data do not tell, profiles of the likelihood."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ulna.identification.fitting.noise import long_run
from ulna.identification.fitting.problem import Problem
from ulna.identification.fitting.solve import Robust, Solution, solved, triangle

BLIND = 1e-9
"""A direction in which the residual changes by less than this beside the others is told by nothing."""

NORMAL = 1.959963984540054
"""Standard deviations on either side of a 95 % interval."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Uncertainty:
    """What slopes at the end of a search say.

    Attributes:
        covariance: (Q, Q) of the unknowns, infinite where nothing tells them. condition: of the slopes, each column
            in its size. blind: (B, Q) directions that change no residual, unit vectors in the unknowns' own sizes.
        inflation: (Q,) the variances over what they were if residuals were independent, of variance one.
    """

    covariance: np.ndarray
    inflation: np.ndarray
    condition: float
    blind: np.ndarray


def uncertainty(problem: Problem, solution: Solution, *, told: bool) -> Uncertainty:
    """What the slopes at the solution say.

    The covariance counts that residuals of neighbouring samples belong together (quantisers, what the model leaves
    out): H⁻¹ M H⁻¹ with H the information if they did not and M the variance of the score as it is.

    Args:
        problem: what was solved. solution: its end. told: whether the noise is known, so that residuals that come out
            smaller are no reason to be surer.

    Reference:
        L. Ljung, System Identification, 2nd ed., section 9.4; Newey and West (1987) for M.
    """
    rows, size = solution.rows, problem.size
    weighed = rows.slopes * np.sqrt(solution.weights)[:, None]
    norms = np.linalg.norm(weighed, axis=0)
    seen = norms > 0.0
    norms = np.where(seen, norms, 1.0)
    _, values, right = np.linalg.svd(triangle(weighed / norms))
    largest = values[0] if len(values) else 1.0
    good = values > BLIND * largest
    # By directions in which the slopes are of length one: H⁻¹ = B Bᵀ, and nothing is lost where the condition is bad.
    basis = right[good].T / values[good]
    covariance = basis @ _score(problem, solution, basis / norms[:, None], told=told) @ basis.T
    inflation = np.diag(covariance) / np.maximum((basis**2).sum(axis=1), 1e-300)
    covariance /= np.outer(norms, norms)
    blind = right[~good] / norms
    blind = blind / np.linalg.norm(blind, axis=1, keepdims=True) if len(blind) else blind
    lost = (np.abs(blind) > 1e-3).any(axis=0) if len(blind) else np.zeros(size, dtype=bool)
    covariance[lost, :] = covariance[:, lost] = 0.0
    covariance[lost, lost] = math.inf
    condition = float(largest / values[good][-1]) if good.all() and len(values) else math.inf
    return Uncertainty(covariance=covariance, inflation=inflation, condition=condition, blind=blind)


def _score(problem: Problem, solution: Solution, basis: np.ndarray, *, told: bool) -> np.ndarray:
    """(r, r) variance of Σ slope·residual, slopes along the (Q, r) directions of a basis."""
    rows, channels = solution.rows, problem.system.outputs
    along = rows.slopes @ basis
    masks = [np.isfinite(run.measured) for run in problem.runs]
    slopes: list[list[np.ndarray]] = [[] for _ in channels]
    residuals: list[list[np.ndarray]] = [[] for _ in channels]
    at = 0
    for piece in problem.pieces:
        known = masks[piece.experiment][piece.begin : piece.end]
        count = int(known.sum())
        which = np.nonzero(known)[1]
        part = slice(at, at + count)
        counted = solution.weights[part]
        for channel in range(len(channels)):
            mine = which == channel
            slopes[channel].append(along[part][mine])
            residuals[channel].append((rows.residual[part] * counted)[mine])
        at += count
    loose = problem.size / max(1, rows.measured)
    meat = np.zeros((basis.shape[1], basis.shape[1]))
    for each, error in zip(slopes, residuals, strict=True):
        joined = [each], [error]
        if len(problem.pieces) > len(problem.runs):
            joined = [[np.concatenate(each)]], [[np.concatenate(error)]]
        channel = long_run(joined[0][0], joined[1][0]) / max(0.1, 1.0 - loose)
        variance = float(np.mean(np.concatenate(error) ** 2))
        if told and variance < 1.0:
            channel = sum(e.T @ e for e in each)
        meat += channel
    priors = along[len(rows.residual) - _priors(problem) :]
    return meat + priors.T @ priors


def _priors(problem: Problem) -> int:
    begun = sum(1 for piece in problem.pieces if not piece.begin for n in piece.states if n in problem.state_priors)
    return sum(each.prior is not None for each in problem.free) + begun


def profile(
    problem: Problem, solution: Solution, which: int, step: float, inflation: float, loss: Robust | None
) -> tuple[float, float]:
    """(lower, upper) ends of the 95 % interval of an unknown by its profile; infinite where it does not close.

    The unknown is moved and the others are fitted again, until twice the rise of the cost is 3.84 times what the
    correlation of the residuals asks for.

    Args:
        problem, solution: the fit. which: the unknown. step: its standard deviation as the slopes have it.
        inflation: variance with correlation over variance without. loss: of the fit.

    Reference:
        S. Murphy, A. van der Vaart, "On profile likelihood", JASA 95 (2000); A. Raue et al., Bioinformatics 25 (2009).
    """
    limit = 0.5 * NORMAL**2 * max(inflation, 1e-12)
    lower, upper = problem.bounds
    ends = []
    for side, bound in ((-1.0, lower[which]), (1.0, upper[which])):
        ends.append(_end(problem, solution, which, side, bound, step, limit, loss))
    return ends[0], ends[1]


def _end(
    problem: Problem,
    solution: Solution,
    which: int,
    side: float,
    bound: float,
    step: float,
    limit: float,
    loss: Robust | None,
) -> float:
    here = float(solution.unknowns[which])
    base, size = solution.cost, max(abs(here), 1.0)
    inside, reach, warm = 0.0, min(step, size) * NORMAL, solution.unknowns
    for _ in range(7):
        at = here + side * reach
        past = side * (at - bound) >= 0.0
        at = bound if past else at
        rise, warm = _rise(problem, warm, which, at, base, loss)
        if rise > limit:
            return _between(problem, solution, which, here + side * inside, at, base, limit, loss)
        if past:
            return side * math.inf
        inside, reach = reach, 3.0 * reach
        if inside > 30.0 * size:
            break
    return side * math.inf


def _between(
    problem: Problem,
    solution: Solution,
    which: int,
    inside: float,
    outside: float,
    base: float,
    limit: float,
    loss: Robust | None,
) -> float:
    """Where the cost has risen by the limit, by bisection to a thirtieth of the interval."""
    for _ in range(5):
        middle = 0.5 * (inside + outside)
        rise, _ = _rise(problem, solution.unknowns, which, middle, base, loss)
        inside, outside = (middle, outside) if rise <= limit else (inside, middle)
    return 0.5 * (inside + outside)


def _rise(
    problem: Problem, start: np.ndarray, which: int, at: float, base: float, loss: Robust | None
) -> tuple[float, np.ndarray]:
    """(rise of the cost with the unknown held there, the others fitted); infinite where the model has no value."""
    point = start.copy()
    point[which] = at
    if not problem.rows(point).finite:
        return math.inf, start
    found = solved(problem, point, loss=loss, most=15, fixed=which)
    return found.cost - base, found.unknowns
