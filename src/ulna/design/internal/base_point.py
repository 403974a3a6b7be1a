"""The point about which a form is judged: the operating point with numbers for every parameter."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import sympy as sp

from ulna.base.verdict import Verdict
from ulna.symbolic.exact.budget import attempt
from ulna.system.operating_point import operating_point
from ulna.system.system import System

_SECONDS = 1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class BasePoint:
    """An exact value for every state, input and parameter.

    Attributes:
        states: value by state symbol; inputs: value by input symbol.
        parameters: value by parameter symbol; a parameter without a value stands at an arbitrary positive rational
            number within its bounds, so that nothing vanishes there by accident.
        equilibrium: whether the system rests there with the parameters at these values.
    """

    states: dict[sp.Symbol, sp.Expr]
    inputs: dict[sp.Symbol, sp.Expr]
    parameters: dict[sp.Symbol, sp.Expr]
    equilibrium: Verdict

    @property
    def values(self) -> dict[sp.Symbol, sp.Expr]:
        """States and parameters together, what a function of the state needs."""
        return {**self.states, **self.parameters}


@lru_cache(maxsize=64)
def base_point(system: System) -> BasePoint:
    """The operating point of a system, parameters at their values."""
    parameters = {p.symbol: p.si_value for p in system.parameters if p.si_value is not None}
    for number, parameter in enumerate(system.parameters):
        if parameter.symbol not in parameters:
            parameters[parameter.symbol] = _stand_in(number, parameter.lower, parameter.upper)
    found = attempt(_SECONDS, "operating point", operating_point, system.with_values())
    if found.value is None:
        given = {sp.Symbol(name, real=True): value for name, value in system.operating_point}
        states = {s: given.get(s, sp.Integer(0)) for s in system.state_symbols}
        inputs = {s: given.get(s, sp.Integer(0)) for s in system.input_symbols}
        equilibrium = Verdict.undecided(f"'{system.name}' rests at its operating point", tried=found.reason)
    else:
        states, inputs, equilibrium = dict(found.value.states), dict(found.value.inputs), found.value.equilibrium
    return BasePoint(
        states={s: v.xreplace(parameters) for s, v in states.items()},
        inputs={s: v.xreplace(parameters) for s, v in inputs.items()},
        parameters=parameters,
        equilibrium=equilibrium,
    )


def _stand_in(number: int, lower: sp.Expr | None, upper: sp.Expr | None) -> sp.Expr:
    value = sp.Rational(7 + 2 * number, 5) + sp.Rational(1, 13 + number)
    if lower is not None and upper is not None:
        return lower + (upper - lower) * sp.Rational(5, 12)
    if lower is not None and value <= lower:
        return lower + value
    if upper is not None and value >= upper:
        return upper - value
    return value
