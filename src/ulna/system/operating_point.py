"""The operating point of a system: what the user gave, completed to an equilibrium where one exists."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import sympy as sp

from ulna.base.verdict import Verdict
from ulna.symbolic.exact.zero import is_zero
from ulna.symbolic.formulas.text import formula
from ulna.symbolic.solving.roots import decimal_root, solutions_in_time
from ulna.system.system import System

_SECONDS = 1.0
"""s, for one search of an exact equilibrium."""
_DIGITS = 12
"""Of an equilibrium in decimals."""
_ROUNDING = sp.Rational(1, 1000)
"""How far, relatively, an equilibrium may lie from the values given for the states to count as theirs."""
_LONG = 20
"""Operations above which an exact equilibrium in numbers is given in decimals."""
_LONG_IN_SYMBOLS = 60
"""Operations above which an equilibrium in parameters gives way to one at their values."""


class _TooHardError(Exception):
    """The equations were not solved in time, or by roots that nobody reads."""


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
        try:
            point = candidate()
        except _TooHardError:
            break  # with more unknowns it is no easier
        if point is not None:
            verdict = _equilibrium(system, rates, point)
            if verdict.holds:
                return _point(system, point, verdict)
    if system.values:
        at_values = operating_point(system.with_values())
        if at_values.equilibrium.holds:
            return _point(system, at_values.values, at_values.equilibrium, parameters=dict(system.values))
    point = {**given, **zero_states, **zero_inputs}
    verdict = _equilibrium(system, rates, point)
    if not system.parameters:
        return _in_decimals(system, rates, given, point) or _point(system, point, verdict)
    return _point(system, point, verdict)


def _in_decimals(
    system: System, rates: tuple[sp.Expr, ...], given: Mapping[sp.Symbol, sp.Expr], point: Mapping[sp.Symbol, sp.Expr]
) -> OperatingPoint | None:
    """The equilibrium Newton's method reaches with what was not given, or the given point if one lies within rounding.

    Inputs stay at zero where the states left out suffice. A point in decimals is `supported` only, with its digits.
    """
    claim = f"'{system.name}' rests at its operating point"
    states = [s for s in system.state_symbols if s not in given]
    inputs = [s for s in system.input_symbols if s not in given]
    for unknowns in (states, [*states, *inputs]):
        equations = [e for r in rates if (e := r.xreplace({s: v for s, v in point.items() if s not in unknowns})) != 0]
        if not unknowns or len(equations) > len(unknowns) or any(e.has(sp.nan, sp.zoo, sp.oo) for e in equations):
            continue
        for start in (sp.Integer(0), sp.Rational(1, 3)):
            found = decimal_root(equations, unknowns, dict.fromkeys(unknowns, start), digits=_DIGITS)
            if found is not None:
                verdict = Verdict.supported(claim, method="Newton's method", digits=_DIGITS)
                return _point(system, {**point, **found}, verdict)
    everything = [*system.state_symbols, *inputs]
    if not given or len(rates) > len(everything):
        return None
    known = {s: v for s, v in point.items() if s not in everything}
    held = [r.xreplace(known) for r in rates]
    near = decimal_root(held, everything, {**point, **_least_squares(held, inputs, point)}, digits=_DIGITS)
    if near is None or any(abs(near[s] - point[s]) > _ROUNDING * abs(point[s]) for s in system.state_symbols):
        return None
    verdict = Verdict.supported(claim, reason="an equilibrium lies within the rounding of the values given", at=near)
    return _point(system, {**point, **{u: near[u] for u in inputs}}, verdict)


def _least_squares(
    rates: list[sp.Expr], inputs: list[sp.Symbol], point: Mapping[sp.Symbol, sp.Expr]
) -> dict[sp.Symbol, sp.Expr]:
    """The inputs that leave the least of the rates at the point."""
    if not inputs:
        return {}
    values = {**point, **dict.fromkeys(inputs, sp.Integer(0))}
    slopes = sp.Matrix(rates).jacobian(inputs).xreplace(values).evalf(_DIGITS)
    rest = sp.Matrix(rates).xreplace(values).evalf(_DIGITS)
    square = slopes.T * slopes
    if square.has(sp.nan, sp.zoo, sp.oo) or square.det() == 0:
        return {}
    return dict(zip(inputs, square.LUsolve(-slopes.T * rest), strict=True))


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
    found = solutions_in_time(equations, unknowns, seconds=_SECONDS)
    if found is None:
        raise _TooHardError
    for solution in found:
        free = dict.fromkeys([u for u in unknowns if u not in solution], sp.Integer(0))
        point = {**fixed, **free, **{s: e.subs(free) for s, e in solution.items()}}
        size = _distance(point, system)
        if size is not None and (best is None or size < best[0]):
            best = (size, point)
    if best is None:
        return None
    known = len(system.values) == len(system.parameters)
    most = _LONG_IN_SYMBOLS if system.parameters else _LONG
    if known and any(sp.count_ops(v) > most for v in best[1].values()):
        raise _TooHardError  # roots of cubics and the like read better in decimals
    return best[1]


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
