"""Dimensions checked from units: a rate of `theta [rad]` must come out in rad/s, whatever formula writes it."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

import sympy as sp
from sympy.core.relational import Relational

from ulna.base import Dimension, UnitError, dimension_text, unit
from ulna.symbolic.formulas import formula
from ulna.system.system import System

_ONE: Dimension = {}
_SAME_DIMENSION = (sp.Min, sp.Max, sp.Abs, sp.floor, sp.ceiling)


def check_dimensions(system: System) -> None:
    """Refuse formulas whose dimension is not the one due. Does nothing when the system carries no units at all.

    Raises:
        UnitError: naming the formula, the dimension found and the one due.
    """
    items = (*system.states, *system.inputs, *system.outputs, *system.parameters)
    if not any(item.unit for item in items):
        return
    known: dict[sp.Symbol, Dimension] = {
        item.symbol: unit(item.unit).dimension for item in (*system.states, *system.inputs, *system.parameters)
    }
    known |= {d.symbol: unit(d.unit).dimension for d in system.unknowns}
    for definition in system.definitions:
        found = _dimension(definition.expression, known, f"definition '{definition.name}'")
        if not definition.implicit:
            known[definition.symbol] = found or _ONE
    for state, rate in zip(system.states, system.rates, strict=True):
        due, due_unit = unit(state.unit).dimension, state.unit or "1"
        if not system.discrete:
            due, due_unit = _times(due, {"time": Fraction(-1)}), f"{due_unit}/s"
        _require(rate, due, known, f"equation of state '{state.name}'", due_unit)
    for output, readout in zip(system.outputs, system.readouts, strict=True):
        due = unit(output.unit).dimension
        _require(readout, due, known, f"equation of output '{output.name}'", output.unit or "1")


def _require(
    expression: sp.Expr, due: Dimension, known: Mapping[sp.Symbol, Dimension], where: str, due_unit: str
) -> None:
    found = _dimension(expression, known, where)
    if found is not None and found != due:
        raise UnitError(
            where,
            f"{formula(expression)} has dimension {dimension_text(found)}; "
            f"expected {due_unit} ({dimension_text(due)}).",
            "Check the formula or the units.",
        )


def _dimension(expression: sp.Expr, known: Mapping[sp.Symbol, Dimension], where: str) -> Dimension | None:
    """The dimension of an expression; None for zero, which fits every dimension."""
    if expression == 0:
        return None
    if expression.is_number:
        return _ONE
    if expression.is_Symbol:
        return known[expression]
    if expression.is_Mul:
        total: Dimension = _ONE
        for factor in expression.args:
            total = _times(total, _dimension(factor, known, where) or _ONE)
        return total
    if expression.is_Add or isinstance(expression, _SAME_DIMENSION):
        return _common(expression, expression.args, known, where)
    if expression.is_Pow and not isinstance(expression, sp.exp):
        return _power(expression, known, where)
    if isinstance(expression, sp.Piecewise | sp.atan2):
        return _compared(expression, known, where)
    for argument in expression.args:
        if not isinstance(expression, sp.sign | sp.Heaviside):
            inner = _dimension(argument, known, where)
            if inner:
                raise UnitError(
                    where,
                    f"{formula(expression)} takes {formula(argument)}, of dimension {dimension_text(inner)}, "
                    "where a pure number or an angle is expected.",
                    "Divide it by a reference quantity.",
                )
    return _ONE


def _compared(expression: sp.Expr, known: Mapping[sp.Symbol, Dimension], where: str) -> Dimension | None:
    """The dimension of a Piecewise, whose conditions compare like with like; of atan2, a pure number of two alike."""
    if isinstance(expression, sp.atan2):
        _common(expression, expression.args, known, where)
        return _ONE
    for comparison in sorted(expression.atoms(Relational), key=str):
        _common(comparison, comparison.args, known, where)
    return _common(expression, tuple(e for e, _ in expression.args), known, where)


def _common(
    whole: sp.Expr, parts: tuple[sp.Expr, ...], known: Mapping[sp.Symbol, Dimension], where: str
) -> Dimension | None:
    first: tuple[sp.Expr, Dimension] | None = None
    verb = "compares" if isinstance(whole, Relational) else "adds"
    for part in parts:
        found = _dimension(part, known, where)
        if found is None:
            continue
        if first is not None and found != first[1]:
            raise UnitError(
                where,
                f"{formula(whole)} {verb} {formula(first[0])} [{dimension_text(first[1])}] "
                f"and {formula(part)} [{dimension_text(found)}].",
                "Both must have the same dimension.",
            )
        first = first or (part, found)
    return first[1] if first else None


def _power(expression: sp.Expr, known: Mapping[sp.Symbol, Dimension], where: str) -> Dimension:
    base, exponent = expression.as_base_exp()
    inner = _dimension(base, known, where) or _ONE
    if exponent.is_Rational:
        power = Fraction(int(exponent.p), int(exponent.q))
        return {name: value * power for name, value in inner.items()}
    if inner or _dimension(exponent, known, where):
        raise UnitError(where, f"{formula(expression)} raises a quantity to a power that is not a plain number.")
    return _ONE


def _times(left: Dimension, right: Dimension) -> Dimension:
    total = {name: left.get(name, Fraction(0)) + right.get(name, Fraction(0)) for name in {*left, *right}}
    return {name: power for name, power in total.items() if power != 0}
