"""What outputs and inputs obey by themselves, the states eliminated: which functions of the parameters are left.

A state that a derivative of an output contains linearly is expressed by that derivative. When the next derivative
contains no state any more it is an equation between measured quantities; the ratios of its coefficients are all that
the outputs tell of the parameters (L. Ljung and T. Glad, Automatica 30 (1994)). One record shows the coefficients if
the terms are independent along it: the equation with its coefficients as parameters has full rank then.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import sympy as sp

from ulna.base import Verdict
from ulna.identification.structural.experiment import SEED, Motion
from ulna.identification.structural.observed import observed
from ulna.symbolic.exact import attempt, normal, value_at
from ulna.system import NON_SMOOTH, Parameter, Signal, System

_MOST_OPERATIONS = 800
_MOST_COEFFICIENTS = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class InputOutput:
    """The input-output equations of a plant.

    Attributes:
        functions: of the parameters, which determine these equations and are determined by them.
        complete: whether every state has been expressed by outputs, so that nothing else of the parameters shows.
        one_record: on "one record with an input that changes shows all the functions".
    """

    functions: tuple[sp.Expr, ...]
    complete: bool
    one_record: Verdict


class _StuckError(Exception):
    """A state that cannot be expressed, or an equation too long."""


def input_output(system: System, free: Sequence[str], *, seconds: float) -> InputOutput | None:
    """The functions of the unknown parameters in the input-output equations; None where these are not found.

    Args:
        system: a smooth plant in continuous time, known parameters put in.
        free: names of the unknown parameters.
        seconds: s of CPU time.
    """
    return attempt(seconds, "input-output equations", _found, system, tuple(free)).value


def _found(system: System, free: tuple[str, ...]) -> InputOutput | None:
    if any(e.has(*NON_SMOOTH) for e in (*system.rates, *system.readouts)):
        return None
    unknown = {sp.Symbol(name, real=True) for name in free}
    elimination = _Elimination(system)
    try:
        elimination.run()
        tables = [_coefficients(e, unknown) for e in elimination.equations]
    except _StuckError:
        return None
    functions: list[sp.Expr] = []
    for _, ratios in tables:
        functions += [r for r in ratios if r.free_symbols and r not in functions]
    if len(functions) > _MOST_COEFFICIENTS:
        return None
    return InputOutput(
        functions=tuple(functions),
        complete=not elimination.rest,
        one_record=_one_record(system, elimination, tables, unknown),
    )


class _Elimination:
    """The states expressed by outputs and their derivatives, as far as this goes.

    Attributes:
        rest: states not expressed. equations: (p,) what the highest derivative of each output equals.
        chains: for each output the symbols of itself and its lower derivatives. jets: derivatives of inputs by symbol.
    """

    def __init__(self, system: System) -> None:
        self.rates = dict(zip(system.state_symbols, system.inline(system.rates), strict=True))
        self.rest = list(system.state_symbols)
        self.equations = list(system.inline(system.readouts))
        self.chains: list[list[sp.Symbol]] = [[] for _ in self.equations]
        self.jets = {u: sp.Symbol(f"{u.name}_1", real=True) for u in system.input_symbols}

    def run(self) -> None:
        """Go on until no equation contains a state.

        Raises:
            _StuckError: where no state can be expressed by the next derivative of any output.
        """
        while any(e.free_symbols & set(self.rest) for e in self.equations):
            # In turn: what one output shows at once need not be got from high derivatives of another.
            expressed = [self._step(k) for k in range(len(self.equations))]
            if True not in expressed:
                raise _StuckError

    def _step(self, k: int) -> bool:
        """Express a state by the newest derivative of an output, if one is in it linearly."""
        equation = self.equations[k]
        told = sp.Symbol(f"y{k + 1}_{len(self.chains[k])}", real=True)
        above, below = sp.fraction(sp.together(equation))
        zero = sp.expand(above - told * below)
        for state in sorted(equation.free_symbols & set(self.rest), key=self.rest.index):
            slope = sp.diff(zero, state)
            if slope.has(state) or slope == 0:
                continue
            meaning = normal(-zero.xreplace({state: sp.S.Zero}) / slope)
            changed = self._derivative(equation)
            self.rest.remove(state)
            del self.rates[state]
            self.rates = {s: self._put(e, state, meaning) for s, e in self.rates.items()}
            self.equations = [self._put(e, state, meaning) for e in self.equations]
            self.equations[k] = self._put(changed, state, meaning)
            for j, chain in enumerate(self.chains):
                if chain:
                    self.rates[chain[-1]] = self.equations[j]
            if self.chains[k]:
                self.rates[self.chains[k][-1]] = told
            self.chains[k].append(told)
            self.rates[told] = self.equations[k]
            return True
        return False

    def _derivative(self, expression: sp.Expr) -> sp.Expr:
        total = sp.S.Zero
        for symbol in sorted(expression.free_symbols, key=lambda s: s.name):
            if symbol in self.jets and self.jets[symbol] not in self.jets:
                stem, _, number = self.jets[symbol].name.rpartition("_")
                self.jets[self.jets[symbol]] = sp.Symbol(f"{stem}_{int(number) + 1}", real=True)
            speed = self.rates.get(symbol, self.jets.get(symbol, sp.S.Zero))
            total += expression.diff(symbol) * speed
        return total

    def _put(self, expression: sp.Expr, state: sp.Symbol, meaning: sp.Expr) -> sp.Expr:
        if not expression.has(state):
            return expression
        whole = expression.xreplace({state: meaning})
        if whole.count_ops() > _MOST_OPERATIONS:
            raise _StuckError
        return normal(whole)


Table = tuple[tuple[sp.Expr, ...], tuple[sp.Expr, ...]]
"""Terms of Σ ratio · term = 0 in measured quantities (`_HIGHEST` the derivative it is solved for), and the ratios."""
_HIGHEST = sp.Symbol("highest_derivative", real=True)


def _coefficients(equation: sp.Expr, unknown: set[sp.Symbol]) -> Table:
    above, below = sp.fraction(sp.together(equation))
    whole = sp.expand(above - _HIGHEST * below)
    generators = sorted(_generators(whole, unknown), key=str)
    terms = sp.Poly(whole, *generators).terms()
    if any(c.free_symbols - unknown for _, c in terms):
        raise _StuckError
    least = min((c for _, c in terms), key=lambda c: (c.count_ops(), str(c)))
    monomials = [sp.Mul(*(g**n for g, n in zip(generators, powers, strict=True))) for powers, _ in terms]
    return tuple(monomials), tuple(normal(c / least) for _, c in terms)


def _generators(expression: sp.Expr, unknown: set[sp.Symbol]) -> set[sp.Expr]:
    """Symbols that are measured, and functions of such."""
    if expression.free_symbols <= unknown:
        return set()
    if (
        expression.is_Add
        or expression.is_Mul
        or (expression.is_Pow and expression.exp.is_Integer and expression.exp > 0)
    ):
        return set().union(*(_generators(part, unknown) for part in expression.args))
    if expression.free_symbols & unknown:
        raise _StuckError
    return {expression}


def _one_record(system: System, elimination: _Elimination, tables: Sequence[Table], unknown: set[sp.Symbol]) -> Verdict:
    """Whether the terms of the equations are independent along a record, at random parameters."""
    claim = "one record with an input that changes shows all coefficients"
    generator = np.random.default_rng(SEED)
    drawn = {s: sp.Rational(int(generator.integers(13, 97)), 64) for s in sorted(unknown, key=lambda s: s.name)}
    values: dict[str, sp.Expr] = {}
    rates: dict[sp.Symbol, sp.Expr] = {}
    readouts: list[sp.Expr] = []
    for (terms, ratios), chain in zip(tables, elimination.chains, strict=True):
        whole: sp.Expr = sp.S.Zero
        for term, ratio in zip(terms, ratios, strict=True):
            number = value_at(ratio, drawn)
            if number is None:
                return Verdict.undecided(claim, tried="a random set of parameters")
            if ratio.free_symbols:
                name = f"coefficient_{len(values) + 1}"
                values[name] = number
                whole += sp.Symbol(name, real=True) * term
            else:
                whole += number * term
        told = -whole.xreplace({_HIGHEST: sp.S.Zero}) / sp.diff(whole, _HIGHEST)
        rates |= dict(pairwise([*chain, told]))
        readouts.append(chain[0] if chain else told)
    if len(values) > _MOST_COEFFICIENTS or not values:
        return Verdict.undecided(claim, coefficients=len(values))
    return _independent(claim, system, elimination.jets, rates, readouts, values)


def _independent(
    claim: str,
    system: System,
    derivatives: Mapping[sp.Symbol, sp.Symbol],
    rates: Mapping[sp.Symbol, sp.Expr],
    readouts: Sequence[sp.Expr],
    values: Mapping[str, sp.Expr],
) -> Verdict:
    jets, last = {}, []
    for u in system.input_symbols:
        symbol, row = u, []
        while symbol in derivatives:
            row.append(symbol)
            symbol = derivatives[symbol]
        jets |= dict(zip(row, [*row[1:], symbol], strict=True))
        last.append(symbol)
    equation = System(
        name=f"input-output equation of '{system.name}'",
        states=tuple(Signal(name=s.name) for s in (*rates, *jets)),
        rates=(*rates.values(), *jets.values()),
        inputs=tuple(Signal(name=s.name) for s in last),
        outputs=tuple(Signal(name=f"output_{k + 1}") for k in range(len(readouts))),
        readouts=tuple(readouts),
        parameters=tuple(Parameter(name=name, value=value) for name, value in values.items()),
    )
    seen = observed(equation, list(values), Motion.CHANGING, known=[s.name for s in jets], parameters=dict(values))
    if seen.rank == seen.unknowns:
        return Verdict.proved(claim, rank=seen.rank, coefficients=len(values))
    return Verdict.undecided(claim, rank=seen.rank, unknowns=seen.unknowns)
