"""Candidates for P, and how far floating point sees each of them reach. Nothing here proves anything."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import sympy as sp

from ulna.certify.region.balls import Slopes
from ulna.certify.region.region import rational
from ulna.certify.region.rest import Rest

DIRECTIONS, RADII, SEED = 1000, np.geomspace(1e-7, 1e5, 500), 0
MARGIN = 0.02
"""Part of the linear decay rate at which V must fall at samples: where it only just falls the proof takes long."""
TRIALS, STARTS, KEPT = 150, 12, 3
FARTHEST = 1e3
"""Sizes of a coordinate to which an ellipsoid is followed."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Candidate:
    """A quadratic form.

    Attributes:
        P: exact. limit: of the level, as samples see it. volume: logarithm of that of the ellipsoid at the limit.
    """

    P: sp.Matrix
    limit: float
    volume: float


def candidates(slopes: Slopes, found: Rest, sizes: np.ndarray) -> list[Candidate]:
    """Quadratic forms from Lyapunov equations (A + λ)ᵀP + P(A + λ) = −Q, that of the largest sampled ellipsoid first.

    Weights in Q and the rate λ are searched at random around the best so far: errors of an estimator and states want
    to be weighed apart.

    Args:
        slopes, found: the loop and its equilibrium. sizes: (n,) SI, where each coordinate is far off.
    """
    matrix = slopes.numbers(found.numbers)
    decay = -float(la.eigvals(matrix).real.max())
    if decay <= 0:
        return []
    random = np.random.default_rng(SEED)
    directions = random.normal(size=(len(matrix), DIRECTIONS))
    directions /= np.linalg.norm(directions, axis=0)
    groups = _errors(slopes)
    best: list[Candidate] = []
    center, spread = np.zeros(len(matrix) + 1), 3.0
    starts = STARTS if groups.any() else 1
    for trial in range(TRIALS):
        step = spread * random.normal(size=len(center))
        if trial % 2 and groups.any():
            step[:-1] = np.where(groups, step[0], 0.0)
        if trial < starts:
            # First how much an error weighs against a state.
            step = np.where([*groups, False], 3.0 * trial, 0.0)
        point = center * (trial >= starts) + step
        made = _candidate(slopes, found, matrix, (sizes, point, decay), directions)
        if made is None:
            continue
        if not best or made.volume > best[0].volume:
            center = point
        best = sorted([*best, made], key=lambda each: -each.volume)[:KEPT]
        spread = max(0.5, spread * 0.98)
    return best


def _errors(slopes: Slopes) -> np.ndarray:
    """(n,) which coordinates are errors of an estimator."""
    return np.arange(len(slopes.form.symbols)) >= slopes.form.outer


def _candidate(
    slopes: Slopes,
    found: Rest,
    matrix: np.ndarray,
    weights: tuple[np.ndarray, np.ndarray, float],
    directions: np.ndarray,
) -> Candidate | None:
    """One form: sizes, logarithms of weights and of the rate's odds, and the decay rate of the linearisation."""
    sizes, point, decay = weights
    # V falls at least at this rate where the loop is linear: a form that only just falls is proved nowhere.
    rate = decay * (0.03 + 0.92 / (1.0 + np.exp(-np.clip(point[-1], -30, 30))))
    weighed, outer = np.exp(point[:-1]) / sizes**2, slopes.form.outer
    solution = np.zeros_like(matrix)
    # Where errors depend on themselves alone the form is block diagonal.
    for part in (slice(0, outer), slice(outer, len(matrix))):
        shifted = matrix[part, part] + rate * np.eye(len(matrix[part, part]))
        if len(shifted):
            solution[part, part] = la.solve_continuous_lyapunov(shifted.T, -np.diag(weighed[part]))
    if not np.isfinite(solution).all() or np.linalg.eigvalsh(solution)[0] <= 0:
        return None
    P = rational(solution)
    numbers = np.array(P.tolist(), dtype=float)
    if np.linalg.eigvalsh(numbers)[0] <= 0:
        return None
    limit = sampled_limit(slopes, found, (numbers, MARGIN * decay), directions)
    if limit == 0.0:
        return None
    # Farther out nobody asks, and among forms whose level has no end the roundest is wanted.
    limit = min(limit, FARTHEST**2 / float(np.max(np.diag(np.linalg.inv(numbers)) / sizes**2)))
    # A wide range of states is worth more than one of errors.
    states, errors = numbers[:outer, :outer], numbers[outer:, outer:]
    volume = outer / 2 * np.log(limit) - np.linalg.slogdet(states)[1] / 2
    if len(errors):
        volume += 0.2 * (len(errors) / 2 * np.log(limit) - np.linalg.slogdet(errors)[1] / 2)
    return Candidate(P=P, limit=limit, volume=float(volume))


