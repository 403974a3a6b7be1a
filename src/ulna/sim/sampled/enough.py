"""Runs of a loop with a processor by as many plant steps as each of them needs."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ulna.loop.pace import pace_of, periods_of
from ulna.sim.outcome import Outcome
from ulna.sim.sampled.engine import FixedSteps
from ulna.sim.sampled.prepared import Prepared
from ulna.sim.sampled.source import PACED

BLEW_UP, NOT_FINITE, TOO_COARSE = (
    float(tuple(Outcome).index(each))
    for each in (
        Outcome.BLEW_UP,
        Outcome.NOT_FINITE,
        Outcome.COARSE,
    )
)
MOST_STEPS = 4096
"""Of a stretch of constant input."""
_WIDER = 8
"""Times more steps at once for a run that blew up: what flies off needs more and more of them the later it is."""

Again = Callable[[np.ndarray, int], None]
"""Computes the runs of these numbers anew, with this many steps."""


def refine(made: Prepared, engine: FixedSteps, results: np.ndarray, again: Again) -> np.ndarray:
    """(N,) steps taken, after repeating the runs whose steps were too long for the plant; the others are marked.

    How often depends on the run alone, so that its bits do not depend on others.

    Args:
        made: the loop. engine: how many steps were asked for. again: computes anew.
        results: (N, columns) after that many steps for each stretch, or one.
    """
    most = engine.within * (1.0 if engine.number is None else 2.0 * engine.number)
    short = results[:, -1] > pace_of(most / made.stretch)
    used = np.full(len(results), engine.number or 1)
    if engine.number is not None:
        results[short, 0] = TOO_COARSE
    if engine.number is not None or not short.any():
        return used
    taken = np.ones(len(results))
    while True:
        # The last column is the pace.
        needed = _powers(periods_of(results[:, -1]) * made.stretch / engine.within)
        open_ = needed > taken
        if not open_.any():
            return used
        beyond = open_ & (needed > MOST_STEPS)
        flown = open_ & _flown(results) & (results[:, 1] > PACED * made.fitted.period)
        wanted = np.where(flown, np.minimum(needed, _WIDER * taken), needed)
        lost = beyond & ((wanted > MOST_STEPS) | ~flown)
        results[lost, 0] = TOO_COARSE
        open_ &= ~lost
        taken[lost] = math.inf
        ends = results[:, 1].copy()
        for steps in np.unique(wanted[open_]).tolist():
            again(np.flatnonzero(open_ & (wanted == steps)), int(steps))
        taken[open_] = used[open_] = wanted[open_]
        # It flies off at the same time by shorter steps: they show the loop, not themselves.
        close = np.abs(results[:, 1] - ends) <= 0.02 * ends + 2 * made.fitted.period
        taken[open_ & flown & _flown(results) & close] = math.inf


def _flown(results: np.ndarray) -> np.ndarray:
    return (results[:, 0] == BLEW_UP) | (results[:, 0] == NOT_FINITE)


def _powers(wanted: np.ndarray) -> np.ndarray:
    """(N,) the next powers of two, from 1 on."""
    return np.exp2(np.ceil(np.log2(np.maximum(wanted, 1.0))))
