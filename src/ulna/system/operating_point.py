"""The operating point of a system: what its file gives, completed to an equilibrium where one exists."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache

import numpy as np
import sympy as sp

from ulna.base import FormulaError, Status, Verdict
from ulna.symbolic.exact import SampledZero, ZeroTest, attempt, is_zero
from ulna.symbolic.formulas import formula, put_in
from ulna.symbolic.solving import limit_at, solutions_in_time
from ulna.system.equilibrium_point import Equilibrium
from ulna.system.linear_reduction import reduced
from ulna.system.many_starts import inside, reached_points
from ulna.system.signal import Signal, to_si
from ulna.system.system import System
from ulna.system.zeros import decimal_root

_TEST = SampledZero()
AS_GIVEN, SOLVED, NEWTON = "as given", "solved exactly", "Newton's method"
"""How an equilibrium was found, in the evidence of its verdict."""
_SECONDS = 1.0
"""s, for one search of an exact equilibrium."""
_IN_NUMBERS_SECONDS = 4.0
"""s, for the whole search with numbers for every parameter."""
_ROUNDING = sp.Rational(1, 1000)
"""How far, relatively, an equilibrium may lie from the values given for the states to count as theirs."""
_TRIED = 4
"""Points reached by Newton's method, nearest first, that are looked at closely."""
_LONG = 20
"""Operations above which an exact equilibrium in numbers is given in decimals."""
_LONG_IN_SYMBOLS = 60
"""Operations above which an equilibrium in parameters gives way to one at their values."""


class TooHardError(Exception):
    """The equations were not solved in time, or by roots that nobody reads."""


@lru_cache(maxsize=64)
def operating_point(system: System) -> Equilibrium:
    """The given operating point, the rest solved for.

    What the user left out is sought in this order: at zero; as an equilibrium with inputs at zero; as any
    equilibrium. Zero stands for the nearest value in the declared range. Of several equilibria it is the one nearest to
    that inside all declared ranges of states and inputs ([equilibria] lists all); one outside does not count, and where
    there is no other the refusal names it (`outside`). Numbers given for states often fit the parameters' values only:
    where symbols leave no equilibrium the parameters are put at their values. Where none is found the states left out
    are zero and the verdict is refuted.
    """
    given = given_values(system)
    rates = system.inline(system.balances)
    rest_states = [s for s in system.state_symbols if s not in given]
    rest_inputs = [s for s in system.input_symbols if s not in given]
    start = nearest_to_zero(system)
    zero_inputs, zero_states = ({s: start[s] for s in rest} for rest in (rest_inputs, rest_states))
    at_zero = {**given, **zero_states, **zero_inputs}
    candidates = (
        lambda: _solved(rates, {**given, **zero_states}, rest_inputs, system),
        lambda: _solved(rates, {**given, **zero_inputs}, rest_states, system) if rest_states else None,
        lambda: _solved(rates, given, [*rest_states, *rest_inputs], system) if rest_states and rest_inputs else None,
    )
    for candidate in candidates:
        try:
            point = candidate()
        except TooHardError:
            break  # with more unknowns it is no easier
        if point is not None:
            verdict = rests(system, rates, point, _claim(system), method=AS_GIVEN if point == at_zero else SOLVED)
            simpler = (
                verdict.holds and candidate is candidates[2] and _inputs_at_zero(system, rates, at_zero, zero_inputs)
            )
            if simpler:
                return _point(system, simpler.values, simpler.verdict, parameters=dict(system.values))
            if verdict.holds:
                return _point(system, point, verdict)
    if system.values:
        at_values = operating_point(system.with_values())
        if at_values.verdict.holds:
            return _point(system, at_values.values, at_values.verdict, parameters=dict(system.values))
    if not system.parameters and (found := _in_decimals(system, rates, given, at_zero)) is not None:
        return found
    verdict = rests(system, rates, at_zero, _claim(system))
    if any(s.lower is not None or s.upper is not None for s in (*system.states, *system.inputs)):
        everywhere = operating_point(_without_ranges(system))
        if everywhere.verdict.holds:
            outside = {s.name: everywhere.values[s.symbol] for s in (*system.states, *system.inputs)}
            reason = "an equilibrium lies outside the declared ranges"
            verdict = Verdict.refuted(_claim(system), **{**verdict.evidence, "reason": reason, "outside": outside})
    return _point(system, at_zero, verdict)


