"""Reduced-order plants: states that settle fast take their quasi-steady value (singular perturbation).

Source: Khalil, Nonlinear Systems, 3rd ed., section 11.1 and theorem 11.1 (Tikhonov); Kokotović, Khalil, O'Reilly 1986.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from ulna.base import DesignError, Verdict
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.exact import solve_linear, tidy
from ulna.symbolic.solving import solutions
from ulna.system import System, equilibrium, linearise

SETTLED = 3.0
"""Time constants after which a fast state counts as settled: e⁻³ = 5 % are left."""
_SEPARATION = 10.0
"""Least ratio of fast to slow eigenvalues where no sampling period says what fast means."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReducedOrder:
    """A plant without its fast states.

    Attributes:
        full: the plant; slow: the plant in its other states, the fast ones put at their quasi-steady values.
        manifold: quasi-steady value by fast state, in slow states and inputs: the rates of the fast states vanish.
        boundary: (f, f) Jacobian of the fast rates in the fast states on the manifold.
        time_constants: (f,) −1/Re λ of its eigenvalues at the operating point, longest first; infinite or negative
            where a fast state does not settle.
        verdict: whether the fast states settle by themselves and fast enough, with the numbers it rests on.
    """

    full: System
    slow: System
    manifold: Mapping[str, sp.Expr]
    boundary: sp.ImmutableDenseMatrix
    time_constants: tuple[float, ...]
    verdict: Verdict


def reduced_order(system: PlantLike, fast: Sequence[str], *, period: float | None = None) -> ReducedOrder:
    """The slow plant x' = f(x, φ(x, u), u), where z = φ(x, u) solves the fast rates g(x, z, u) = 0 exactly.

    By Tikhonov's theorem its motion differs from the plant's by O(ε), ε the ratio of fast to slow times, where the
    fast eigenvalues lie in the left half-plane. The verdict checks this at the operating point, and that the slowest
    fast time constant τ is short: 3 τ ≤ period, or, without a period, fast eigenvalues 10 times the slow ones.

    Args:
        system: every parameter needs a value for the verdict; without them it is undecided.
        fast: names of the fast states.
        period: sampling period in s of the loop that is to drive the plant.

    Raises:
        DesignError: for unknown names, or fast rates that do not determine the fast states uniquely.
    """
    system = as_plant(system)
    symbols = _fast_symbols(system, fast)
    rates = dict(zip(system.state_symbols, system.inline(system.rates), strict=True))
    manifold = _quasi_steady(system, [rates[s] for s in symbols], symbols)
    slow = _slow_system(system, rates, manifold)
    jacobian = sp.Matrix([rates[s] for s in symbols]).jacobian(list(symbols)).subs(manifold)
    boundary = sp.ImmutableDenseMatrix(jacobian.applyfunc(tidy))
    taus, verdict = _condition(system, slow, boundary, symbols, period)
    return ReducedOrder(
        full=system,
        slow=slow,
        manifold={s.name: manifold[s] for s in symbols},
        boundary=boundary,
        time_constants=taus,
        verdict=verdict,
    )


def _fast_symbols(system: System, fast: Sequence[str]) -> tuple[sp.Symbol, ...]:
    by_name = {s.name: s.symbol for s in system.states}
    unknown = [name for name in fast if name not in by_name]
    if unknown or not fast or len(fast) >= len(by_name):
        raise DesignError(
            f"fast states of '{system.name}'",
            f"no such state: {', '.join(unknown)}." if unknown else f"{len(fast)} of {len(by_name)} states are named.",
            f"Name some of {', '.join(by_name)}, not all.",
        )
    return tuple(by_name[name] for name in fast)


def _quasi_steady(
    system: System, equations: list[sp.Expr], unknowns: tuple[sp.Symbol, ...]
) -> dict[sp.Symbol, sp.Expr]:
    jacobian = sp.Matrix(equations).jacobian(list(unknowns))
    if not jacobian.free_symbols & set(unknowns):
        rest = sp.Matrix(equations).subs(dict.fromkeys(unknowns, sp.Integer(0)))
        solved = solve_linear(jacobian, -rest).solution
        if solved is not None:
            return dict(zip(unknowns, (tidy(e) for e in solved), strict=True))
    found = solutions(equations, unknowns)
    complete = [s for s in found if set(s) == set(unknowns)]
    if len(complete) == 1:
        return complete[0]
    names = ", ".join(s.name for s in unknowns)
    raise DesignError(
        f"quasi-steady state of {names} in '{system.name}'",
        "their rates do not determine them." if not complete else f"there are {len(complete)} solutions.",
        "Name states whose rates can be solved for them.",
    )


def _slow_system(system: System, rates: Mapping[sp.Symbol, sp.Expr], manifold: Mapping[sp.Symbol, sp.Expr]) -> System:
    kept = [s for s in system.states if s.symbol not in manifold]
    names = {s.name for s in manifold}
    return replace(
        system,
        name=f"{system.name}, {', '.join(s.name for s in manifold)} fast",
        states=tuple(kept),
        rates=tuple(tidy(rates[s.symbol].subs(dict(manifold))) for s in kept),
        readouts=tuple(e.subs(dict(manifold)) for e in system.inline(system.readouts)),
        definitions=(),
        operating_point=tuple((name, value) for name, value in system.operating_point if name not in names),
    )


def _condition(
    system: System, slow: System, boundary: sp.ImmutableDenseMatrix, fast: Sequence[sp.Symbol], period: float | None
) -> tuple[tuple[float, ...], Verdict]:
    names = ", ".join(s.name for s in fast)
    claim = f"{names} of '{system.name}' settle{'s' * (len(fast) == 1)} " + (
        f"within a sample of {period:g} s" if period is not None else f"{_SEPARATION:g} times faster than the rest"
    )
    missing = [p.name for p in system.parameters if p.si_value is None]
    if missing:
        return (), Verdict.undecided(claim, parameters_without_value=missing)
    numeric = slow.with_values()
    point = {**system.values, **equilibrium(numeric).values}
    eigenvalues = np.linalg.eigvals(np.array(boundary.subs(point).evalf(), dtype=float))
    taus = tuple(sorted((-1.0 / e.real if e.real else math.inf for e in eigenvalues), reverse=True))
    evidence = {"fast_eigenvalues": tuple(complex(e) for e in eigenvalues), "slowest_time_constant": max(taus)}
    if max(e.real for e in eigenvalues) >= 0:
        return taus, Verdict.refuted(claim, **evidence, reason="a fast state does not settle by itself")
    if period is not None:
        ratio = period / max(taus)
        evidence |= {"period_over_time_constant": ratio, "needed": SETTLED}
        return taus, (Verdict.proved if ratio >= SETTLED else Verdict.refuted)(claim, **evidence)
    slowest = max(abs(e) for e in linearise(numeric).eigenvalues)
    ratio = min(-e.real for e in eigenvalues) / slowest if slowest else math.inf
    evidence |= {"separation": float(ratio), "needed": _SEPARATION}
    return taus, (Verdict.proved if ratio >= _SEPARATION else Verdict.refuted)(claim, **evidence)
