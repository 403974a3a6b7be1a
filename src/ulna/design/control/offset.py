"""The permanent offset that a law leaves where the plant is not the one it was designed for, in closed form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import sympy as sp

from ulna.base import DesignError
from ulna.design.control.output_feedback import close_loop
from ulna.plants import PlantLike
from ulna.symbolic.exact import attempt, tidy
from ulna.symbolic.formulas import exact
from ulna.symbolic.solving import eliminate, zeros_in_box
from ulna.system import System, SystemLike


@dataclass(frozen=True, slots=True, kw_only=True)
class PermanentOffset:
    """Where a mismatched loop rests: equation(unknown) = 0.

    Attributes:
        system: the closed loop; parameters that differ in plant and law begin with `plant_` and `controller_`.
        unknown: the state the equation is in.
        equation: the one equation left when all other states are eliminated.
        first_order: one Newton step from zero: the offset to first order in the mismatch.
        rest: the other states as expressions in the unknown.
    """

    system: System
    unknown: sp.Symbol
    equation: sp.Expr
    first_order: sp.Expr
    rest: Mapping[sp.Symbol, sp.Expr]

    def value(self, values: Mapping[str, Any] | None = None, *, within: tuple[float, float] = (-1.5, 1.5)) -> float:
        """The offset in SI nearest to zero, for SI values of parameters and references (else their own, and 0).

        Raises:
            DesignError: where the loop rests nowhere in the range.
        """
        numbers = {p.symbol: p.si_value for p in self.system.parameters if p.si_value is not None}
        numbers |= dict.fromkeys(self.system.input_symbols, sp.Integer(0))
        numbers |= {sp.Symbol(n, real=True): exact(v) for n, v in (values or {}).items()}
        numerator = sp.expand(sp.fraction(sp.together(self.equation.subs(numbers)))[0])
        roots = [float(z[self.unknown]) for z in zeros_in_box([numerator], {self.unknown: within}).values]
        if not roots:
            raise DesignError(
                f"offset of '{self.system.name}'", f"no equilibrium was found between {within[0]:g} and {within[1]:g}."
            )
        return min(roots, key=abs)


def permanent_offset(plant: PlantLike, controller: SystemLike, unknown: str) -> PermanentOffset:
    """The closed form of where the loop of a plant and a controller designed for another rests.

    Args:
        plant: the true plant; parameters it holds with other values than the controller become two symbols.
        controller: a law or compensator, its parameters symbolic or numbers.
        unknown: the state of the plant that is left.

    Raises:
        DesignError: where elimination does not leave one equation.
    """
    loop = close_loop(plant, controller).system
    symbol = sp.Symbol(unknown, real=True)
    others = [s for s in loop.state_symbols if s != symbol]
    if len(others) == len(loop.states):
        raise DesignError(f"offset of '{loop.name}'", f"it has no state '{unknown}'.")
    found = attempt(20.0, "eliminate", eliminate, list(loop.inline(loop.rates)), symbol, others)
    if found.value is None:
        raise DesignError(
            f"offset of '{loop.name}'",
            f"its rates do not reduce to one equation in {unknown}.",
            "Simulate it instead.",
        )
    equation, rest = found.value
    at_zero = {symbol: sp.Integer(0)}
    first = tidy(-equation.subs(at_zero) / equation.diff(symbol).subs(at_zero))
    return PermanentOffset(system=loop, unknown=symbol, equation=equation, first_order=first, rest=rest)