def _inputs_at_zero(
    system: System,
    rates: tuple[sp.Expr, ...],
    point: Mapping[sp.Symbol, sp.Expr],
    zero_inputs: Mapping[sp.Symbol, sp.Expr],
) -> Equilibrium | None:
    """The point in decimals with the inputs left out at zero, which no formula writes down: a reactor at rest, say."""
    at_values = operating_point(system.with_values()) if system.values else None
    found = at_values or (None if system.parameters else _in_decimals(system, rates, given_values(system), point))
    if found is None or not found.verdict.holds or any(found.inputs[u] != zero_inputs[u] for u in zero_inputs):
        return None
    return found


def nearest_to_zero(system: System) -> dict[sp.Symbol, sp.Expr]:
    """For states and inputs the number in the declared range that is nearest to zero."""
    numbers = {}
    for signal in (*system.states, *system.inputs):
        lower, upper = signal.lower, signal.upper
        above, below = lower is not None and lower > 0, upper is not None and upper < 0
        numbers[signal.symbol] = (lower if above else upper if below else None) or sp.Integer(0)
    return numbers


def in_ranges(system: System, point: Mapping[sp.Symbol, sp.Expr], numbers: Mapping[sp.Symbol, sp.Expr]) -> bool:
    """Whether states and inputs of a point lie in their declared ranges, parameters at `numbers`."""
    signals = [s for s in (*system.states, *system.inputs) if s.symbol in point]
    return all(inside(put_in(point[s.symbol], numbers), (s.lower, s.upper)) for s in signals)


def _without_ranges(system: System) -> System:
    def wide(signals: tuple[Signal, ...]) -> tuple[Signal, ...]:
        return tuple(replace(s, lower=None, upper=None) for s in signals)

    return replace(system, states=wide(system.states), inputs=wide(system.inputs))


@lru_cache(maxsize=64)
def equilibrium_in_numbers(system: System) -> Equilibrium:
    """The operating point with a number for every parameter.

    A parameter without a value stands at an arbitrary positive rational number within its bounds, so that nothing
    vanishes there by accident. Where the search takes too long the point is the given one, and undecided.
    """
    numbers = stand_ins(system)
    found = attempt(_IN_NUMBERS_SECONDS, "operating point", operating_point, system.with_values())
    point = found.value or given_point(system, tried=found.reason)
    return Equilibrium(
        system=system,
        states={s: v.xreplace(numbers) for s, v in point.states.items()},
        inputs={s: v.xreplace(numbers) for s, v in point.inputs.items()},
        verdict=point.verdict,
        parameters=numbers,
    )


def given_point(system: System, *, tried: str = "not asked for a large plant") -> Equilibrium:
    """The given operating point, zeros where nothing is given; whether it is an equilibrium is not asked."""
    point = {**dict.fromkeys((*system.state_symbols, *system.input_symbols), sp.Integer(0)), **given_values(system)}
    return _point(system, point, Verdict.undecided(_claim(system), reason=tried))


def starting_point(system: System) -> Equilibrium:
    """Where a run starts unless told otherwise: at rest as the operating point asks, else as given, else at zero.

    A file without an operating point asks for none, and one that gives every state leaves nothing to be found.
    """
    given = {name for name, _ in system.operating_point}
    if given and not given.issuperset(s.name for s in system.states):
        found = equilibrium_in_numbers(system)
        if found.verdict.holds:
            return found
    return given_point(system)


def given_values(system: System) -> dict[sp.Symbol, sp.Expr]:
    """What the file gives for states and inputs, by symbol."""
    return {sp.Symbol(name, real=True): value for name, value in system.operating_point}


def stand_ins(system: System) -> dict[sp.Symbol, sp.Expr]:
    """A number for every parameter: its value, or a rational number within its bounds."""
    numbers = {}
    for position, parameter in enumerate(system.parameters):
        value = parameter.si_value
        if value is None:
            value = to_si(_stand_in(position, parameter.lower, parameter.upper), parameter.unit)
        numbers[parameter.symbol] = value
    return numbers


def known_signs(system: System) -> dict[sp.Symbol, sp.Symbol]:
    """For parameters without a value but with a bound of one sign a symbol that knows it."""
    signs = {}
    for parameter in system.parameters:
        if parameter.value is None and parameter.lower is not None and parameter.lower >= 0:
            signs[parameter.symbol] = sp.Symbol(parameter.name, positive=True)
        elif parameter.value is None and parameter.upper is not None and parameter.upper <= 0:
            signs[parameter.symbol] = sp.Symbol(parameter.name, negative=True)
    return signs


