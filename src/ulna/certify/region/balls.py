"""The secant matrix of a limited loop in balls: ζ' = M(d) d for ζ = ζ* + d, M enclosed over a box of d."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sympy as sp
from flint import arb, arb_mat

from ulna.certify.region.domain import Domain
from ulna.certify.region.form import Form, without_errors
from ulna.program import to_balls, to_numpy
from ulna.symbolic.compiling import kernel

SEGMENTS = 4
"""Of the straight line from the equilibrium, over which the mean of the slopes is taken."""
_PART = arb(-0.5, 0.5)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Slopes:
    """A form and its derivatives, in floating point and in balls.

    Attributes:
        form: whose. active: places of the coordinates that the derivatives depend on; the others do not matter.
        values: g, k and β. jacobian: ∂g/∂ζ, ∂k/∂ζ, β and its derivatives, row by row.
        float_values, float_jacobian: the same in floating point.
        still: of the coordinates before the errors, the errors at 0; None where there are no errors.
        domain: where the loop is defined.
    """

    form: Form
    active: tuple[int, ...]
    values: Callable[..., tuple[arb, ...]]
    jacobian: Callable[..., tuple[arb, ...]]
    float_values: Callable[..., tuple[Any, ...]]
    float_jacobian: Callable[..., tuple[Any, ...]]
    still: Slopes | None
    domain: Domain

    @property
    def sizes(self) -> tuple[int, int]:
        """Coordinates, limited signals."""
        return len(self.form.symbols), len(self.form.commands)

    def at(self, parameters: Sequence[arb]) -> Slopes:
        """The same with values of the parameters, their middles in floating point."""
        middle = [float(p.mid()) for p in parameters]
        return replace(
            self,
            values=_with(self.values, parameters),
            jacobian=_with(self.jacobian, parameters),
            float_values=_with(self.float_values, middle),
            float_jacobian=_with(self.float_jacobian, middle),
            still=None if self.still is None else self.still.at(parameters),
            domain=self.domain.at(parameters),
        )

    def secant(self, center: Sequence[arb], box: Sequence[arb]) -> arb_mat:
        """(n, n) enclosure of M(d) for every d in the box and every ζ* in the center.

        M is the mean of ∂g/∂ζ + Σ β (σ − 1) ∂k/∂ζ + ∂β/∂ζ (s − k) along the line from ζ* to ζ* + d, σ the slope of
        each limit.
        """
        n, _ = self.sizes
        total = arb_mat(n, n, [arb(0)] * (n * n))
        for j in range(SEGMENTS):
            part = arb((j + 0.5) / SEGMENTS, 0.5 / SEGMENTS)
            found = self.matrix([c + part * d for c, d in zip(center, box, strict=True)])
            total += found
        return total * (arb(1) / SEGMENTS)

    def rates(self, point: Sequence[arb]) -> list[arb]:
        """(n,) ζ' with limits applied."""
        n, m = self.sizes
        found = self.values(*point)
        rates = list(found[:n])
        for j, command in enumerate(found[n : n + m]):
            low, high = ball(self.form.limited.lower[j]), ball(self.form.limited.upper[j])
            if not (command > low and command < high):
                beyond = command.max(low).min(high) - command
                rates = [rate + found[n + m + i * m + j] * beyond for i, rate in enumerate(rates)]
        return rates

    def matrix(self, point: Sequence[arb]) -> arb_mat:
        """(n, n) ∂ζ'/∂ζ with limits applied; at the edge of one anything between both sides."""
        n, m = self.sizes
        found = self.jacobian(*point)
        whole = arb_mat(n, n, list(found[: n * n]))
        if not m:
            return whole
        commands = self.values(*point)[n : n + m]
        slopes, gains, bends = _split(found, n, m)
        for j, command in enumerate(commands):
            low, high = ball(self.form.limited.lower[j]), ball(self.form.limited.upper[j])
            if command > low and command < high:
                continue
            beyond = command.max(low).min(high) - command
            less = arb(-1) if command > high or command < low else _PART
            whole += arb_mat(
                n,
                n,
                [
                    gains[i * m + j] * less * slopes[j * n + c] + bends[(i * m + j) * n + c] * beyond
                    for i in range(n)
                    for c in range(n)
                ],
            )
        return whole

    def free(self, point: Sequence[arb]) -> arb_mat:
        """(n, n) ∂g/∂ζ, the limits left out."""
        n, _ = self.sizes
        return arb_mat(n, n, list(self.jacobian(*point)[: n * n]))

    def numbers(self, point: np.ndarray) -> np.ndarray:
        """(n, n) ∂g/∂ζ at a point, in floating point."""
        n, _ = self.sizes
        return np.array([float(v) for v in self.float_jacobian(*point)[: n * n]]).reshape(n, n)

    def limited_slopes(self, point: np.ndarray) -> np.ndarray:
        """(n, n) Σ β ∂k/∂ζ, what limits can take away, in floating point."""
        n, m = self.sizes
        found = np.array([float(v) for v in self.float_jacobian(*point)])
        slopes, gains, _ = _split(found, n, m)
        return np.reshape(gains, (n, m)) @ np.reshape(slopes, (m, n)) if m else np.zeros((n, n))

    def share_of_limits(self, point: np.ndarray, place: int, half: float) -> float:
        """By how much of the limits' range a coordinate moves the commands."""
        n, m = self.sizes
        if not m:
            return 0.0
        found = np.array([float(v) for v in self.float_jacobian(*point)])
        slopes = np.reshape(_split(found, n, m)[0], (m, n))[:, place]
        limited = self.form.limited
        ranges = np.array([float(h - low) for h, low in zip(limited.upper, limited.lower, strict=True)])
        return float(np.max(np.abs(slopes) * half / ranges))

    def closed(self, point: np.ndarray) -> np.ndarray:
        """(n,) g at a point, in floating point."""
        return np.array([float(v) for v in self.float_values(*point)[: self.sizes[0]]])

    def limited_matrices(self, points: np.ndarray) -> np.ndarray:
        """(n, n, N) ∂ζ'/∂ζ at N points (n, N), limits applied, in floating point."""
        n, m = self.sizes
        shape = points.shape[1:]
        found = [np.broadcast_to(np.asarray(row, dtype=float), shape) for row in self.float_jacobian(*points)]
        whole = np.array(found[: n * n]).reshape(n, n, *shape)
        if not m:
            return whole
        slopes, gains, bends = (np.array(part) for part in _split(found, n, m))
        slopes, gains, bends = slopes.reshape(m, n, *shape), gains.reshape(n, m, *shape), bends.reshape(n, m, n, *shape)
        commands = self.float_values(*points)[n : n + m]
        for j in range(m):
            low, high = float(self.form.limited.lower[j]), float(self.form.limited.upper[j])
            command = np.broadcast_to(np.asarray(commands[j], dtype=float), shape)
            outside = ((command < low) | (command > high)).astype(float)
            beyond = np.clip(command, low, high) - command
            whole = whole - gains[:, j, None] * slopes[None, j] * outside + bends[:, j] * beyond
        return whole

    def limited_rates(self, points: np.ndarray) -> np.ndarray:
        """(n, N) rates at N points (n, N), limits applied, in floating point."""
        n, m = self.sizes
        rows = [np.broadcast_to(np.asarray(row, dtype=float), points.shape[1:]) for row in self.float_values(*points)]
        rates, commands = np.array(rows[:n]), rows[n : n + m]
        for j, command in enumerate(commands):
            low, high = float(self.form.limited.lower[j]), float(self.form.limited.upper[j])
            beyond = np.clip(command, low, high) - command
            rates = rates + np.array([rows[n + m + i * m + j] * beyond for i in range(n)])
        return rates


