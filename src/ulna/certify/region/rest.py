"""Where a loop rests: a box that holds exactly one equilibrium, with proof."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import sympy as sp
from flint import arb, arb_mat

from ulna.base import Verdict
from ulna.certify.region.balls import Slopes, ball

_STEPS = 60
_RADII = (1e-13, 1e-11, 1e-9, 1e-7)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rest:
    """An equilibrium within a box.

    Attributes:
        center: exact, of each state. radii: of the box around it.
    """

    center: tuple[sp.Rational, ...]
    radii: tuple[sp.Rational, ...]

    @property
    def balls(self) -> list[arb]:
        """The box."""
        return [ball(c) + arb(0, 1) * ball(r) for c, r in zip(self.center, self.radii, strict=True)]

    @property
    def reach(self) -> np.ndarray:
        """(n,) its radii."""
        return np.array([float(r) for r in self.radii])

    @property
    def numbers(self) -> np.ndarray:
        """(n,) its middle."""
        return np.array([float(c) for c in self.center])


def equilibrium_near(slopes: Slopes, near: np.ndarray) -> np.ndarray | None:
    """(n,) where Newton's method ends, in floating point; None where it does not."""
    x, moved = np.array(near, dtype=float), math.inf
    for _ in range(_STEPS):
        value, slope = slopes.closed(x), slopes.numbers(x)
        if not (np.isfinite(value).all() and np.isfinite(slope).all()):
            return None
        change = np.linalg.lstsq(slope, -value, rcond=None)[0]
        x, before = x + change, moved
        moved = np.abs(change).max(initial=0.0) / (1 + np.abs(x).max(initial=0.0))
        # The last digits: it gets no nearer.
        if moved < 1e-15 or (moved < 1e-12 and moved >= before):
            return x
    return None


def rest(slopes: Slopes, near: np.ndarray) -> Rest | None:
    """The equilibrium of the unlimited loop near a point; None where none is proved to be there.

    R. Krawczyk, "Newton-Algorithmen zur Bestimmung von Nullstellen mit Fehlerschranken", Computing 4 (1969).
    """
    x = equilibrium_near(slopes, near)
    if x is None:
        return None
    center = tuple(_short(float(v)) for v in x)
    for radius in _RADII:
        found = Rest(center=center, radii=tuple(sp.Rational(radius) * max(sp.Integer(1), abs(c)) for c in center))
        if _holds_one(slopes, found):
            return found
    return None


def _short(value: float) -> sp.Rational:
    """The simplest fraction within an error of 1e-13."""
    near = sp.nsimplify(value, rational=True, tolerance=1e-13)
    return sp.Rational(near) if abs(float(near) - value) <= 1e-13 * max(1.0, abs(value)) else sp.Rational(value)


def _holds_one(slopes: Slopes, found: Rest) -> bool:
    """Krawczyk's test, and that no limit is met in the box."""
    n, box = len(found.center), found.balls
    middle = [ball(c) for c in found.center]
    commands, limited = slopes.values(*box)[n : n + slopes.sizes[1]], slopes.form.limited
    for value, low, high in zip(commands, limited.lower, limited.upper, strict=True):
        if not (value > ball(low) and value < ball(high)):
            return False
    try:
        inverse = la.inv(slopes.numbers(found.numbers))
    except la.LinAlgError:
        return False
    around = [b - c for b, c in zip(box, middle, strict=True)]
    slope = slopes.secant(middle, around)
    near = arb_mat(n, n, [arb(float(v)) for v in inverse.ravel()])
    product = near * slope
    start = near * arb_mat(n, 1, list(slopes.values(*middle)[:n]))
    for i in range(n):
        moved = -start[i, 0]
        for j in range(n):
            moved += ((arb(1) if i == j else arb(0)) - product[i, j]) * around[j]
        if not moved.abs_upper() < around[i].abs_upper():
            return False
    return True


def linear_answer(slopes: Slopes, found: Rest) -> Verdict | None:
    """Refuted where the linearisation at the equilibrium has an eigenvalue in the right half-plane; None otherwise.

    Proved by Routh's array in balls; the eigenvalue that is told is the one of floating point.
    """
    n = len(found.center)
    matrix = slopes.secant(found.balls, [arb(0)] * n)
    middle = np.array([[float(matrix[i, j].mid()) for j in range(n)] for i in range(n)])
    values = la.eigvals(middle)
    worst = values[int(np.argmax(values.real))]
    if worst.real <= 0:
        return None
    if not _routh_fails(matrix):
        return None
    return Verdict.refuted(
        f"'{slopes.form.limited.name}' is stable at its equilibrium",
        eigenvalue=complex(worst) if abs(worst.imag) > 0 else float(worst.real),
    )


def _routh_fails(matrix: arb_mat) -> bool:
    """Whether Routh's array, in balls, has a first column with an entry that is certainly negative."""
    return _first_column(_characteristic(matrix)) < 0


def decays(coefficients: list[arb]) -> bool:
    """Whether every root of a polynomial, the highest power first, certainly lies left of the imaginary axis."""
    return _first_column(coefficients) > 0


def _first_column(coefficients: list[arb]) -> int:
    """1 if all of Routh's first column is certainly positive, -1 if an entry is certainly negative, else 0."""
    n = len(coefficients) - 1
    rows = [coefficients[0::2], coefficients[1::2]]
    width = len(rows[0])
    rows = [row + [arb(0)] * (width - len(row)) for row in rows]
    for _ in range(n - 1):
        above, below = rows[-2], rows[-1]
        if not below[0] > 0:
            return -int(below[0] < 0)
        rows.append([*(above[k + 1] - above[0] * below[k + 1] / below[0] for k in range(width - 1)), arb(0)])
    return int(rows[n][0] > 0) - int(rows[n][0] < 0)


def _characteristic(matrix: arb_mat) -> list[arb]:
    """1, c₁, …, cₙ of det(λ − A), by Faddeev and LeVerrier."""
    n = matrix.nrows()
    unit = arb_mat(n, n, [arb(1) if i == j else arb(0) for i in range(n) for j in range(n)])
    power, coefficients = unit, [arb(1)]
    for k in range(1, n + 1):
        product = matrix * power
        trace = arb(0)
        for i in range(n):
            trace += product[i, i]
        coefficients.append(-trace / k)
        power = product + unit * coefficients[-1]
    return coefficients


def holding(slopes: Slopes, near: np.ndarray) -> dict[str, float] | None:
    """What each limited signal is at the unlimited equilibrium, where that lies beyond a limit; None otherwise."""
    x, limited = np.array(near, dtype=float), slopes.form.limited
    for _ in range(60):
        value, slope = slopes.closed(x), slopes.numbers(x)
        if not (np.isfinite(value).all() and np.isfinite(slope).all()):
            return None
        x = x + np.linalg.lstsq(slope, -value, rcond=None)[0]
    n, m = slopes.sizes
    commands = [float(v) for v in slopes.float_values(*x)[n : n + m]]
    bounds = zip(limited.limited, commands, limited.lower, limited.upper, strict=True)
    needed = {symbol.name: command for symbol, command, low, high in bounds if not float(low) < command < float(high)}
    return needed if needed and all(map(math.isfinite, needed.values())) else None