def nearest_solution(
    equations: Sequence[sp.Expr],
    unknowns: Sequence[sp.Symbol],
    start: Mapping[sp.Symbol, sp.Expr],
    numbers: Mapping[sp.Symbol, sp.Expr],
    counts: Callable[[Mapping[sp.Symbol, sp.Expr]], bool] = lambda _: True,
) -> dict[sp.Symbol, sp.Expr] | None:
    """The exact real solution nearest to a point; unknowns that stay free keep their values there. None without one.

    Of two that lie equally near, as currents of either sign whose square pulls, it is the one whose values are larger.

    Args:
        equations, unknowns: what is solved for what.
        start: value by unknown.
        numbers: for every other symbol, at which distances are measured.
        counts: whether a solution may be taken.

    Raises:
        TooHardError: where the time runs out.
    """
    found = solutions_in_time(equations, unknowns, seconds=_SECONDS)
    if found is None:
        raise TooHardError
    best: tuple[float, float, dict[sp.Symbol, sp.Expr]] | None = None
    for solution in found:
        free = {u: start[u] for u in unknowns if u not in solution}
        point = {u: free[u] if u in free else solution[u].subs(free) for u in unknowns}
        away = _away(point, start, numbers)
        if away is not None and (best is None or _nearer(away, best[:2])) and counts(point):
            best = (*away, point)
    return None if best is None else best[2]


def _nearer(away: tuple[float, float], best: tuple[float, float]) -> bool:
    alike = abs(away[0] - best[0]) <= 1e-9 * max(away[0], best[0])
    return away[1] > best[1] if alike else away[0] < best[0]


def _away(
    point: Mapping[sp.Symbol, sp.Expr], start: Mapping[sp.Symbol, sp.Expr], numbers: Mapping[sp.Symbol, sp.Expr]
) -> tuple[float, float] | None:
    """How far two points lie apart in numbers, and the sum of the differences; None if one is not real."""
    total = upwards = 0.0
    for symbol, value in point.items():
        number = complex(sp.N(put_in(value - start[symbol], numbers)))
        if abs(number.imag) > 1e-12 or number != number:  # noqa: PLR0124  (NaN differs from itself)
            return None
        total, upwards = total + abs(number.real), upwards + number.real
    return total, upwards


def _solved(
    rates: tuple[sp.Expr, ...], fixed: Mapping[sp.Symbol, sp.Expr], unknowns: list[sp.Symbol], system: System
) -> dict[sp.Symbol, sp.Expr] | None:
    """`fixed` with values in range for the unknowns that make every rate zero; free ones are set to zero."""
    equations = [e for r in rates if (e := limit_at(r, fixed)) != 0]
    if any(e.has(sp.zoo, sp.nan, sp.oo) for e in equations):
        return None
    start, numbers = nearest_to_zero(system), stand_ins(system)
    zeros = {u: start[u] for u in unknowns}
    if not unknowns or not equations:
        return {**fixed, **zeros}
    if any(not e.free_symbols & set(unknowns) and is_zero(e).fails for e in equations):
        return None
    found = nearest_solution(equations, unknowns, zeros, numbers, lambda point: in_ranges(system, point, numbers))
    if found is None:
        return None
    known = len(system.values) == len(system.parameters)
    most = _LONG_IN_SYMBOLS if system.parameters else _LONG
    if known and any(sp.count_ops(v) > most for v in found.values()):
        raise TooHardError  # roots of cubics and the like read better in decimals
    return {**fixed, **found}


def _in_decimals(
    system: System, rates: tuple[sp.Expr, ...], given: Mapping[sp.Symbol, sp.Expr], point: Mapping[sp.Symbol, sp.Expr]
) -> Equilibrium | None:
    """The equilibrium Newton's method reaches with what was not given, or the given point if one lies within rounding.

    Inputs stay at zero where the states left out suffice. A point in decimals is `supported` only, with its digits.
    """
    signals = (*system.states, *system.inputs)
    states = [s for s in system.state_symbols if s not in given]
    inputs = [s for s in system.input_symbols if s not in given]
    for unknowns in (states, [*states, *inputs]):
        equations = [e for r in rates if (e := put_in(r, {s: v for s, v in point.items() if s not in unknowns})) != 0]
        if not unknowns or len(equations) > len(unknowns) or any(e.has(sp.nan, sp.zoo, sp.oo) for e in equations):
            continue
        ranges = {signal.symbol: (signal.lower, signal.upper) for signal in signals}
        for near in _reached(equations, unknowns, point, ranges)[:_TRIED]:
            found = _root(equations, unknowns, near)
            if found is not None and in_ranges(system, found[0], {}):
                verdict = Verdict.supported(_claim(system), method=NEWTON, digits=found[1])
                return _point(system, {**point, **found[0]}, verdict)
    everything = [*system.state_symbols, *inputs]
    if not given or len(rates) > len(everything):
        return None
    known = {s: v for s, v in point.items() if s not in everything}
    held = [put_in(r, known) for r in rates]
    found = _root(held, everything, {**point, **_least_squares(held, inputs, point)})
    if found is None or any(abs(found[0][s] - point[s]) > _ROUNDING * abs(point[s]) for s in system.state_symbols):
        return None
    reason = "an equilibrium lies within the rounding of the values given"
    verdict = Verdict.supported(_claim(system), reason=reason, at=found[0], digits=found[1])
    return _point(system, {**point, **{u: found[0][u] for u in inputs}}, verdict)


