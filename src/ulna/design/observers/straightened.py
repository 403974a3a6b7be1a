"""A plant rewritten so that its outputs are states: functions of the outputs then show at sight."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import sympy as sp

from ulna.geometry import lie_derivative
from ulna.symbolic.exact import lowest_terms
from ulna.symbolic.solving import invert_map, on_branch
from ulna.system import ControlAffine, System, control_affine, equilibrium, equilibrium_in_numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class StraightenedPlant:
    """The same plant with some states x_j replaced by outputs h_i; the new coordinate keeps the name of x_j.

    Attributes:
        system: the rewritten plant, whose outputs are states.
        meaning: h_i(x) for every replaced state, in the old coordinates.
        solved: the replaced states in the new coordinates.
    """

    system: System
    meaning: Mapping[sp.Symbol, sp.Expr]
    solved: Mapping[sp.Symbol, sp.Expr]

    def in_old(self, expression: sp.Expr) -> sp.Expr:
        """An expression in the new coordinates written in the old ones."""
        return expression.xreplace(dict(self.meaning))


@lru_cache(maxsize=64)
def straightened_plant(system: System) -> StraightenedPlant | None:
    """The rewritten plant; None where the outputs are states already or cannot be solved for states."""
    view = control_affine(system)
    if all(h in view.x for h in view.h):
        return None
    point = equilibrium(system).states
    taken = {h for h in view.h if h in view.x}
    meaning: dict[sp.Symbol, sp.Expr] = {}
    onto: dict[sp.Symbol, sp.Expr] = {}
    for h in view.h:
        if h in view.x:
            continue
        current = h.xreplace(onto)
        found = _solved_for_state(view, current, taken | set(meaning), point)
        if found is None:
            return None
        state, solution = found
        onto = {x: e.xreplace({state: solution}) for x, e in onto.items()} | {state: solution}
        meaning[state] = h
    return _rewritten(view, meaning, onto, point)


def _solved_for_state(
    view: ControlAffine, h: sp.Expr, taken: set[sp.Symbol], point: Mapping[sp.Symbol, sp.Expr]
) -> tuple[sp.Symbol, sp.Expr] | None:
    """A state that the level of h determines, and the state as a function of it (written as that same state)."""
    slopes = {x: h.diff(x) for x in view.x if x not in taken and h.has(x)}
    order = sorted(slopes, key=lambda x: (not slopes[x].is_number, slopes[x].has(x), sp.count_ops(slopes[x])))
    level = sp.Symbol("level", real=True)
    for x in order:
        if not slopes[x].has(x):
            if slopes[x].subs(dict(point)) == 0:
                continue
            rest = sp.expand(h - slopes[x] * x)
            if not rest.has(x):
                return x, (x - rest) / slopes[x]
        branch = invert_map([h], [x], [level], near={s: point[s] for s in view.x}, seconds=1.0)
        if branch.expressions is not None:
            return x, branch.expressions[0].xreplace({level: x})
    return None


def _rewritten(
    view: ControlAffine,
    meaning: Mapping[sp.Symbol, sp.Expr],
    onto: Mapping[sp.Symbol, sp.Expr],
    point: Mapping[sp.Symbol, sp.Expr],
) -> StraightenedPlant:
    u = sp.Matrix(len(view.u), 1, list(view.u))
    field = sp.Matrix(view.f) + sp.Matrix(view.g) * u
    start = {x: meaning[x].subs(dict(point)) if x in meaning else point[x] for x in view.x}
    numbers = equilibrium_in_numbers(view.system)
    base = {x: value.xreplace(numbers.parameters) for x, value in start.items()}
    base |= {**numbers.inputs, **numbers.parameters}
    rates = []
    for k, x in enumerate(view.x):
        rate = lie_derivative(meaning[x], field, view.x) if x in meaning else field[k]
        moved = on_branch(rate.xreplace(dict(onto)), base)
        rates.append(lowest_terms(moved, seconds=0.6))
    states = {h: x for x, h in meaning.items()}
    system = view.system
    return StraightenedPlant(
        system=replace(
            system,
            rates=tuple(rates),
            readouts=tuple(states.get(h, h) for h in view.h),
            definitions=(),
            operating_point=(
                *((x.name, value) for x, value in start.items() if not value.free_symbols and value.is_finite),
                *((name, value) for name, value in system.operating_point if name in {s.name for s in system.inputs}),
            ),
        ),
        meaning=meaning,
        solved=onto,
    )
