"""Functions as polynomials over an interval, in pieces where one is not enough; their largest error is measured."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ulna.program.fixed.interval import Interval

MOST_DEGREE, MOST_PIECES = 12, 16
_SAMPLES = 400
"""Of each piece, where the error is measured."""


@dataclass(frozen=True, slots=True)
class Piece:
    """f(middle + half · t) ≈ Σ coefficients[k] t^k for |t| ≤ 1."""

    middle: float
    half: float
    coefficients: tuple[float, ...]


def pieces_of(function: Callable[[float], float], over: Interval, part: float) -> tuple[tuple[Piece, ...], float]:
    """(pieces of equal width, largest error) of a function: the fewest whose error is a part of the largest value.

    Where even the most pieces are not enough, these.
    """
    scale = max(abs(function(x)) for x in np.linspace(over.lower, over.upper, 101).tolist()) or 1.0
    count = 1
    while True:
        edges = np.linspace(over.lower, over.upper, count + 1).tolist()
        found = [_fitted(function, low, high, part * scale) for low, high in pairwise(edges)]
        error = max(each for _, each in found)
        if error <= part * scale or count >= MOST_PIECES:
            degree = max(len(piece.coefficients) for piece, _ in found)
            return tuple(_longer(piece, degree) for piece, _ in found), error
        count *= 2


def _longer(piece: Piece, degree: int) -> Piece:
    missing = (0.0,) * (degree - len(piece.coefficients))
    return Piece(piece.middle, piece.half, piece.coefficients + missing)


def _fitted(function: Callable[[float], float], low: float, high: float, wanted: float) -> tuple[Piece, float]:
    """Interpolation at Chebyshev's points: near the best polynomial of its degree."""
    middle, half = low + (high - low) / 2.0, max((high - low) / 2.0, 2.0**-40)
    t = np.linspace(-1.0, 1.0, _SAMPLES)
    exact = np.array([function(min(high, max(low, middle + half * each))) for each in t.tolist()])
    best = Piece(middle, half, (0.0,)), math.inf
    for degree in range(1, MOST_DEGREE + 1):
        nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
        values = [function(min(high, max(low, middle + half * each))) for each in nodes.tolist()]
        series = np.polynomial.chebyshev.chebfit(nodes, values, degree)
        coefficients = np.polynomial.chebyshev.cheb2poly(series)
        # What is rounding of the fit and not the function: odd and even functions have every other coefficient 0.
        coefficients[np.abs(coefficients) < 1e-14 * np.abs(coefficients).max()] = 0.0
        error = float(np.abs(np.polynomial.polynomial.polyval(t, coefficients) - exact).max())
        if error < best[1]:
            best = Piece(middle, half, tuple(coefficients.tolist())), error
        if error <= wanted:
            break
    return best


def exact_function(name: str, exponent: float | None = None) -> Callable[[float], float]:
    """The function of this name in double precision."""
    if exponent is not None:
        return lambda x: float(x**exponent)
    return getattr(math, name)
