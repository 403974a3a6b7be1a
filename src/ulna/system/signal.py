"""The named quantities of a system: states, inputs and outputs (`Signal`), constants (`Parameter`), abbreviations."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from ulna.base import unit


@dataclass(frozen=True, slots=True, kw_only=True)
class Signal:
    """A state, an input or an output: a function of time.

    Attributes:
        name: its name in formulas.
        unit: the unit its numbers are in (`"rad"`, `"V"`), in plant files coherent with SI; empty where no unit is
            told.
        text: what it is, in a few words.
        lower, upper: its range, exact, or None where unbounded.
        measured, controlled: of an output what it is for.

    Examples:
        >>> theta = ulna.Signal(name="theta", unit="rad", text="angle of the arm")
        >>> theta.unit
        'rad'
    """

    name: str
    unit: str = ""
    text: str = ""
    lower: sp.Expr | None = None
    upper: sp.Expr | None = None
    measured: bool = True
    controlled: bool = True

    @property
    def symbol(self) -> sp.Symbol:
        """The real symbol that stands for it in every expression."""
        return sp.Symbol(self.name, real=True)

    @property
    def label(self) -> str:
        """`name [unit]`, as axes and tables show it."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A constant of the plant. Without a value it stays symbolic in every formula.

    Attributes:
        value: exact number in `unit`, or None.
        lower, upper: bounds in `unit`.
        source: where the number comes from.
        std: standard deviation of the value in `unit`, None where it is not told.

    Examples:
        >>> import sympy as sp
        >>> ulna.Parameter(name="m", value=sp.Rational(5, 2), unit="g").si_value
        1/400
    """

    name: str
    value: sp.Expr | None = None
    unit: str = ""
    text: str = ""
    lower: sp.Expr | None = None
    upper: sp.Expr | None = None
    source: str = ""
    std: sp.Expr | None = None

    @property
    def symbol(self) -> sp.Symbol:
        """The real symbol that stands for it in every expression."""
        return sp.Symbol(self.name, real=True)

    @property
    def si_value(self) -> sp.Expr | None:
        """The exact value in SI."""
        return None if self.value is None else to_si(self.value, self.unit)

    @property
    def si_std(self) -> sp.Expr | None:
        """The exact standard deviation in SI."""
        return None if self.std is None else to_si(self.std, self.unit)


@dataclass(frozen=True, slots=True, kw_only=True)
class Definition:
    """An abbreviation: `name` stands for `expression`, which may use parameters, states, inputs and earlier ones.

    Attributes:
        name: of its symbol.
        expression: what it stands for; of an implicit one, what it makes zero.
        implicit: whether `name` is what makes the expression zero. All implicit ones of a system are found together;
            their expressions are affine in them and may use every definition: accelerations behind a mass matrix.
        unit: of an implicit one, whose formula does not tell it.

    Examples:
        >>> import sympy as sp
        >>> m, v = sp.symbols("m v", real=True)
        >>> ulna.Definition(name="momentum", expression=m * v).expression
        m*v
    """

    name: str
    expression: sp.Expr
    implicit: bool = False
    unit: str = ""

    @property
    def symbol(self) -> sp.Symbol:
        """The real symbol that stands for it in every expression."""
        return sp.Symbol(self.name, real=True)


def to_si(value: sp.Expr, unit_text: str) -> sp.Expr:
    """The exact SI number of a value in a unit (degrees become multiples of π)."""
    return value * _factor(unit_text)


def from_si(value: sp.Expr, unit_text: str) -> sp.Expr:
    """The exact number in a unit of an SI value."""
    return value / _factor(unit_text)


def _factor(unit_text: str) -> sp.Expr:
    factors = unit(unit_text)
    return sp.Rational(factors.factor.numerator, factors.factor.denominator) * (sp.pi / 180) ** factors.degrees
