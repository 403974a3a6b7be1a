"""Newton's method at many points at once: the one iteration behind every equilibrium in numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import sympy as sp
from flint import arb, ctx

from ulna.symbolic.compiling import batch_jacobian, batch_vector
from ulna.symbolic.exact import attempt, exact_ball, tape

AtPoints: TypeAlias = Callable[[np.ndarray], np.ndarray]
"""From (P, n) points to one array whose first axis is P."""

_STEPS = 100
_SHORTEST = 1e-4
"""Share of a step below which halving it is given up."""
_FINE, _CLOSE = 1e-12, 1e-6
"""Steps, relative to the point, at which a point is done, and up to which it may stay where rounding stops it."""
_LONG = 1e6
"""Steps, relative to the point, that only a singular slope asks for."""
_ROUNDING = 1e-12
"""Of values of the equations, relative to their slopes times the point."""
_SECONDS = 1.0
_BITS = 256
"""Of the balls in which a zero found is looked at once more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Zeros:
    """Zeros of P functions of n unknowns.

    Attributes:
        points: (P, n) zeros, NaN where none was reached.
        errors: (P,) the largest component of the next step, which tells how far the true zero may lie.
    """

    points: np.ndarray
    errors: np.ndarray


@np.errstate(all="ignore")
def newton(value: AtPoints, slope: AtPoints, start: np.ndarray) -> Zeros:
    """The zeros that damped Newton steps reach, each point for itself.

    Where there are more unknowns than equations, or the slope is singular, every step is the shortest one, so that
    the zero is close by. A step is halved until the equations get no worse.

    Args:
        value: from (P, n) points to (P, r) values; slope: to (P, r, n) Jacobians; r ≤ n.
        start: (P, n).
    """
    x, rest = start, value(start)
    last, going = np.full(len(x), np.inf), np.ones(len(x), dtype=bool)
    for _ in range(_STEPS):
        step = np.where(going[:, None], _shortest_steps(slope(x), rest, x), 0.0)
        size, reach = _largest(step), 1.0 + _largest(x)
        x, rest = _damped(value, x, rest, step)
        stuck = (size > 0.9 * last) & (size <= _CLOSE * reach)
        going &= (size > _FINE * reach) & ~stuck
        last = size
        if not going.any():
            break
    A = slope(x)
    step = _shortest_steps(A, rest, x)
    errors = _largest(step)
    # Where the slope is singular the shortest step may be short without leading to a zero.
    left = np.abs(rest - (A @ step[..., None])[..., 0])
    rounding = _ROUNDING * np.abs(A * (1.0 + np.abs(x[:, None, :]))).sum(axis=2)
    leads = ((left <= 1e-3 * np.abs(rest)) | (left <= rounding)).all(axis=1)
    reached = (errors <= _CLOSE * (1.0 + _largest(x))) & leads
    return Zeros(points=np.where(reached[:, None], x, np.nan), errors=errors)


def decimal_root(
    equations: Sequence[sp.Expr],
    unknowns: Sequence[sp.Symbol],
    start: Mapping[sp.Symbol, sp.Expr],
    *,
    digits: int = 12,
) -> tuple[dict[sp.Symbol, sp.Expr], int] | None:
    """The zero that Newton's method reaches, as rational numbers, and their digits; None where it reaches none.

    Args:
        equations: no more of them than unknowns, without other symbols.
        unknowns: symbols.
        start: a real number for each.
        digits: decimal digits sought; fewer come out where rounding and a nearly singular slope leave fewer.

    Raises:
        FormulaError: for a function that has no value in numbers.
    """
    symbols = list(unknowns)
    value, slope = (batch_vector("zeros", equations, symbols), batch_jacobian("slopes", equations, symbols, symbols))

    def named(x: np.ndarray) -> dict[str, np.ndarray]:
        return {s.name: x[:, k] for k, s in enumerate(symbols)}

    first = np.array([[float(sp.N(start[s])) for s in symbols]])
    found = newton(lambda x: value(named(x)), lambda x: slope(named(x)), first)
    x, error = found.points[0], float(found.errors[0])
    if not np.isfinite(x).all():
        return None
    scale = np.abs(x[np.abs(x) > 10 * error]).min(initial=np.inf)
    sure = int(-np.log10(max(error / min(scale, 1e300), 1e-15)))
    values: Sequence[Any] = list(x)
    if sure < digits and len(equations) == len(symbols):
        # Floats do not hold the digits: SymPy's own iteration goes on from here.
        keywords = {"prec": digits + 10, "maxsteps": 200}
        finer = attempt(_SECONDS, "digits", sp.nsolve, list(equations), symbols, list(x), **keywords).value
        if finer is not None and all(v.is_real for v in finer):
            values, error, sure = list(finer), 10.0 ** -(digits + 1), digits
    kept = min(digits, max(sure, 1))
    exact = {
        s: sp.Rational(0) if abs(v) <= 10 * error else sp.Rational(str(sp.N(v, kept)))
        for s, v in zip(symbols, values, strict=True)
    }
    return None if _beside_a_pole(equations, exact) else (exact, kept)


def _beside_a_pole(equations: Sequence[sp.Expr], point: Mapping[sp.Symbol, sp.Rational]) -> bool:
    """Whether the equations have no value at the point, or get no worse on the way to a place where they have none.

    x³/x² is small near 0 and smaller still at half of the way: Newton's method stops beside what is no zero.
    """
    program = tape(equations)

    def values(place: Mapping[sp.Symbol, sp.Rational]) -> list[arb]:
        with ctx.workprec(_BITS):
            return program.at({leaf: exact_ball(place[leaf]) for leaf in program.leaves})

    here = values(point)
    if not all(value.is_finite() for value in here):
        return True
    for symbol in (s for s in program.leaves if point[s] != 0):
        if all(value.is_finite() for value in values({**point, symbol: sp.Integer(0)})):
            continue
        halfway = values({**point, symbol: point[symbol] / 2})
        if all(abs(half.mid()) <= abs(full.mid()) for half, full in zip(halfway, here, strict=True)):
            return True
    return False


def _largest(rows: np.ndarray) -> np.ndarray:
    """(P,) largest absolute component of every row."""
    return np.abs(rows).max(axis=1, initial=0.0)


def _shortest_steps(A: np.ndarray, rest: np.ndarray, x: np.ndarray) -> np.ndarray:
    """(P, n) the shortest solutions of A step = rest, NaN where there are no numbers."""
    step = np.full(x.shape, np.nan)
    if A.shape[1] == A.shape[2]:
        with suppress(np.linalg.LinAlgError):  # one singular matrix spoils them all
            step = np.linalg.solve(A, rest[..., None])[..., 0]
    usable = np.isfinite(A).all(axis=(1, 2)) & np.isfinite(rest).all(axis=1)
    poor = usable & ~(_largest(step) <= _LONG * (1.0 + _largest(x)))
    if poor.any():
        step[poor] = (np.linalg.pinv(A[poor]) @ rest[poor][..., None])[..., 0]
    return step


def _damped(value: AtPoints, x: np.ndarray, rest: np.ndarray, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points after their steps, each halved while it makes the equations worse, and the values there."""
    share = np.ones((len(x), 1))
    size = np.linalg.norm(rest, axis=1)
    tiny = _largest(step) <= _FINE * (1.0 + _largest(x))
    while True:
        there = x - share * step
        new = value(there)
        better = np.isfinite(new).all(axis=1) & (np.linalg.norm(new, axis=1) <= size)
        worse = ~better & ~tiny & (share[:, 0] > _SHORTEST)
        if not worse.any():
            return there, new
        share[worse] /= 2