def _reached(
    equations: list[sp.Expr],
    unknowns: list[sp.Symbol],
    point: Mapping[sp.Symbol, sp.Expr],
    ranges: Mapping[sp.Symbol, tuple[sp.Expr | None, sp.Expr | None]],
) -> list[dict[sp.Symbol, sp.Expr]]:
    """What Newton's method reaches from many starts, nearest to the point first."""
    left, rest = equations, dict[sp.Symbol, sp.Expr]()
    if len(equations) == len(unknowns):
        left, rest = attempt(_SECONDS, "elimination", reduced, equations, unknowns, {}).value or (left, rest)
    sought = [u for u in unknowns if u not in rest]
    start = np.array([float(point[u]) for u in sought])
    reached = (
        reached_points(left, sought, start, [ranges[u] for u in sought]) if sought else np.zeros((int(not left), 0))
    )
    places = [dict(zip(sought, map(sp.Float, p), strict=True)) for p in reached]
    whole = [place | {u: sp.N(put_in(e, place)) for u, e in rest.items()} for place in places]
    whole = [p for p in whole if all(v.is_real and v.is_finite for v in p.values())]
    return sorted(whole, key=lambda p: sum(abs(float(p[u] - point[u])) for u in unknowns))


def _root(
    equations: list[sp.Expr], unknowns: list[sp.Symbol], start: Mapping[sp.Symbol, sp.Expr]
) -> tuple[dict[sp.Symbol, sp.Expr], int] | None:
    with suppress(FormulaError):  # a function without a value in numbers
        return attempt(_SECONDS, "Newton", decimal_root, equations, unknowns, start).value
    return None


def _least_squares(
    rates: list[sp.Expr], inputs: list[sp.Symbol], point: Mapping[sp.Symbol, sp.Expr]
) -> dict[sp.Symbol, sp.Expr]:
    """The inputs that leave the least of the rates at the point."""
    if not inputs:
        return {}
    values = {**point, **dict.fromkeys(inputs, sp.Integer(0))}
    slopes = sp.Matrix(rates).jacobian(inputs).xreplace(values).evalf()
    rest = sp.Matrix(rates).xreplace(values).evalf()
    square = slopes.T * slopes
    if square.has(sp.nan, sp.zoo, sp.oo) or square.det() == 0:
        return {}
    return dict(zip(inputs, square.LUsolve(-slopes.T * rest), strict=True))


def rests(
    system: System,
    rates: Sequence[sp.Expr],
    point: Mapping[sp.Symbol, sp.Expr],
    claim: str,
    *,
    method: str = "",
    test: ZeroTest = _TEST,
) -> Verdict:
    """Whether every rate is zero at a point; refuted with the first that is not."""
    sure = True
    for signal, rate in zip(system.states, rates, strict=True):
        value = limit_at(rate, point)
        if value.has(sp.zoo, sp.nan, sp.oo):
            return Verdict.refuted(claim, state=signal.name, rate="infinite")
        verdict = is_zero(value, test=test)
        if not verdict.holds:
            return Verdict.refuted(claim, state=signal.name, rate=formula(value))
        sure = sure and verdict.status is Status.PROVED
    return (Verdict.proved if sure else Verdict.supported)(claim, method=method)


def _claim(system: System) -> str:
    return f"'{system.name}' rests at its operating point"


def _point(
    system: System,
    point: Mapping[sp.Symbol, sp.Expr],
    verdict: Verdict,
    parameters: Mapping[sp.Symbol, sp.Expr] | None = None,
) -> Equilibrium:
    return Equilibrium(
        system=system,
        states={s: point[s] for s in system.state_symbols},
        inputs={s: point[s] for s in system.input_symbols},
        verdict=verdict,
        parameters=parameters or {},
    )


def _stand_in(position: int, lower: sp.Expr | None, upper: sp.Expr | None) -> sp.Expr:
    value = sp.Rational(7 + 2 * position, 5) + sp.Rational(1, 13 + position)
    if lower is not None and upper is not None:
        return lower + (upper - lower) * sp.Rational(5, 12)
    if lower is not None and value <= lower:
        return lower + value
    if upper is not None and value >= upper:
        return upper - value
    return value
