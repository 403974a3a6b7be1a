"""The operating point of a system: what the user gave, completed to an equilibrium where one exists."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import sympy as sp

from ulna.base.verdict import Verdict
from ulna.symbolic.exact.zero import is_zero
from ulna.symbolic.formulas.text import formula
from ulna.symbolic.solving.roots import solutions
from ulna.system.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class OperatingPoint:
    """Values of states and inputs (SI, exact; parameters may appear), and whether the system rests there.

    Attributes:
        states: value by state symbol, in the order of the system's states.
        inputs: value by input symbol.
        equilibrium: proved or supported if every rate vanishes, refuted with the rate that does not.
        parameters: value by parameter symbol where the system rests there only at the parameters' values; empty where
            it rests for any parameters, or not at all.
    """

    system: System
    states: Mapping[sp.Symbol, sp.Expr]
    inputs: Mapping[sp.Symbol, sp.Expr]
    equilibrium: Verdict
    parameters: Mapping[sp.Symbol, sp.Expr] = field(default_factory=dict)

    @property
    def where(self) -> dict[sp.Symbol, sp.Expr]:
        """What questions at the point are asked at: the states, and the parameters where the point hangs on them."""
        return {**self.states, **self.parameters}

    @property
    def phrase(self) -> str:
        """`at the operating point`, and that parameters stand at their values where they do."""
        return "at the operating point" + (", parameters at their values" if self.parameters else "")

    @property
    def values(self) -> dict[sp.Symbol, sp.Expr]:
        """States and inputs together."""
        return {**self.states, **self.inputs}


@lru_cache(maxsize=64)
def operating_point(system: System) -> OperatingPoint:
    """The given operating point, the rest solved for.

    What the user left out is sought in this order: at zero; as an equilibrium with inputs at zero; as any
    equilibrium. Numbers given for states often fit the parameters' values only: where symbols leave no equilibrium the
    parameters are put at their values. Where none is found the states left out are zero and `equilibrium` is refuted.
    """
    symbols = {s.name: s.symbol for s in (*system.states, *system.inputs)}
    given = {symbols[name]: value for name, value in system.operating_point}
    rates = system.inline(system.rates)
    rest_states = [s for s in system.state_symbols if s not in given]
    rest_inputs = [s for s in system.input_symbols if s not in given]
    zero_inputs = dict.fromkeys(rest_inputs, sp.Integer(0))
    zero_states = dict.fromkeys(rest_states, sp.Integer(0))
    candidates = (
        lambda: _solved(rates, {**given, **zero_states}, rest_inputs, system),
        lambda: _solved(rates, {**given, **zero_inputs}, rest_states, system) if rest_states else None,
        lambda: _solved(rates, given, [*rest_states, *rest_inputs], system) if rest_states and rest_inputs else None,
    )
    for candidate in candidates:
        point = candidate()
        if point is not None:
            verdict = _equilibrium(system, rates, point)
            if verdict.holds:
                return _point(system, point, verdict)
    if given and system.values:
        at_values = operating_point(system.with_values())
        if at_values.equilibrium.holds:
            return _point(system, at_values.values, at_values.equilibrium, parameters=dict(system.values))
    point = {**given, **zero_states, **zero_inputs}
    return _point(system, point, _equilibrium(system, rates, point))


def given_point(system: System) -> OperatingPoint:
    """The given operating point, zeros where nothing is given; whether it is an equilibrium is not asked."""
    given = dict(system.operating_point)
    verdict = Verdict.undecided(f"'{system.name}' rests at its operating point", reason="not asked for a large plant")
    return OperatingPoint(
        system=system,
        states={s.symbol: given.get(s.name, sp.Integer(0)) for s in system.states},
        inputs={s.symbol: given.get(s.name, sp.Integer(0)) for s in system.inputs},
        equilibrium=verdict,
    )


def _point(
    system: System,
    point: Mapping[sp.Symbol, sp.Expr],
    verdict: Verdict,
    parameters: Mapping[sp.Symbol, sp.Expr] | None = None,
) -> OperatingPoint:
    return OperatingPoint(
        system=system,
        states={s: point[s] for s in system.state_symbols},
        inputs={s: point[s] for s in system.input_symbols},
        equilibrium=verdict,
        parameters=parameters or {},
    )


def _solved(
    rates: tuple[sp.Expr, ...], fixed: Mapping[sp.Symbol, sp.Expr], unknowns: list[sp.Symbol], system: System
) -> dict[sp.Symbol, sp.Expr] | None:
    """`fixed` with values for the unknowns that make every rate zero; free ones are set to zero."""
    equations = [e for r in rates if (e := r.subs(dict(fixed))) != 0]
    if any(e.has(sp.zoo, sp.nan, sp.oo) for e in equations):
        return None
    if not unknowns or not equations:
        return {**fixed, **dict.fromkeys(unknowns, sp.Integer(0))}
    if any(not e.free_symbols & set(unknowns) and is_zero(e).fails for e in equations):
        return None
    best: tuple[float, dict[sp.Symbol, sp.Expr]] | None = None
    for solution in solutions(equations, unknowns):
        free = dict.fromkeys([u for u in unknowns if u not in solution], sp.Integer(0))
        point = {**fixed, **free, **{s: e.subs(free) for s, e in solution.items()}}
        size = _distance(point, system)
        if size is not None and (best is None or size < best[0]):
            best = (size, point)
    return best[1] if best else None


def _distance(point: Mapping[sp.Symbol, sp.Expr], system: System) -> float | None:
    """How far from zero the point lies at the parameters' values (1 where they have none); None if not real."""
    numbers = {s: system.values.get(s, sp.Integer(1)) for s in system.parameter_symbols}
    total = 0.0
    for value in point.values():
        number = complex(sp.N(value.subs(numbers)))
        if abs(number.imag) > 1e-12 or number != number:  # noqa: PLR0124  (NaN differs from itself)
            return None
        total += abs(number.real)
    return total


def _equilibrium(system: System, rates: tuple[sp.Expr, ...], point: Mapping[sp.Symbol, sp.Expr]) -> Verdict:
    claim = f"'{system.name}' rests at its operating point"
    sure = True
    for signal, rate in zip(system.states, rates, strict=True):
        value = rate.subs(dict(point))
        if value.has(sp.zoo, sp.nan, sp.oo):
            return Verdict.refuted(claim, state=signal.name, rate="infinite")
        verdict = is_zero(value)
        if not verdict.holds:
            return Verdict.refuted(claim, state=signal.name, rate=formula(value))
        sure = sure and bool(verdict.status == "proved")
    return Verdict.proved(claim) if sure else Verdict.supported(claim)
