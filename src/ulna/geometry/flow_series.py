"""Fields and one-forms along the flow of the drift from a point, as Taylor series of balls."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import sympy as sp
from flint import arb, arb_series, ctx

from ulna.program import Kernel, lowest, restricted, slopes_along, tangents, to_ball_series
from ulna.symbolic.exact import exact_ball
from ulna.system import SystemKernel

Place = dict[sp.Basic, sp.Expr]
"""A point for the record, by state."""

Series = Any
Row = list[Series]
Matrix = list[dict[int, Series]]
"""Rows of a sparse matrix."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Programs:
    """Rates and functions, their slopes in states and inputs, and how these slopes change along a direction."""

    rates: Any
    slopes: Any
    gains: Any
    slopes_turned: Any
    gains_turned: Any


@lru_cache(maxsize=4)
def _programs(kernel: Kernel, states: tuple[str, ...], inputs: tuple[str, ...], rates: tuple[str, ...]) -> _Programs:
    motion = restricted(kernel, rates)
    slopes, gains = tangents(kernel, states), tangents(motion, inputs)
    turn = {name: f"{name}/turned" for name in states}
    return _Programs(
        rates=to_ball_series(motion),
        slopes=to_ball_series(slopes),
        gains=to_ball_series(gains),
        slopes_turned=to_ball_series(slopes_along(restricted(slopes, _of(slopes, rates)), turn)),
        gains_turned=to_ball_series(slopes_along(gains, turn)),
    )


def _of(slopes: Kernel, rates: Sequence[str]) -> list[str]:
    wanted = set(rates)
    return [label for label in slopes.outputs if label.rpartition("/")[0] in wanted]


