"""Newton's method from many starts: the zeros of equations whose scale nobody has told."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np
import sympy as sp

from ulna.base import FormulaError
from ulna.symbolic.compiling import batch_jacobian, batch_vector
from ulna.system.zeros import newton

_STARTS = 160
_SEED = 7
_SMALLEST, _LARGEST = -2.0, 5.0
"""Powers of ten between which the starts lie where there is no range."""
_FARTHEST = 1e15
"""Beyond it nothing is reached: rates that die out at infinity look like zeros where their slope underflows."""
_SAME = 1e-6
_EDGE = 1e-9


def reached_points(
    equations: Sequence[sp.Expr],
    unknowns: Sequence[sp.Symbol],
    start: np.ndarray,
    ranges: Sequence[tuple[Any, Any]],
) -> np.ndarray:
    """(N, n) the distinct zeros inside the ranges that are reached, nearest to `start` first.

    Args:
        equations: no more than unknowns, without other symbols.
        start: (n) where the first start is; the others lie in the ranges, or at all scales where there is none.
        ranges: (lower, upper) by unknown, None or infinite where there is no bound.
    """
    if not unknowns or not equations or len(equations) > len(unknowns):
        return np.zeros((0, len(unknowns)))
    symbols = list(unknowns)

    def named(x: np.ndarray) -> dict[str, np.ndarray]:
        return {s.name: x[:, k] for k, s in enumerate(symbols)}

    points = np.zeros((0, len(symbols)))
    with suppress(FormulaError):  # a function without a value in numbers
        value, slope = batch_vector("zeros", equations, symbols), batch_jacobian("slopes", equations, symbols, symbols)
        first = _starts(start, [_sides(*sides) for sides in ranges])
        points = newton(lambda x: value(named(x)), lambda x: slope(named(x)), first).points
    points = points[(np.abs(points) <= _FARTHEST).all(axis=1)]
    points = points[[all(map(inside, p, ranges)) for p in points.tolist()]] if len(points) else points
    points = points[np.argsort(np.abs(points - start).sum(axis=1), kind="stable")]
    kept: list[np.ndarray] = []
    for point in points:
        if not any((np.abs(point - other) <= _SAME * (1 + np.abs(point))).all() for other in kept):
            kept.append(point)
    return np.array(kept).reshape(len(kept), len(symbols))


def inside(value: Any, sides: tuple[Any, Any]) -> bool:
    """Whether a number lies in a range, ends included; one that stays a symbol may."""
    number = sp.N(value)
    if number.free_symbols or not number.is_real:
        return bool(number.free_symbols)
    lower, upper = _sides(*sides)
    edge = _EDGE * (1 + abs(float(number)))
    return lower - edge <= float(number) <= upper + edge


def period(rates: Sequence[sp.Expr], x: sp.Symbol) -> float:
    """2π where every rate that has it is the same a turn later, else 0."""
    turned = any(r.has(x) for r in rates) and all(r == r.xreplace({x: x + 2 * sp.pi}) for r in rates)
    return 2 * math.pi if turned else 0.0


def _sides(lower: Any, upper: Any) -> tuple[float, float]:
    return (-np.inf if lower is None else float(lower), np.inf if upper is None else float(upper))


def _starts(start: np.ndarray, ranges: Sequence[tuple[float, float]]) -> np.ndarray:
    """(P, n): the start itself, all unknowns at one scale, and points with scales of their own."""
    generator = np.random.default_rng(_SEED)
    n = len(start)
    powers = np.linspace(_SMALLEST, _LARGEST, 29)
    common = np.array([start, start + 1 / 3, *(sign * np.full(n, 10.0**p) for p in powers for sign in (1, -1))])
    scales = 10.0 ** generator.uniform(_SMALLEST, _LARGEST, (_STARTS, n))
    points = np.concatenate([common, scales * generator.choice((-1.0, 1.0), (_STARTS, n))])
    for k, (lower, upper) in enumerate(ranges):
        if np.isfinite(lower) and np.isfinite(upper):
            points[2:, k] = generator.uniform(lower, upper, len(points) - 2)
        elif np.isfinite(lower):
            points[2:, k] = lower + np.abs(points[2:, k])
        elif np.isfinite(upper):
            points[2:, k] = upper - np.abs(points[2:, k])
    return points
