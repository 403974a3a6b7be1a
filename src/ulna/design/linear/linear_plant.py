"""The linearisation of a plant at a point where it rests, in rational numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import sympy as sp

from ulna.base import DesignError
from ulna.symbolic.formulas import formula
from ulna.system import Equilibrium, PointLike, System, as_point, equilibrium, linearise, require_continuous

_DIGITS = 12
"""Of a gain that was found in numbers."""
_REST = 1e-6
"""How far, beside the largest slope, a rate may be from zero at a point in decimals."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearPlant:
    """dx' = A dx + B du, dy = C dx + D du about a point of rest, every entry a rational number.

    Attributes:
        system: the plant, parameters at their values.
        point: exact or decimal value of every state and input, by symbol.
        A: (n, n); B: (n, m); C: (p, n); D: (p, m).
    """

    system: System
    point: dict[sp.Symbol, sp.Expr]
    A: sp.ImmutableDenseMatrix
    B: sp.ImmutableDenseMatrix
    C: sp.ImmutableDenseMatrix
    D: sp.ImmutableDenseMatrix

    @property
    def names(self) -> tuple[str, ...]:
        """(n,) names of the states."""
        return tuple(s.name for s in self.system.states)

    @property
    def where(self) -> str:
        """`x = 0, v = 1/2`: the states at the point, as people read it; `the origin` where all are zero."""
        shown = [f"{s} = {as_text(self.point[s])}" for s in self.system.state_symbols if self.point[s] != 0]
        return ", ".join(shown) or "the origin"


def linear_plant(plant: System, at: PointLike | None = None) -> LinearPlant:
    """The linearisation of a plant where it rests.

    Args:
        plant: parameters are put at their values.
        at: the point; left out, the operating point.

    Raises:
        PlantError: for a plant in discrete time.
        DesignError: for parameters without value, a point where the plant does not rest, or slopes without value there.
    """
    require_continuous(plant)
    asked = f"the linearisation of '{plant.name}'"
    missing = [p.name for p in plant.parameters if p.value is None]
    if missing:
        raise DesignError(asked, f"no value is given for {', '.join(missing)}.", "Give the parameters values.")
    system = plant.with_values()
    values = _point(system, at)
    _require_rest(system, values, asked)
    found = linearise(system, values)
    return LinearPlant(
        system=system,
        point=values,
        A=_rational(found.A, asked),
        B=_rational(found.B, asked),
        C=_rational(found.C, asked),
        D=_rational(found.D, asked),
    )


def _point(system: System, at: PointLike | None) -> dict[sp.Symbol, sp.Expr]:
    found = equilibrium(system)
    if at is None:
        return dict(found.values)
    if isinstance(at, Equilibrium):
        return {symbol: value.xreplace(dict(at.parameters)) for symbol, value in at.values.items()}
    return {**found.values, **as_point(system, at)}


def _require_rest(system: System, values: dict[sp.Symbol, sp.Expr], asked: str) -> None:
    symbols = list(values)
    rates = sp.Matrix(system.inline(system.rates))
    slopes = np.abs(np.array(rates.jacobian(symbols).subs(values).evalf(), dtype=object))
    for signal, rate, row in zip(system.states, rates, slopes, strict=True):
        value = rate.subs(values)
        number = complex(sp.N(value)) if value.is_number and not value.has(sp.zoo, sp.nan, sp.oo) else complex("nan")
        finite = [float(s) for s in row if s.is_Float and s.is_finite]
        if not abs(number) <= _REST * max([1.0, *finite]):
            where = ", ".join(f"{s} = {as_text(v)}" for s, v in values.items())
            raise DesignError(
                asked,
                f"it does not rest at {where}: {signal.name}' = {as_text(value)} there.",
                "Give [operating_point] values at which every rate vanishes.",
            )


def _rational(matrix: sp.ImmutableDenseMatrix, asked: str) -> sp.ImmutableDenseMatrix:
    def entry(value: sp.Expr) -> sp.Rational:
        if value.is_Rational:
            return value
        number = sp.N(value, 20)
        if not (number.is_Number and number.is_finite and number.is_real):
            raise DesignError(
                asked,
                f"a slope has no value at the point: {formula(value)}.",
                "A jump or kink lies there: choose another [operating_point], or smooth the formula.",
            )
        return sp.Rational(str(number))

    return sp.ImmutableDenseMatrix(matrix.rows, matrix.cols, [entry(e) for e in matrix])


def as_text(value: sp.Expr) -> str:
    """A value as people read it: exact where that is short, else six digits."""
    exact = formula(value)
    return exact if len(exact) <= 8 or not value.is_number else f"{float(sp.re(sp.N(value))):.6g}"


def as_numbers(matrix: sp.MatrixBase) -> np.ndarray:
    """The matrix in floating point, of its own shape even where that is empty."""
    return np.array([float(e) for e in matrix], dtype=float).reshape(matrix.shape)


def as_rational(matrix: np.ndarray) -> sp.ImmutableDenseMatrix:
    """The matrix with 12 digits of each number."""
    return sp.ImmutableDenseMatrix(*matrix.shape, [sp.Rational(f"{float(e):.{_DIGITS}g}") for e in matrix.ravel()])