class FlowAtPoint:
    """The brackets with the drift and the Lie derivatives at one point, found as far as they are asked for.

    Attributes:
        place: the point, for the record. digits: working precision in binary digits.
        inputs: number of inputs. regular: whether the plant and its slopes are finite at the point.
    """

    def __init__(self, system: SystemKernel, start: Sequence[sp.Expr], digits: int) -> None:
        self.place: Place = {sp.Symbol(name, real=True): v for name, v in zip(system.states, start, strict=True)}
        self.digits, self.inputs = digits, len(system.inputs)
        self._n, self._p = len(system.states), len(system.functions)
        self._programs = _programs(system.kernel, system.states, system.inputs, system.rates)
        with ctx.workprec(digits):
            self._start = [exact_ball(value) for value in start]
        self._order = 0
        self._x: Row = []
        self._slopes: Matrix = []
        self._fields: list[list[Row]] = []
        self._forms: list[list[Row]] = []
        self._turned: dict[tuple[int, int], list[list[list[arb]]]] = {}
        self._grow(1)
        numbers = [*self._fields[0], *self._forms[0], [lowest(e) for row in self._slopes for e in row.values()]]
        self.regular = all(lowest(value).is_finite() for row in numbers for value in row)

    def fields(self, level: int) -> list[list[arb]]:
        """(m, n) the fields ad_f^level g_j at the point, up to the sign."""
        self._reach(level)
        return [[lowest(value) for value in row] for row in self._fields[level]]

    def forms(self, level: int) -> list[list[arb]]:
        """(p, n) the one-forms dL_f^level h_i at the point."""
        self._reach(level)
        return [[lowest(value) for value in row] for row in self._forms[level]]

    def along_inputs(self, level: int, output: int) -> list[arb]:
        """(m,) L_g L_f^level h of an output."""
        form = self.forms(level)[output]
        with ctx.workprec(self.digits):
            return [_inner(form, gain) for gain in self.fields(0)]

    def reached(self, level: int, output: int) -> bool | None:
        """Whether an input moves the next derivative of an output; None if the balls leave it open."""
        values = self.along_inputs(level, output)
        if any(not value.contains(0) for value in values):
            return True
        with ctx.workprec(self.digits):
            size = sum((abs(value) for value in self.forms(level)[output]), arb(0)).abs_upper()
            small = arb(2) ** (-self.digits // 2) * size
            return False if all(value.is_zero() or value.abs_upper() < small for value in values) else None

    def bracket(self, first: tuple[int, int], second: tuple[int, int]) -> list[arb]:
        """(n,) the bracket of two fields, each (level, input), up to the sign."""
        self._reach(max(first[0], second[0]))
        one, other = (self._along(second)[first[0]][first[1]], self._along(first)[second[0]][second[1]])
        with ctx.workprec(self.digits):
            return [a - b for a, b in zip(one, other, strict=True)]

    def _reach(self, level: int) -> None:
        if level >= self._order:
            self._grow(max(4, 2 * self._order, level + 1))

    def _grow(self, order: int) -> None:
        """Everything to `order` coefficients."""
        self._order, self._turned = order, {}
        with _coefficients(order), ctx.workprec(self.digits):
            self._x = self._flow(order)
            point = (*self._x, *([arb(0)] * self.inputs))
            slopes = _columns(self._programs.slopes(*point), self._n + self._p, self._n)
            self._slopes = [_sparse(row) for row in slopes[: self._n]]
            gains = _columns(self._programs.gains(*point), self._n, self.inputs)
            self._fields = [[[row[j] for row in gains] for j in range(self.inputs)]]
            self._forms = [slopes[self._n :]]
            for _ in range(order - 1):
                turned = [_minus(_times(self._slopes, f), _slopes(f)) for f in self._fields[-1]]
                self._fields.append(turned)
                self._forms.append([_plus(_slopes(w), _left(w, self._slopes)) for w in self._forms[-1]])

    def _flow(self, order: int) -> Row:
        rows = [[value] for value in self._start]
        for k in range(1, order):
            ctx.cap = k
            rates = self._programs.rates(*map(arb_series, rows), *([arb(0)] * self.inputs))
            for row, rate in zip(rows, rates, strict=True):
                row.append(_coefficient(rate, k - 1) / k)
        ctx.cap = order
        return [arb_series(row) for row in rows]

    def _along(self, direction: tuple[int, int]) -> list[list[list[arb]]]:
        """By level and input the slope of each field along one of them, at the point."""
        if direction not in self._turned:
            with _coefficients(self._order), ctx.workprec(self.digits):
                self._turned[direction] = self._turned_along(self.fields(direction[0])[direction[1]])
        return self._turned[direction]

    def _turned_along(self, direction: list[arb]) -> list[list[list[arb]]]:
        rows = [[value] for value in direction]
        for k in range(1, self._order):
            new = [
                sum((_coefficient(e, j) * rows[s][k - 1 - j] for s, e in row.items() for j in range(k)), arb(0)) / k
                for row in self._slopes
            ]
            for row, value in zip(rows, new, strict=True):
                row.append(value)
        point = (*self._x, *([arb(0)] * self.inputs), *map(arb_series, rows))
        turned = [_sparse(row) for row in _columns(self._programs.slopes_turned(*point), self._n, self._n)]
        gains = _columns(self._programs.gains_turned(*point), self._n, self.inputs)
        fields = [[row[j] for row in gains] for j in range(self.inputs)]
        found = []
        for level in range(self._order):
            found.append([[lowest(value) for value in row] for row in fields])
            if level + 1 < self._order:
                fields = [
                    _minus(_plus(_times(turned, X), _times(self._slopes, dX)), _slopes(dX))
                    for X, dX in zip(self._fields[level], fields, strict=True)
                ]
        return found


@contextmanager
def _coefficients(order: int) -> Iterator[None]:
    """Series of so many coefficients; the number before is put back."""
    before = ctx.cap
    ctx.cap = order
    try:
        yield
    finally:
        ctx.cap = before


def _columns(values: Sequence[Series], height: int, width: int) -> list[Row]:
    """(height, width) from values listed column by column."""
    return [[values[j * height + i] for j in range(width)] for i in range(height)]


def _sparse(row: Row) -> dict[int, Series]:
    return {j: value for j, value in enumerate(row) if not (isinstance(value, arb) and value.is_zero())}


def _coefficient(value: Series, k: int) -> arb:
    return value[k] if isinstance(value, arb_series) else value if k == 0 else arb(0)


def _slopes(row: Row) -> Row:
    return [value.derivative() if isinstance(value, arb_series) else arb(0) for value in row]


def _plus(left: Row, right: Row) -> Row:
    return [a + b for a, b in zip(left, right, strict=True)]


def _minus(left: Row, right: Row) -> Row:
    return [a - b for a, b in zip(left, right, strict=True)]


def _times(matrix: Matrix, column: Row) -> Row:
    return [sum((e * column[j] for j, e in row.items()), arb(0)) for row in matrix]


def _left(row: Row, matrix: Matrix) -> Row:
    found: Row = [arb(0)] * len(row)
    for value, entries in zip(row, matrix, strict=True):
        if not (isinstance(value, arb) and value.is_zero()):
            for j, e in entries.items():
                found[j] = found[j] + value * e
    return found


def _inner(left: Sequence[arb], right: Sequence[arb]) -> arb:
    return sum((a * b for a, b in zip(left, right, strict=True)), arb(0))
