"""Smooth references with their derivatives: point to point with the least jerk, and through via points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from ulna.base import SimulationError
from ulna.sim.inputs import TIME, Interpolated
from ulna.symbolic.formulas import exact

# Largest values of |s'|, |s''|, |s'''| of the quintic s(τ) = 10 τ³ − 15 τ⁴ + 6 τ⁵ on [0, 1].
_QUINTIC_PEAKS = (15 / 8, 10 / math.sqrt(3), 60.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionLimits:
    """What a reference may ask for, in SI: lower ≤ r ≤ upper, |r'| ≤ speed, |r''| ≤ acceleration, |r'''| ≤ jerk.

    Raises:
        SimulationError: an empty range, or a limit that is not positive.
    """

    speed: float = math.inf
    acceleration: float = math.inf
    jerk: float = math.inf
    lower: float = -math.inf
    upper: float = math.inf

    def __post_init__(self) -> None:
        if not (self.lower < self.upper):
            raise SimulationError(
                "MotionLimits", f"the lower end {self.lower} is not below the upper end {self.upper}."
            )
        for name in ("speed", "acceleration", "jerk"):
            if not (getattr(self, name) > 0):
                raise SimulationError(f"MotionLimits({name}={getattr(self, name)})", "it must be positive.")

    def check(self, what: str, value: float) -> float:
        """The value, if it lies in the range of motion.

        Raises:
            SimulationError: a value outside, or one that is not finite.
        """
        if not math.isfinite(value):
            raise SimulationError(f"{what} {value}", "it is not a finite number.")
        if not (self.lower <= value <= self.upper):
            raise SimulationError(
                f"{what} {value:.6g}",
                f"it lies outside the range of motion [{self.lower:.6g}, {self.upper:.6g}].",
                f"The nearest allowed value is {min(max(value, self.lower), self.upper):.6g}.",
            )
        return value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reference:
    """A piecewise polynomial r(t), at rest before its first and after its last knot.

    Attributes:
        knots: (K + 1,) increasing, s.
        coefficients: (K, d + 1); on piece k, r(t) = Σⱼ coefficients[k, j] (t − knots[k])ʲ, in SI.
    """

    knots: np.ndarray
    coefficients: np.ndarray

    @property
    def duration(self) -> float:
        """From the first knot to the last, s."""
        return float(self.knots[-1] - self.knots[0])

    @property
    def target(self) -> float:
        """Where it ends, in SI."""
        return float(self.samples(self.knots[-1:], derivatives=0)[0, 0])

    def samples(self, times: Sequence[float] | np.ndarray, *, derivatives: int = 3) -> np.ndarray:
        """(derivatives + 1, N) the reference and its derivatives at the times (N,), in SI; the later value at knots."""
        at = np.asarray(times, dtype=float)
        piece = np.clip(np.searchsorted(self.knots, at, side="right") - 1, 0, len(self.coefficients) - 1)
        local = np.clip(at, self.knots[0], self.knots[-1]) - self.knots[piece]
        moving = (at >= self.knots[0]) & (at < self.knots[-1])
        rows = []
        polynomial = self.coefficients
        for order in range(derivatives + 1):
            value = np.zeros_like(at)
            for column in polynomial[piece].T[::-1]:
                value = value * local + column
            rows.append(value if order == 0 else np.where(moving, value, 0.0))
            polynomial = _derived(polynomial)
        return np.array(rows)

    def inputs(
        self, name: str, times: Sequence[float] | np.ndarray, *, derivatives: int = 3
    ) -> dict[str, Interpolated]:
        """What drives the inputs `<name>`, `<name>_d1` … of a law that follows a reference (`Track`)."""
        at = np.asarray(times, dtype=float)
        names = [name, *(f"{name}_d{k}" for k in range(1, derivatives + 1))]
        rows = self.samples(at, derivatives=derivatives)
        return {label: Interpolated(times=at, values=row) for label, row in zip(names, rows, strict=True)}

    def expression(self, *, derivative: int = 0) -> sp.Expr:
        """The reference, or a derivative, as an expression in `ulna.sim.TIME`; exact for the stored coefficients."""
        polynomial = self.coefficients
        for _ in range(derivative):
            polynomial = _derived(polynomial)
        ends = self.samples(self.knots[[0, -1]], derivatives=0)[0] if derivative == 0 else (0.0, 0.0)
        pieces: list[tuple[sp.Expr, object]] = [(exact(float(ends[0])), exact(float(self.knots[0])) > TIME)]
        for start, end, row in zip(self.knots, self.knots[1:], polynomial, strict=False):
            local = TIME - exact(float(start))
            value = sum((exact(float(c)) * local**j for j, c in enumerate(row)), sp.Integer(0))
            pieces.append((value, exact(float(end)) > TIME))
        pieces.append((exact(float(ends[1])), True))
        return sp.Piecewise(*pieces)


def minimum_jerk(
    start: float, target: float, *, limits: MotionLimits, begin: float = 0.0, duration: float | None = None
) -> Reference:
    """From rest to rest with the least ∫ r'''² dt: start + (target − start)(10 τ³ − 15 τ⁴ + 6 τ⁵), τ = (t − begin)/T.

    Args:
        start, target: in SI, inside the range of the limits.
        limits: bounds of range, speed, acceleration and jerk.
        begin: when it starts, s.
        duration: T in s; the shortest that keeps the limits where left out.

    Raises:
        SimulationError: an end outside the range of motion, a duration that breaks a limit, or limits that leave the
            duration open.

    Reference:
        T. Flash, N. Hogan, J. Neurosci. 5(7):1688-1703, 1985, eq. 3.
    """
    limits.check("the start", start)
    limits.check("the set point", target)
    way = abs(target - start)
    shortest = _shortest_duration(way, limits)
    chosen = shortest if duration is None else duration
    if not (0 < chosen < math.inf):
        if way:
            raise SimulationError(
                "a minimum-jerk reference",
                f"its duration is {chosen}.",
                "Give a finite limit of speed, acceleration or jerk, or a positive duration.",
            )
        chosen = 1.0
    if chosen < shortest * (1 - 1e-12):
        raise SimulationError(
            f"a minimum-jerk reference of {chosen:g} s",
            "it breaks a limit of speed, acceleration or jerk.",
            f"The shortest that keeps them takes {shortest:.6g} s.",
        )
    span = target - start
    row = np.array([start, 0.0, 0.0, 10 * span / chosen**3, -15 * span / chosen**4, 6 * span / chosen**5])
    return Reference(knots=np.array([begin, begin + chosen]), coefficients=row[None, :])


def through_points(
    points: Sequence[float], *, limits: MotionLimits, begin: float = 0.0, times: Sequence[float] | None = None
) -> Reference:
    """From rest through via points to rest: the quintic spline, which has the least ∫ r'''² dt for its times.

    Args:
        points: (K + 1,) at least two, in SI, inside the range of the limits.
        limits: bounds of range, speed, acceleration and jerk.
        begin: when it starts, s.
        times: (K + 1,) when it passes each point, s after `begin`, from 0; where left out, spaced by distance, scaled
            to the shortest whole that keeps the limits.

    Raises:
        SimulationError: a point outside the range of motion, a curve that leaves it between points, times that do not
            increase or break a limit, or limits that leave the duration open.

    Reference:
        I. J. Schoenberg, "Spline functions and the problem of graduation", PNAS 52, 1964.
    """
    values = np.array([limits.check(f"via point {k + 1},", float(p)) for k, p in enumerate(points)])
    if len(values) < 2:
        raise SimulationError("a reference through points", f"{len(values)} given.", "Give at least two.")
    if times is None:
        gaps = np.abs(np.diff(values))
        # A dwell between equal points gets the time of a small step, so that knots stay apart.
        at = np.concatenate([[0.0], np.cumsum(np.maximum(gaps, 0.05 * max(float(gaps.max()), 1e-9)))])
    else:
        at = np.asarray(times, dtype=float)
        if at.shape != values.shape or at[0] != 0 or not (np.diff(at) > 0).all():
            raise SimulationError(
                "a reference through points",
                f"its times {list(times)} do not suit {len(values)} points.",
                "Give one a point, increasing, the first 0.",
            )
    unit = _quintic_spline(at, values)
    scale = _time_scale(unit, limits)
    if times is None:
        if not (0 < scale < math.inf):
            raise SimulationError(
                "a reference through points",
                "nothing bounds its duration from below.",
                "Give a finite limit of speed, acceleration or jerk, or the times.",
            )
    elif scale > 1 + 1e-12:
        raise SimulationError(
            "a reference through points",
            "its times break a limit of speed, acceleration or jerk.",
            f"Stretch them by {scale:.6g}.",
        )
    else:
        scale = 1.0
    powers = scale ** -np.arange(unit.coefficients.shape[1], dtype=float)
    whole = Reference(knots=begin + scale * unit.knots, coefficients=unit.coefficients * powers)
    for value in _extremes(whole, 0):
        # Rounding of the spline at its own via points must not refuse a point on the edge of the range.
        limits.check("the reference between points reaches", _snapped(value, limits, 1e-9 * max(1.0, abs(value))))
    return whole


def _snapped(value: float, limits: MotionLimits, slack: float) -> float:
    for edge in (limits.lower, limits.upper):
        if abs(value - edge) <= slack:
            return edge
    return value


def _shortest_duration(way: float, limits: MotionLimits) -> float:
    bounds = (limits.speed, limits.acceleration, limits.jerk)
    return max(
        (peak * way / bound) ** (1 / (k + 1))
        for k, (peak, bound) in enumerate(zip(_QUINTIC_PEAKS, bounds, strict=True))
    )


def _quintic_spline(times: np.ndarray, values: np.ndarray) -> Reference:
    from scipy.interpolate import PPoly, make_interp_spline

    rest = [(1, 0.0), (2, 0.0)]
    spline = make_interp_spline(times, values, k=5, bc_type=(rest, rest))
    pieces = PPoly.from_spline(spline)
    inside = np.flatnonzero(np.diff(pieces.x) > 0)
    return Reference(knots=np.append(pieces.x[inside], pieces.x[-1]), coefficients=pieces.c[::-1, inside].T.copy())


def _time_scale(unit: Reference, limits: MotionLimits) -> float:
    bounds = (limits.speed, limits.acceleration, limits.jerk)
    peaks = [max(map(abs, _extremes(unit, k + 1)), default=0.0) for k in range(3)]
    return max((peak / bound) ** (1 / (k + 1)) for k, (peak, bound) in enumerate(zip(peaks, bounds, strict=True)))


def _extremes(reference: Reference, derivative: int) -> list[float]:
    """Values of a derivative at the ends of every piece and at its stationary points inside: all its extremes."""
    rows = reference.coefficients
    for _ in range(derivative):
        rows = _derived(rows)
    found: list[float] = []
    for row, length in zip(rows, np.diff(reference.knots), strict=True):
        slope = np.polynomial.Polynomial(row * length ** np.arange(len(row))).deriv()
        # Leading coefficients that are rounding send a root far away and spoil the others. Rounding also splits double
        # roots into complex pairs, so real parts of all are taken: one point too many does no harm.
        kept = slope.trim(1e-13 * np.abs(slope.coef).max())
        roots = [r.real * length for r in kept.roots() if 0 < r.real < 1]
        found += [float(np.polynomial.Polynomial(row)(at)) for at in (0.0, *roots, length)]
    return found


def _derived(coefficients: np.ndarray) -> np.ndarray:
    """(K, d) coefficients of the derivative of each piece; a constant's derivative keeps one column of zeros."""
    if coefficients.shape[1] == 1:
        return np.zeros_like(coefficients)
    return coefficients[:, 1:] * np.arange(1, coefficients.shape[1])