def sampled_limit(slopes: Slopes, found: Rest, form: tuple[np.ndarray, float], directions: np.ndarray) -> float:
    """The largest sampled level up to which V falls fast enough; 0 where it does not near the equilibrium.

    Args:
        slopes, found: the loop and its equilibrium. form: P (n, n), and the rate r of V' < −2 r V.
        directions: (n, N) on the unit sphere.
    """
    directions = np.linalg.inv(np.linalg.cholesky(form[0])).T @ directions
    low, high = 0, len(RADII)
    # V falls near the equilibrium, so the first radius where it does not is found by halving, to within the samples.
    while low < high:
        between = (low + high) // 2
        if _falls(slopes, found, form, directions * RADII[between]):
            low = between + 1
        else:
            high = between
    return float(RADII[low - 1] ** 2) if low else 0.0


def _falls(slopes: Slopes, found: Rest, form: tuple[np.ndarray, float], offsets: np.ndarray) -> bool:
    P, rate = form
    if slopes.still is not None:
        return _falls_with_errors(slopes, slopes.still, found, (P, offsets, rate))
    rates = slopes.limited_rates(found.numbers[:, None] + offsets)
    change = np.einsum("ij,ij->j", offsets, P @ (rates + rate * offsets))
    return bool(np.isfinite(change).all() and (change < 0).all())


def _falls_with_errors(slopes: Slopes, still: Slopes, found: Rest, at: tuple[np.ndarray, np.ndarray, float]) -> bool:
    """At samples (P, offsets, rate), the bound that the proof takes over all errors beside a state; see `region`."""
    P, offsets, rate = at
    k, rest = slopes.form.outer, found.numbers[:, None]
    at_rest = slopes.numbers(found.numbers)
    S = -(P[k:, k:] @ at_rest[k:, k:] + at_rest[k:, k:].T @ P[k:, k:])
    w = offsets.copy()
    # States from far to near, errors from what the level leaves beside them.
    fractions = np.linspace(0.02, 1.0, w.shape[1])
    size = np.einsum("ij,ij->j", w[:k], P[:k, :k] @ w[:k])
    level = float(np.max(np.einsum("ij,ij->j", offsets, P @ offsets)))
    w[:k] *= fractions * np.sqrt(level / size)
    w[k:] = 0.0
    beside = offsets.copy()
    beside[:k] = w[:k]
    # At corners of their box: the proof takes them from a box, too.
    reach = np.sqrt(level * np.diag(np.linalg.inv(P[k:, k:])))
    beside[k:] = np.sign(offsets[k:]) * reach[:, None] * np.sqrt(1.0 - fractions**2)
    push = P[:k, :k] @ w[:k]
    change = np.einsum("ij,ij->j", push, still.limited_rates(rest[:k] + w[:k]) + rate * w[:k])
    coupled = slopes.limited_matrices(rest + beside)[:k, k:]
    c = np.einsum("ijs,is->js", coupled, push)
    change = change + np.einsum("js,js->s", c, np.linalg.solve(S, c)) / 2
    return bool(np.isfinite(change).all() and (change < 0).all())