def _split(found: Any, n: int, m: int) -> tuple[Any, Any, Any]:
    first, second = n * n + m * n, n * n + m * n + n * m
    return found[n * n : first], found[first:second], found[second:]


def _with(function: Callable[..., Any], held: Sequence[Any]) -> Callable[..., Any]:
    return lambda *point: function(*point, *held)


def slopes_of(form: Form) -> Slopes:
    """The derivatives of a form, compiled; of one with parameters they are to be given values by `at` before use."""
    z, given = list(form.symbols), [*form.symbols, *form.limited.parameters]
    closed, gains = sp.Matrix(form.closed), list(form.gains)
    commands = sp.Matrix(len(form.commands), 1, list(form.commands))
    entries = [*closed.jacobian(z)]
    if gains:
        entries += [*commands.jacobian(z), *gains, *(sp.diff(b, symbol) for b in gains for symbol in z)]
    values = [*closed, *commands, *gains]
    jacobian = kernel("jacobian", given, {f"j{k}": e for k, e in enumerate(entries)})
    whole = kernel("values", given, {f"v{k}": e for k, e in enumerate(values)})
    domain = Domain(form)
    used = {symbol for e in (*entries, *commands) for symbol in e.free_symbols}
    # Where the loop is not defined everywhere, that may depend on any coordinate.
    used |= set() if domain.everywhere else set(z)
    return Slopes(
        form=form,
        active=tuple(place for place, symbol in enumerate(z) if symbol in used),
        values=to_balls(whole),
        jacobian=to_balls(jacobian),
        float_values=to_numpy(whole),
        float_jacobian=to_numpy(jacobian),
        still=slopes_of(without_errors(form)) if form.outer < len(z) else None,
        domain=domain,
    )


def ball(value: Any) -> arb:
    """A ball around a rational number."""
    number = sp.Rational(value)
    return arb(int(number.p)) / int(number.q)
