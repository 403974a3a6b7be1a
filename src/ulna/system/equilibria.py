"""All equilibria of a system in its ranges: by elimination and interval arithmetic where one equation remains."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
import sympy as sp

from ulna.base.errors import PlantError
from ulna.base.verdict import Verdict
from ulna.symbolic.budget import attempt
from ulna.system.linearise import linearise
from ulna.system.system import System

_SMALLEST_PIECE = 1e-9
_MAX_PIECES = 20_000


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
    roots, complete = _roots(equation, unknown, float(lower), float(upper))
    points = []
    for root in roots:
        values = {unknown: sp.Float(root, 30), **{s: e.subs(unknown, sp.Float(root, 30)) for s, e in rest.items()}}
        jacobian = np.array(linearise(numeric, {**values, **held}).A.evalf(), dtype=float)
        eigenvalues = sorted(np.linalg.eigvals(jacobian), key=lambda v: (-v.real, v.imag))
        states = {s.name: float(values[s]) for s in system.state_symbols}
        points.append(Equilibrium(states=states, eigenvalues=tuple(complex(v) for v in eigenvalues)))
    claim = f"'{system.name}' has exactly {len(points)} equilibria with {lower:g} <= {name} <= {upper:g}"
    return Equilibria(points=tuple(points), complete=complete(claim))


def _one_equation(
    system: System, rates: list[sp.Expr], unknown: sp.Symbol, others: list[sp.Symbol]
) -> tuple[sp.Expr, dict[sp.Symbol, sp.Expr]]:
    found = attempt(3.0, "eliminate", _eliminate, rates, unknown, others)
    if found.value is None:
        raise PlantError(
            f"equilibria of '{system.name}'",
            f"its rates do not reduce to one equation in {unknown.name}.",
            "Choose a state from which the others follow.",
        )
    return found.value


def _eliminate(
    rates: list[sp.Expr], unknown: sp.Symbol, others: list[sp.Symbol]
) -> tuple[sp.Expr, dict[sp.Symbol, sp.Expr]] | None:
    """Solve the rates for the other states one at a time, each from an equation linear in it."""
    equations, rest, left = [r for r in rates if r != 0], {}, list(others)
    while left:
        for symbol in left:
            usable = next((e for e in equations if e.has(symbol) and not e.diff(symbol).has(*left)), None)
            if usable is not None:
                break
        else:
            return None
        solution = sp.simplify(-usable.subs(symbol, 0) / usable.diff(symbol))
        equations = [sp.simplify(e.subs(symbol, solution)) for e in equations if e is not usable]
        equations = [e for e in equations if e != 0]
        rest = {s: e.subs(symbol, solution) for s, e in rest.items()} | {symbol: solution}
        left.remove(symbol)
    numerators = [sp.fraction(sp.together(e))[0] for e in equations if e.has(unknown)]
    return (numerators[0], rest) if len(numerators) == 1 and len(equations) == 1 else None


def _roots(
    equation: sp.Expr, unknown: sp.Symbol, lower: float, upper: float
) -> tuple[list[float], Callable[[str], Verdict]]:
    """All roots in [lower, upper]: pieces where an interval excludes a root or shows exactly one."""
    context = mpmath.iv
    value = sp.lambdify(unknown, equation, modules=[_interval_functions(context), "mpmath"])
    slope = sp.lambdify(unknown, sp.diff(equation, unknown), modules=[_interval_functions(context), "mpmath"])
    exact_value = sp.lambdify(unknown, equation, "mpmath")
    pieces, roots, doubtful, seen = [(lower, upper)], [], [], 0
    while pieces and seen < _MAX_PIECES:
        left, right = pieces.pop()
        seen += 1
        piece = context.mpf([left, right])
        if 0 not in context.mpf(value(piece)):
            continue
        if 0 not in context.mpf(slope(piece)):
            ends = exact_value(mpmath.mpf(left)), exact_value(mpmath.mpf(right))
            if ends[0] * ends[1] <= 0:
                roots.append(float(mpmath.findroot(exact_value, (left, right), solver="anderson", tol=1e-28)))
            continue
        if right - left < _SMALLEST_PIECE:
            doubtful.append((left, right))
            continue
        # Cut off the middle so that a root at a round number does not sit on a seam.
        middle = left + 0.4871 * (right - left)
        pieces += [(left, middle), (middle, right)]
    roots = sorted(roots)
    distinct = [r for k, r in enumerate(roots) if k == 0 or r - roots[k - 1] > 1e-12 * max(1.0, abs(r))]
    if pieces or doubtful:
        where = [f"[{a:g}, {b:g}]" for a, b in (pieces + doubtful)[:3]]
        return distinct, lambda claim: Verdict.undecided(claim, unresolved=where)
    return distinct, lambda claim: Verdict.proved(claim, method="interval arithmetic", pieces=seen)


def _interval_functions(context: Any) -> dict[str, Any]:
    def tan(x: Any) -> Any:
        return context.sin(x) / context.cos(x)

    return {
        "sin": context.sin,
        "cos": context.cos,
        "exp": context.exp,
        "log": context.log,
        "sqrt": context.sqrt,
        "tan": tan,
    }
