"""Where a fit begins: initial states from the first samples, parameters from the plant or from many tries."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ulna.identification.errors import IdentificationError
from ulna.identification.fitting.problem import Free, Piece, Problem
from ulna.identification.records import Experiment
from ulna.system import System, starting_point

FIRST = 40
"""Samples at least from which initial states are guessed."""
WIDE = 5.0
"""Without bounds a global start looks from a fifth to five times the value that the plant has."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GlobalStart:
    """Begin at the best of many tries: a Latin hypercube within the bounds, the best of them fitted.

    Args:
        points: tries. fitted: how many of the best are fitted, each for a few steps. seed: of the tries.

    Raises:
        IdentificationError: no tries.

    Examples:
        >>> ulna.GlobalStart(points=256, fitted=8)
        GlobalStart(points=256, fitted=8, seed=0)
    """

    points: int = 64
    fitted: int = 4
    seed: int = 0

    def __post_init__(self) -> None:
        if self.points < 1 or self.fitted < 1:
            raise IdentificationError(
                f"GlobalStart(points={self.points}, fitted={self.fitted})", "expected at least one of each."
            )


def first_unknowns(problem: Problem) -> np.ndarray:
    """(Q,) the parameters' starts, and initial states that fit the first samples of each piece."""
    unknowns = np.zeros(problem.size)
    unknowns[: len(problem.free)] = [each.start / each.scale for each in problem.free]
    ending: dict[str, float] = {}
    for piece in problem.pieces:
        guess = _guess(problem.system, problem.runs[piece.experiment], piece, ending if piece.begin else {})
        guess |= {n: p.mean for n, p in problem.state_priors.items() if not piece.begin}
        unknowns[piece.first : piece.first + len(piece.states)] = [guess[name] for name in piece.states]
        _settle(problem, piece, unknowns)
        if piece.bond:
            with np.errstate(all="ignore"):
                last = problem.run(piece, unknowns).states[-1]
            names = [s.name for s in problem.system.states]
            ending = {n: float(v) for n, v in zip(names, last, strict=True) if math.isfinite(v)}
    return unknowns


def tries(free: Sequence[Free], how: GlobalStart) -> np.ndarray:
    """(points, q) parameters in their sizes, one in each stratum of each: spread by ratio where all are positive."""
    random = np.random.default_rng(how.seed)
    found = np.empty((how.points, len(free)))
    for k, each in enumerate(free):
        size = abs(each.start) or each.scale
        low = each.lower if math.isfinite(each.lower) else (size / WIDE if each.start > 0 else each.start - WIDE * size)
        high = each.upper if math.isfinite(each.upper) else (max(size * WIDE, low + size))
        place = (random.permutation(how.points) + random.uniform(size=how.points)) / how.points
        found[:, k] = (low * (high / low) ** place if low > 0 else low + (high - low) * place) / each.scale
    return found


def _guess(system: System, run: Experiment, piece: Piece, ending: Mapping[str, float]) -> dict[str, float]:
    """Initial states: those measured themselves, else what the piece before ended at or where a run starts."""
    point = starting_point(system).numbers
    guess = {s.name: float(ending.get(s.name, point[s.name])) for s in system.states}
    for column, readout in enumerate(system.readouts):
        values = run.measured[piece.begin : piece.end, column]
        known = values[np.isfinite(values)]
        if readout in system.state_symbols and len(known):
            guess[str(readout)] = float(known[0])
    return guess


def _settle(problem: Problem, piece: Piece, unknowns: np.ndarray) -> None:
    """Move the piece's initial states so that its first samples fit, parameters as they are; in place."""
    if not piece.states:
        return
    run = problem.runs[piece.experiment]
    count = max(FIRST, (piece.end - piece.begin) // 20)
    end = min(piece.end, piece.begin + count)
    times, measured = run.times[piece.begin : end], run.measured[piece.begin : end]
    if len(times) < 2:
        return
    places = [problem.response.along.index(name) for name in piece.states]
    at = slice(piece.first, piece.first + len(piece.states))
    known = np.isfinite(measured)
    trial, best = unknowns[at].copy(), math.inf
    for _ in range(6):
        state = {**piece.fixed, **dict(zip(piece.states, trial.tolist(), strict=True))}
        found = problem.response(state, times, run.inputs, problem.parameters(unknowns))
        if not found.finished:
            break
        error = ((found.outputs - measured) / problem.noise)[known]
        cost = float(error @ error)
        if cost >= best * (1.0 - 1e-6):
            break
        unknowns[at], best = trial, cost
        slopes = (found.output_slopes[:, :, places] / problem.noise[:, None])[known]
        sizes = np.linalg.norm(slopes, axis=0)
        sizes[sizes == 0.0] = 1.0
        # What the first samples hardly tell stays where it was.
        trial = trial - np.linalg.lstsq(slopes / sizes, error, rcond=1e-3)[0] / sizes
