"""All equilibria of a system in its ranges: by elimination and interval arithmetic where one equation remains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from ulna.base.errors import PlantError
from ulna.base.verdict import Verdict
from ulna.symbolic.exact.budget import attempt
from ulna.symbolic.solving.roots import eliminate, real_roots
from ulna.system.linearise import linearise
from ulna.system.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class Equilibrium:
    """A point where every rate vanishes.

    Attributes:
        states: SI value by state name; eigenvalues: (n,) of the linearisation there, sorted by real part, last first.
    """

    states: Mapping[str, float]
    eigenvalues: tuple[complex, ...]

    @property
    def stable(self) -> bool:
        """Whether every eigenvalue lies in the open left half-plane (exponential stability)."""
        return all(v.real < 0 for v in self.eigenvalues)


@dataclass(frozen=True, slots=True, kw_only=True)
class Equilibria:
    """The equilibria found, in order of the searched state, and whether they are all there are in the range."""

    points: tuple[Equilibrium, ...]
    complete: Verdict


def equilibria(
    system: System, within: Mapping[str, tuple[float, float]], inputs: Mapping[str, Any] | None = None
) -> Equilibria:
    """Every equilibrium with the state named in `within` inside its range.

    Args:
        system: all its parameters need values.
        within: one state and its (lower, upper) range, SI; the other states must follow from it linearly.
        inputs: constant SI value by input name, zero where left out.

    Raises:
        PlantError: for parameters without value, or when the rates cannot be reduced to one equation.
    """
    ((name, (lower, upper)),) = within.items()
    numeric = system.with_values()
    if numeric.parameters:
        names = ", ".join(p.name for p in numeric.parameters)
        raise PlantError(f"equilibria of '{system.name}'", f"parameters without a value: {names}.", "Give them values.")
    held = {s.symbol: sp.nsimplify((inputs or {}).get(s.name, 0), rational=True) for s in system.inputs}
    unknown = sp.Symbol(name, real=True)
    others = [s for s in system.state_symbols if s != unknown]
    rates = [r.subs(held) for r in numeric.rates]
    equation, rest = _one_equation(system, rates, unknown, others)
    found = real_roots(equation, unknown, float(lower), float(upper))
    points = []
    for root in found.values:
        values = {unknown: sp.Float(root, 30), **{s: e.subs(unknown, sp.Float(root, 30)) for s, e in rest.items()}}
        jacobian = np.array(linearise(numeric, {**values, **held}).A.evalf(), dtype=float)
        eigenvalues = sorted(np.linalg.eigvals(jacobian), key=lambda v: (-v.real, v.imag))
        states = {s.name: float(values[s]) for s in system.state_symbols}
        points.append(Equilibrium(states=states, eigenvalues=tuple(complex(v) for v in eigenvalues)))
    claim = f"'{system.name}' has exactly {len(points)} equilibria with {lower:g} <= {name} <= {upper:g}"
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
