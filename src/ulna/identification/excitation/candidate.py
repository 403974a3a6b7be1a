"""Inputs among which the best is looked for: multisines of low crest and steps between random levels."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np


class Shape(StrEnum):
    """What an input looks like."""

    MULTISINE = "multisine"
    STEPS = "steps"
    STEP = "step"


PHASES = 24
"""Sets of random phases of which the one with the lowest peak is taken."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Candidate:
    """Inputs as samples between -1 and 1 of what the limits leave them.

    Attributes:
        shape: what it is. samples: (m, N), input by input.
    """

    shape: Shape
    samples: np.ndarray


def single_step(inputs: int, count: int, sign: float) -> Candidate:
    """All inputs stepped at the start, to one side: what a bench does by hand."""
    return Candidate(shape=Shape.STEP, samples=np.full((inputs, count), sign))


def multisine(inputs: int, count: int, slowest: float, fastest: float, random: np.random.Generator) -> Candidate:
    """Sums of some harmonics of the duration between two frequencies, counted in periods of the whole.

    Reference:
        R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd edition, Wiley 2012,
        section 5.2 (random phases); of several sets the one with the lowest crest.
    """
    turns = 2 * np.pi * np.arange(count) / count
    rows = []
    for _ in range(inputs):
        lines = int(random.integers(2, 13))
        harmonics = np.unique(np.round(np.exp(random.uniform(np.log(slowest), np.log(fastest), lines))))
        sizes = random.uniform(0.2, 1.0, len(harmonics))
        phases = random.uniform(0, 2 * np.pi, (PHASES, len(harmonics)))
        waves = [(sizes[:, None] * np.cos(harmonics[:, None] * turns + phase[:, None])).sum(axis=0) for phase in phases]
        flattest = min(waves, key=lambda wave: np.abs(wave).max())
        rows.append(flattest / np.abs(flattest).max())
    return Candidate(shape=Shape.MULTISINE, samples=np.array(rows))


def steps(inputs: int, count: int, slowest: float, fastest: float, random: np.random.Generator) -> Candidate:
    """Random levels, each held for a while that fits the frequencies: both signs, full size often."""
    rows = []
    for _ in range(inputs):
        row = np.empty(count)
        pace = np.exp(random.uniform(np.log(slowest), np.log(fastest)))
        place = 0
        while place < count:
            held = max(1, int(count / (2 * pace) * random.uniform(0.5, 1.5)))
            row[place : place + held] = random.choice([-1.0, 1.0, random.uniform(-1, 1)])
            place += held
        rows.append(row)
    return Candidate(shape=Shape.STEPS, samples=np.array(rows))


def mixed(first: Candidate, second: Candidate, share: float) -> Candidate:
    """A weighted sum of two inputs, of the first's shape where it outweighs."""
    samples = (1 - share) * first.samples + share * second.samples
    largest = np.abs(samples).max(axis=1, keepdims=True)
    shape = first.shape if share <= 0.5 else second.shape
    return Candidate(shape=shape, samples=samples / np.where(largest > 0, largest, 1.0))
