"""What known answers are compared with: Lie derivatives and numbers at random points, none of them ulna's own."""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import mpmath
import sympy as sp

from ulna.symbolic.formulas import parse_formula
from ulna.system import System, control_affine, equilibrium

DIGITS = 40
_SMALL = mpmath.mpf(10) ** -18
_POINTS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """A plant x' = f + g u, y = h as bare expressions, with random points near its operating point.

    Attributes:
        states, inputs: symbols; parameters: symbol -> exact value.
        f: (n, 1), g: (n, m), h: (p,) expressions; point: of the states.
    """

    states: tuple[sp.Symbol, ...]
    inputs: tuple[sp.Symbol, ...]
    parameters: dict[sp.Symbol, sp.Expr]
    f: sp.Matrix
    g: sp.Matrix
    h: tuple[sp.Expr, ...]
    point: dict[sp.Symbol, sp.Expr]

    def parse(self, text: object) -> sp.Expr:
        """A formula of an answer: the plant's names, v, v1…, z1…, e1…, y, y1…."""
        known = {s.name: s for s in (*self.states, *self.inputs, *self.parameters)}
        extra = ["v", "y", *(f"{stem}{k}" for stem in "vzey" for k in range(1, 10))]
        names = {n: sp.Symbol(n, real=True) for n in extra} | known
        return parse_formula(str(text), names, where="answer")

    def samples(self, free: Iterable[sp.Symbol] = ()) -> list[dict[sp.Symbol, sp.Expr]]:
        """Random rational values of states, inputs, parameters and further symbols."""
        draw = random.Random(7)
        known = {**self.point, **self.parameters}
        symbols = dict.fromkeys([*self.states, *self.inputs, *self.parameters, *free])
        return [{s: _near(known.get(s, sp.Integer(0)), draw) for s in symbols} for _ in range(_POINTS)]

    def along(self, function: sp.Expr, field: sp.Matrix) -> sp.Expr:
        """The derivative of a function of the state along a field."""
        return sum((sp.diff(function, x) * c for x, c in zip(self.states, field, strict=True)), sp.Integer(0))

    def drift(self, function: sp.Expr, times: int = 1) -> sp.Expr:
        """L_f^k of a function."""
        for _ in range(times):
            function = self.along(function, self.f)
        return function

    def by_inputs(self, function: sp.Expr) -> list[sp.Expr]:
        """L_g of a function, one entry per input."""
        return [self.along(function, self.g[:, j]) for j in range(self.g.cols)]

    def gradients(self, functions: Sequence[sp.Expr]) -> sp.Matrix:
        """Differentials as rows."""
        return sp.Matrix(len(functions), len(self.states), [sp.diff(h, x) for h in functions for x in self.states])


def facts(system: System) -> Facts:
    """The facts of a system; its operating point with parameters at their values."""
    view = control_affine(system)
    point = {s: sp.sympify(e).subs(system.values) for s, e in equilibrium(system).states.items()}
    return Facts(
        states=tuple(view.x),
        inputs=tuple(view.u),
        parameters={s: system.values.get(s, sp.Rational(7, 5)) for s in system.parameter_symbols},
        f=sp.Matrix(view.f),
        g=sp.Matrix(view.g),
        h=tuple(view.h),
        point=point,
    )


def _near(value: sp.Expr, draw: random.Random) -> sp.Expr:
    step = sp.Rational(draw.randint(10, 90), 1000)
    return step if value == 0 else value * (1 + step / 2)


def number(expression: sp.Expr, point: dict[sp.Symbol, sp.Expr]) -> mpmath.mpc:
    """The value of an expression at a point, 40 digits."""
    symbols = sorted(expression.free_symbols, key=str)
    with mpmath.workdps(DIGITS):
        values = [mpmath.mpmathify(sp.N(point[s], DIGITS)) for s in symbols]
        return mpmath.mpc(sp.lambdify(symbols, expression, modules="mpmath")(*values))


def vanishes(expressions: Iterable[sp.Expr], points: Sequence[dict[sp.Symbol, sp.Expr]]) -> bool:
    """Whether all expressions are zero at all points."""
    return all(abs(number(sp.sympify(e), p)) < _SMALL for e in expressions for p in points)


def rank(matrix: sp.Matrix, points: Sequence[dict[sp.Symbol, sp.Expr]]) -> int:
    """The largest rank at the points, by elimination with full pivoting on scaled columns."""
    return max(_rank([[number(sp.sympify(e), p) for e in row] for row in matrix.tolist()]) for p in points)


def _rank(rows: list[list[mpmath.mpc]]) -> int:
    found = 0
    with mpmath.workdps(DIGITS):
        sizes = [max((abs(row[j]) for row in rows), default=0) for j in range(len(rows[0]) if rows else 0)]
        rest = [[v / s if s > _SMALL else mpmath.mpf(0) for v, s in zip(row, sizes, strict=True)] for row in rows]
        while rest:
            places = ((i, j) for i in range(len(rest)) for j in range(len(sizes)))
            i, j = max(places, key=lambda place: abs(rest[place[0]][place[1]]))
            pivot = rest.pop(i)
            if abs(pivot[j]) < _SMALL:
                break
            rest = [[v - row[j] / pivot[j] * w for v, w in zip(row, pivot, strict=True)] for row in rest]
            found += 1
    return found
