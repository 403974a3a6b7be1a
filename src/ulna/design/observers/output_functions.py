"""Functions of the outputs alone: is F(x) = φ(h(x)) for some φ, and which φ?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import sympy as sp

from ulna.base import Verdict, all_of
from ulna.geometry import lie_derivative
from ulna.symbolic.exact import (
    SampledZero,
    attempt,
    generic_rank,
    is_zero,
    null_space,
    patience,
    tidy,
    worked,
)
from ulna.symbolic.integration import (
    antiderivative,
    antiderivative_by_rules,
    antiderivative_by_substitution,
    potential_in_span,
)
from ulna.symbolic.solving import invert_map
from ulna.system import ControlAffine, System, equilibrium

_FREE_VALUES = (sp.Integer(0), sp.Integer(1), sp.Rational(3, 7), sp.Rational(-5, 11), sp.Integer(2))
_SECTIONS = 8
_SOLVE_SECONDS = 1.5
_LIFT_SECONDS = 2.5
"""s for all sections together; outputs that cannot be solved for states are seldom of use."""
_SAMPLED = SampledZero(seconds=0)


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputSection:
    """How functions that depend on the outputs alone are recognised and written in the outputs.

    Attributes:
        view: the plant's control-affine view, p outputs h.
        y: (p,) symbols of the measured outputs.
        fields: n − p vector fields that span ker dh almost everywhere.
        lifts: for each section x = σ(y) with h(σ(y)) = y found, the states as expressions in y.
    """

    view: ControlAffine
    y: tuple[sp.Symbol, ...]
    fields: tuple[sp.MatrixBase, ...]
    lifts: tuple[Mapping[sp.Symbol, sp.Expr], ...]

    def depends_on_outputs_only(self, function: sp.Expr) -> Verdict:
        """Whether dF vanishes on ker dh; a refutation holds the field and the derivative along it."""
        claim = "the function depends on the outputs alone"
        parts = []
        for field in self.fields:
            slope = lie_derivative(function, field, self.view.x)
            part = is_zero(slope, test=_SAMPLED)  # the form found is proved by substitution in the end
            if part.fails:
                return Verdict.refuted(
                    claim, **{**part.evidence, "function": function, "along": field, "derivative": slope}
                )
            parts.append(part)
        return all_of(claim, parts)

    def in_outputs(self, function: sp.Expr) -> sp.Expr | None:
        """φ(y) with φ(h(x)) = F(x), None if no section shows it; F is taken to depend on the outputs alone."""
        if not function.free_symbols & set(self.view.x):
            return function
        for lift in self.lifts:
            candidate = tidy(function.xreplace(dict(lift)) if _plain(lift) else function.subs(dict(lift)), seconds=0.4)
            if candidate.has(sp.nan, sp.zoo, sp.oo, -sp.oo) or candidate.free_symbols & (
                set(self.view.x) - set(self.y)
            ):
                continue
            if is_zero(self.at_states(candidate) - function, test=SampledZero(seconds=0)).holds:
                return candidate
        return None

    def at_states(self, function: sp.Expr) -> sp.Expr:
        """φ(h(x)) from φ(y)."""
        return function.xreplace(dict(zip(self.y, self.view.h, strict=True)))


def output_section(view: ControlAffine) -> OutputSection:
    """The section of a plant whose p outputs are independent."""
    y = output_symbols(view.system)
    return OutputSection(
        view=view,
        y=y,
        fields=null_space(view.h.jacobian(list(view.x))),
        lifts=tuple(_lifts(view, y)),
    )


def output_symbols(system: System) -> tuple[sp.Symbol, ...]:
    """(p,) symbols of the outputs; one that has a state's name without being that state gets another name."""
    taken = {*system.state_symbols, *system.input_symbols, *system.parameter_symbols}
    found = []
    for signal, h in zip(system.outputs, system.inline(system.readouts), strict=True):
        name = signal.name
        while sp.Symbol(name, real=True) in taken and sp.Symbol(name, real=True) != h:
            name += "_measured"
        found.append(sp.Symbol(name, real=True))
    return tuple(found)


def _plain(lift: Mapping[sp.Symbol, sp.Expr]) -> bool:
    return all(value.is_Symbol or (value.is_Rational and value != 0) for value in lift.values())


def _lifts(view: ControlAffine, y: Sequence[sp.Symbol]) -> Iterator[Mapping[sp.Symbol, sp.Expr]]:
    point = equilibrium(view.system).states
    found = 0
    end = worked() + _LIFT_SECONDS * patience()
    for pivots in _pivot_sets(view):
        free = [x for x in view.x if x not in pivots]
        for number in range(-1, len(_FREE_VALUES)):
            if number < 0:
                fixed = {x: point[x] for x in free}
            else:
                fixed = {x: _FREE_VALUES[(number + k) % len(_FREE_VALUES)] for k, x in enumerate(free)}
            lift = _solved(view, y, pivots, fixed, point, min(_SOLVE_SECONDS, end - worked()))
            if lift is not None:
                yield lift
                found += 1
            if found >= _SECTIONS or worked() > end:
                return


