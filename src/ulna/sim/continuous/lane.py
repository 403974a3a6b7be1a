"""`LaneStep`: a compiled Taylor step of many runs at a time, and the rows it works on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

FIGURES = 3
"""Numbers kept of each output along the way: largest, smallest, last time outside the band."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LaneStep:
    """A compiled step. Rows of its argument, each with one entry for each run: what moves, then what stays.

    What moves: time, n states, the largest absolute value of each, and of each of the q outputs largest value, smallest
    value and last time outside the band.
    What stays: final time, reciprocal of the size of each state, c constants, target and half-width of the band of each
    output.

    Attributes:
        evaluate: (rows, runs) → what moves after the step: (moving, runs).
        order: of the series. states, outputs: n and q. moving: number of rows that move.
    """

    evaluate: Any
    order: int
    states: int
    outputs: int
    moving: int
