"""`System`: the one type for plants, observers, compensators and closed loops."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import sympy as sp

from ulna.base import PlantError
from ulna.symbolic.formulas import RESERVED, check_power, exact, listing, without_value
from ulna.symbolic.solving import solve_affine
from ulna.system.picture import Picture
from ulna.system.signal import Definition, Parameter, Signal, from_si
from ulna.system.sizes import check_size


@dataclass(frozen=True, slots=True, kw_only=True, weakref_slot=True)
class System:
    """A system x' = F(x, u, p), y = H(x, u, p), or with a period x⁺ = F(x, u, p); in real symbols, exactly.

    Attributes:
        name: what errors and tables call it.
        states: (n,) signals, in order; none for a static map such as a feedback law.
        rates: (n,) right-hand sides: the derivative of each state; in discrete time its value one period later.
        inputs: (m,) signals; empty for an autonomous system.
        outputs: (p,) signals; a state may be an output under its own name.
        readouts: (p,) expressions, what each output measures.
        parameters: constants, symbolic until `with_values`.
        definitions: abbreviations in order of dependency, unknowns of linear equations among them; `inline` puts
            them in.
        operating_point: exact SI values given for some states and inputs; `equilibrium.operating_point` completes it.
        period: None in continuous time; else s, exact, from one value of the states to the next.
        correlations: (parameter, parameter, number) of values that are uncertain together.
        text: a line on what the system is; source: where it comes from.
        picture: how it is drawn; None where nothing is said.

    Raises:
        PlantError: for duplicate or reserved names, counts that differ, and undeclared symbols.

    Examples:
        >>> plant = ulna.model("duffing")
        >>> plant.rates
        (x2, -a*x1 - b*x1**3 - d*x2 + u)
        >>> plant.with_values().rates
        (x2, u - x1**3 - x1 - x2/10)
    """

    name: str
    states: tuple[Signal, ...]
    rates: tuple[sp.Expr, ...]
    inputs: tuple[Signal, ...] = ()
    outputs: tuple[Signal, ...] = ()
    readouts: tuple[sp.Expr, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    definitions: tuple[Definition, ...] = ()
    operating_point: tuple[tuple[str, sp.Expr], ...] = ()
    period: sp.Expr | None = None
    correlations: tuple[tuple[str, str, sp.Expr], ...] = ()
    text: str = ""
    source: str = ""
    picture: Picture | None = None

    def __post_init__(self) -> None:
        _check_period(self)
        _check_counts(self)
        _check_names(self)
        _check_symbols(self)
        rows = zip((*self.states, *self.outputs), (*self.rates, *self.readouts), strict=True)
        check_size(self.name, self.definitions, {signal.name: expression for signal, expression in rows})

    @property
    def discrete(self) -> bool:
        """Whether time passes in steps of a period."""
        return self.period is not None

    @property
    def balances(self) -> tuple[sp.Expr, ...]:
        """(n,) what vanishes at rest: the rates; in discrete time what each state changes by in a period."""
        if not self.discrete:
            return self.rates
        return tuple(rate - s for rate, s in zip(self.rates, self.state_symbols, strict=True))

    @property
    def time_text(self) -> str:
        """How its time passes, in words."""
        return "continuous time" if self.period is None else f"steps of {float(self.period):g} s"

    @property
    def state_symbols(self) -> tuple[sp.Symbol, ...]:
        """(n,) symbols of the states."""
        return tuple(s.symbol for s in self.states)

    @property
    def input_symbols(self) -> tuple[sp.Symbol, ...]:
        """(m,) symbols of the inputs."""
        return tuple(s.symbol for s in self.inputs)

    @property
    def parameter_symbols(self) -> tuple[sp.Symbol, ...]:
        """Symbols of the parameters."""
        return tuple(p.symbol for p in self.parameters)

    @property
    def unknowns(self) -> tuple[Definition, ...]:
        """The implicit definitions."""
        return tuple(d for d in self.definitions if d.implicit)

    @property
    def values(self) -> dict[sp.Symbol, sp.Expr]:
        """Exact SI values of the parameters that have one."""
        return {p.symbol: v for p in self.parameters if (v := p.si_value) is not None}

    def inline(self, expressions: Iterable[sp.Expr]) -> tuple[sp.Expr, ...]:
        """The expressions with every definition put in."""
        if not self.definitions:
            return tuple(expressions)
        inlined = self._meanings()
        return tuple(_with(e, inlined, self.name) for e in expressions)

    def _meanings(self) -> dict[sp.Symbol, sp.Expr]:
        """What every definition stands for, in states, inputs and parameters."""
        inlined: dict[sp.Symbol, sp.Expr] = {}
        for definition in self.definitions:
            if not definition.implicit:
                inlined[definition.symbol] = _with(definition.expression, inlined, self.name)
        unknowns = self.unknowns
        if not unknowns:
            return inlined
        equations = [_with(d.expression, inlined, self.name) for d in unknowns]
        found = solve_affine(equations, [d.symbol for d in unknowns], where=f"'{self.name}'")
        return {**{symbol: e.xreplace(found) for symbol, e in inlined.items()}, **found}

    def with_values(self, values: Mapping[str, Any] | None = None) -> System:
        """The same system with numbers in place of parameters.

        Args:
            values: SI numbers by parameter name; left out, every parameter that has a value takes it.

        Raises:
            PlantError: for a name that is no parameter or a value that breaks a right-hand side (division by zero).
        """
        if values is None:
            numbers = self.values
        else:
            numbers = {self._parameter(name).symbol: exact(value) for name, value in values.items()}
        fixed = {symbol.name for symbol in numbers}
        rates, readouts = (_in_numbers(self.inline(e), numbers, self.name) for e in (self.rates, self.readouts))
        for name, expression in zip((*self.states, *self.outputs), (*rates, *readouts), strict=True):
            if found := without_value(expression):
                zeros = [s.name for s, v in numbers.items() if v == 0]
                raise PlantError(
                    f"'{self.name}' with its parameter values",
                    f"the formula of '{name.name}' {found}"
                    + (f" (zero parameters: {', '.join(zeros)})." if zeros else "."),
                    "Give the parameters values that keep it finite and real.",
                )
        return replace(
            self,
            rates=rates,
            readouts=readouts,
            definitions=(),
            parameters=tuple(p for p in self.parameters if p.name not in fixed),
            picture=self.picture and self.picture.with_values({s.name: float(v) for s, v in numbers.items()}),
        )

    def with_parameters(self, values: Mapping[str, Any]) -> System:
        """The same system, its parameters kept symbolic but holding other SI values, whose uncertainty is not told."""
        for name in values:
            self._parameter(name)
        return replace(
            self,
            parameters=tuple(
                replace(p, value=from_si(exact(values[p.name]), p.unit), std=None) if p.name in values else p
                for p in self.parameters
            ),
        )

    def _parameter(self, name: str) -> Parameter:
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        known = ", ".join(p.name for p in self.parameters) or "none"
        raise PlantError(f"parameter '{name}' of '{self.name}'", "there is no such parameter.", f"Known: {known}.")

    def __repr__(self) -> str:
        rows = [(d.name, d.expression) for d in self.definitions if not d.implicit]
        rows += [("0", d.expression) for d in self.unknowns]
        rows += [
            (f"{s.name}{'+' if self.discrete else chr(39)}", rate)
            for s, rate in zip(self.states, self.rates, strict=True)
        ]
        told = {name for name, _ in rows} | {s.name for s in self.states}
        rows += [(o.name, e) for o, e in zip(self.outputs, self.readouts, strict=True) if o.name not in told]
        inputs = f", inputs {', '.join(u.name for u in self.inputs)}" if self.inputs else ""
        period = f", period {float(self.period):g} s" if self.period is not None else ""
        return listing(f"System '{self.name}'{inputs}{period}", rows)

    def _repr_latex_(self) -> str:
        from ulna.system.equations import system_latex

        return system_latex(self)


def _in_numbers(expressions: Iterable[sp.Expr], numbers: Mapping[sp.Symbol, sp.Expr], name: str) -> tuple[sp.Expr, ...]:
    """The expressions with numbers put in, every power of a parameter sized before it is computed."""
    found = []
    for expression in expressions:
        powers = [p for p in expression.atoms(sp.Pow) if not p.exp.is_number and p.exp.free_symbols <= numbers.keys()]
        for power in sorted(powers, key=sp.Expr.count_ops):
            check_power(
                power.base.xreplace(numbers), power.exp.xreplace(numbers), f"'{name}' with its parameter values"
            )
        found.append(_with(expression, numbers, name))
    return tuple(found)


def _with(expression: sp.Expr, meaning: Mapping[sp.Symbol, sp.Expr], name: str) -> sp.Expr:
    """The expression with meanings put in.

    Raises:
        PlantError: a comparison, minimum or maximum of what is infinite or complex, for which SymPy has no value.
    """
    try:
        return expression.xreplace(meaning)
    except (TypeError, ValueError):
        raise PlantError(
            f"'{name}' with its definitions and values put in",
            "a comparison, minimum or maximum meets a term that is infinite or not real.",
            "Look for a division by zero in the definitions.",
        ) from None


def _check_period(system: System) -> None:
    period = system.period
    if period is not None and not (period.is_number and period.is_finite and period.is_positive):
        found = f"{period} is not a positive time in s."
        raise PlantError(f"period of '{system.name}'", found, "Write period = 0.001, say.")


def _check_counts(system: System) -> None:
    for what, left, right in (
        ("states and rates", system.states, system.rates),
        ("outputs and readouts", system.outputs, system.readouts),
    ):
        if len(left) != len(right):
            raise PlantError(f"system '{system.name}'", f"the numbers of {what} differ: {len(left)} and {len(right)}.")


def _check_names(system: System) -> None:
    kinds: dict[str, str] = {}
    rows = (
        ("state", system.states),
        ("input", system.inputs),
        ("parameter", system.parameters),
        ("definition", system.definitions),
    )
    for kind, row in rows:
        for item in row:
            if not item.name.isidentifier():
                raise PlantError(
                    f"{kind} '{item.name}' of '{system.name}'", "this is not a valid name.", "Use letters, digits, _."
                )
            if item.name in RESERVED:
                raise PlantError(f"{kind} '{item.name}' of '{system.name}'", "the name is a function or constant.")
            if item.name == "time":
                found = "results have an axis of this name."
                raise PlantError(f"{kind} '{item.name}' of '{system.name}'", found, "Call it clock, say.")
            if item.name in kinds:
                raise PlantError(
                    f"{kind} '{item.name}' of '{system.name}'",
                    f"the name is taken by a {kinds[item.name]} already.",
                    "Rename one of them.",
                )
            kinds[item.name] = kind
    names = [o.name for o in system.outputs]
    for name in names:
        if names.count(name) > 1:
            raise PlantError(
                f"output '{name}' of '{system.name}'", "two outputs have this name.", "Rename one of them."
            )


def _check_symbols(system: System) -> None:
    declared = {*system.state_symbols, *system.input_symbols, *system.parameter_symbols}
    declared |= {d.symbol for d in system.unknowns}
    for definition in sorted(system.definitions, key=lambda d: d.implicit):
        _check_declared(system, f"definition '{definition.name}'", definition.expression, declared)
        declared.add(definition.symbol)
    for signal, expression in zip((*system.states, *system.outputs), (*system.rates, *system.readouts), strict=True):
        _check_declared(system, f"formula of '{signal.name}'", expression, declared)
    known = {s.name for s in (*system.states, *system.inputs)}
    for name, _ in system.operating_point:
        if name not in known:
            raise PlantError(
                f"operating point of '{system.name}'",
                f"'{name}' is neither a state nor an input.",
                f"Known: {', '.join(sorted(known))}.",
            )


def _check_declared(system: System, where: str, expression: sp.Expr, declared: set[sp.Symbol]) -> None:
    unknown = sorted(s.name for s in expression.free_symbols - declared)
    if unknown:
        raise PlantError(
            f"{where} in '{system.name}'",
            f"unknown symbol{'s' * (len(unknown) > 1)} {', '.join(unknown)}.",
            "Declare it as a state, input, parameter or definition (symbols are real: Symbol(name, real=True)).",
        )
