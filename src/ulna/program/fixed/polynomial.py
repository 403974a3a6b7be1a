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
"""Of each piece, where the error is measured: Chebyshev's points."""
_BETWEEN = 1.1
"""How much larger an error can be between these points: a polynomial of degree 100 is nowhere 1.083 times what they
show (Ehlich and Zeller 1964), and what a smooth function has beyond that degree does not count."""


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
    t = np.cos(np.pi * (np.arange(_SAMPLES) + 0.5) / _SAMPLES)
    exact = np.array([function(min(high, max(low, middle + half * each))) for each in t.tolist()])
    best = Piece(middle, half, (0.0,)), math.inf
    for degree in range(1, MOST_DEGREE + 1):
        nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
        values = [function(min(high, max(low, middle + half * each))) for each in nodes.tolist()]
        series = np.polynomial.chebyshev.chebfit(nodes, values, degree)
        coefficients = np.polynomial.chebyshev.cheb2poly(series)
        # What is rounding of the fit and not the function: odd and even functions have every other coefficient 0.
        coefficients[np.abs(coefficients) < 1e-14 * np.abs(coefficients).max()] = 0.0
        error = _BETWEEN * float(np.abs(np.polynomial.polynomial.polyval(t, coefficients) - exact).max())
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


def variation(name: str, function: Callable[[float], float], over: Interval, by: float) -> float:
    """How far values of a function over an interval are apart at most whose arguments are so far apart.

    Functions that grow steepest at an end (all but those of slope 1 at most) are asked there.
    """
    if name in _GENTLE or by == 0.0:
        return by
    low, high = over.lower, over.upper
    ends = [(low, min(high, low + by)), (max(low, high - by), high)]
    return max(abs(function(b) - function(a)) for a, b in ends) * (1.0 + 2.0**-40) + 2.0**-60


_GENTLE = frozenset(["sin", "cos", "tanh", "atan", "asinh"])
"""Functions that never grow faster than their argument."""