def _pivot_sets(view: ControlAffine) -> list[tuple[sp.Symbol, ...]]:
    """Sets of p states by which the outputs can be solved, outputs that are states first; at most three."""
    states = [h for h in view.h if h in view.x]
    others = [h for h in view.h if h not in view.x]
    if not others:
        return [tuple(states)]
    jacobian = sp.Matrix(view.h.jacobian(list(view.x)))
    candidates = []
    for chosen in combinations(range(len(view.x)), len(view.h)):
        pivots = tuple(view.x[k] for k in chosen)
        if not set(states) <= set(pivots):
            continue
        minor = jacobian[:, list(chosen)]
        if generic_rank(minor, seconds=0).value == len(pivots):
            nonlinear = len(minor.free_symbols & set(pivots))
            candidates.append((nonlinear, minor.applyfunc(sp.count_ops).norm(1), pivots))
    return [pivots for *_, pivots in sorted(candidates, key=lambda c: c[:2])[:3]]


def _solved(
    view: ControlAffine,
    y: Sequence[sp.Symbol],
    pivots: Sequence[sp.Symbol],
    fixed: Mapping[sp.Symbol, sp.Expr],
    point: Mapping[sp.Symbol, sp.Expr],
    seconds: float,
) -> dict[sp.Symbol, sp.Expr] | None:
    outputs = [h.subs(dict(fixed)) for h in view.h]
    if any(h.has(sp.nan, sp.zoo, sp.oo) for h in outputs):
        return None
    if all(h in view.x for h in view.h):
        return {**fixed, **dict(zip(outputs, y, strict=True))}
    # Fresh symbols: an output may have a state's name.
    names = [sp.Symbol(f"{s.name}_level", real=True) for s in y]
    near = {x: point[x] for x in pivots}
    branch = invert_map(outputs, list(pivots), names, near=near, seconds=seconds).expressions
    if branch is None:
        return None
    rename = dict(zip(names, y, strict=True))
    return {**fixed, **{x: e.xreplace(rename) for x, e in zip(pivots, branch, strict=True)}}


def integral_over_output(section: OutputSection, slope: sp.Expr, *, index: int = 0) -> sp.Expr | None:
    """∫ slope dy_i, real near the operating point, differentiated back; None if none is found.

    Args:
        section: the plant with its output symbols.
        slope: in the output symbols.
        index: i, the number of the output.
    """
    y = section.y[index]
    if slope == 0:
        return sp.Integer(0)
    for candidate in _antiderivatives(slope, y):
        value = _real_near(candidate, section)
        if is_zero(value.diff(y) - slope, test=SampledZero(seconds=0.2)).holds:
            return tidy(value - sp.expand(value).as_independent(y, as_Add=True)[0], seconds=0.3)
    return None


def _antiderivatives(slope: sp.Expr, y: sp.Symbol) -> Iterator[sp.Expr]:
    """Candidates from cheap to dear: by rules, in the span of the functions that occur, as a whole and term by term."""
    expanded = sp.expand(slope)
    ruled = antiderivative_by_rules(expanded, y)
    if ruled is not None:
        yield ruled
    circular = antiderivative_by_substitution(slope, y)
    if circular is not None:
        yield circular
    forms = list(dict.fromkeys((expanded, slope)))
    for form in forms:
        found = attempt(0.5, "potential", potential_in_span, (form,), (y,)).value
        if found is not None:
            yield found
    total: sp.Expr | None = sp.Integer(0)
    for term in sp.Add.make_args(expanded):
        part = attempt(0.3, "potential", potential_in_span, (term,), (y,)).value or antiderivative(term, y, seconds=0.7)
        total = None if part is None or total is None else total + part
        if total is None:
            break
    if total is not None:
        yield total
    for form in forms:
        found = antiderivative(form, y, seconds=1.0)
        if found is not None:
            yield found


def _real_near(expression: sp.Expr, section: OutputSection) -> sp.Expr:
    """The expression with logarithms of −a in place of those of a where a is negative at the operating point."""
    system = section.view.system
    point = equilibrium(system).states
    numbers = {p: sp.Integer(1) for p in system.parameter_symbols} | system.values
    base = {y: h.subs(dict(point)).subs(numbers) for y, h in zip(section.y, section.view.h, strict=True)}
    flips = {}
    for node in expression.atoms(sp.log):
        value = attempt(0.2, "sign", lambda node=node: sp.N(node.args[0].subs({**base, **numbers}))).value
        if value is not None and value.is_extended_negative:
            flips[node] = sp.log(sp.expand(-node.args[0]))
    return expression.xreplace(flips)


def exponential(exponent: sp.Expr, y: sp.Symbol) -> sp.Expr:
    """exp(exponent) with logarithms turned into powers, without constant factors."""
    factors = []
    for term in sp.Add.make_args(sp.expand(exponent)):
        coefficient, rest = term.as_independent(sp.log)
        factors.append(rest.args[0] ** coefficient if isinstance(rest, sp.log) else sp.exp(term))
    return without_factor(tidy(sp.Mul(*factors), seconds=0.3), y)


def without_factor(expression: sp.Expr, y: sp.Symbol) -> sp.Expr:
    """The expression without factors that do not depend on y."""
    together = sp.factor_terms(expression)
    return together.as_independent(y, as_Add=False)[1]
