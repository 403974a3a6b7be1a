"""`equilibria`: all of a system in a range, by elimination and interval arithmetic where one equation remains."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import sympy as sp

from ulna.base import PlantError, Verdict
from ulna.symbolic.exact import attempt
from ulna.symbolic.formulas import put_in
from ulna.symbolic.solving import eliminate, real_roots
from ulna.system.equilibrium_point import Equilibrium, as_point
from ulna.system.holder import SystemLike, as_system
from ulna.system.system import System

_DIGITS = 15


@dataclass(frozen=True, slots=True, kw_only=True)
class Equilibria:
    """The equilibria found, in order of the searched state, and whether they are all there are in the range."""

    points: tuple[Equilibrium, ...]
    complete: Verdict

    def __iter__(self) -> Iterator[Equilibrium]:
        return iter(self.points)

    def __len__(self) -> int:
        return len(self.points)


def equilibria(
    system: SystemLike, within: Mapping[str, tuple[float, float]], inputs: Mapping[str, Any] | None = None
) -> Equilibria:
    """Every equilibrium with the state named in `within` inside its range.

    Args:
        system: all its parameters need values.
        within: one state and its (lower, upper) range, SI; the other states must follow from it linearly.
        inputs: constant SI value by input name, zero where left out.

    Raises:
        PlantError: for parameters without value, or when the rates cannot be reduced to one equation.
    """
    given = as_system(system)
    ((name, (lower, upper)),) = within.items()
    numeric = given.with_values()
    if numeric.parameters:
        names = ", ".join(p.name for p in numeric.parameters)
        raise PlantError(f"equilibria of '{given.name}'", f"parameters without a value: {names}.", "Give them values.")
    held = {**dict.fromkeys(given.input_symbols, sp.Integer(0)), **as_point(given, inputs or {})}
    unknown = sp.Symbol(name, real=True)
    others = [s for s in given.state_symbols if s != unknown]
    equation, rest = _one_equation(given, [put_in(r, held) for r in numeric.rates], unknown, others)
    found = real_roots(equation, unknown, float(lower), float(upper))
    points = []
    for root in found.values:
        values = {unknown: sp.Float(root, 30), **{s: e.subs(unknown, sp.Float(root, 30)) for s, e in rest.items()}}
        points.append(
            Equilibrium(
                system=given,
                states={s: sp.Rational(str(sp.N(values[s], _DIGITS))) for s in given.state_symbols},
                inputs=held,
                verdict=Verdict.supported(f"'{given.name}' rests there", method="interval arithmetic", digits=_DIGITS),
                parameters=given.values,
            )
        )
    claim = f"'{given.name}' has exactly {len(points)} equilibria with {lower:g} <= {name} <= {upper:g}"
    return Equilibria(points=tuple(points), complete=found.complete(claim))


def _one_equation(
    system: System, rates: list[sp.Expr], unknown: sp.Symbol, others: list[sp.Symbol]
) -> tuple[sp.Expr, dict[sp.Symbol, sp.Expr]]:
    found = attempt(3.0, "eliminate", eliminate, rates, unknown, others)
    if found.value is None:
        raise PlantError(
            f"equilibria of '{system.name}'",
            f"its rates do not reduce to one equation in {unknown.name}.",
            "Choose a state from which the others follow.",
        )
    return found.value
