"""A plant with its unknown parameters as states that keep still, moved by known inputs: what a log is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import StrEnum

import numpy as np
import sympy as sp

from ulna.system import NON_SMOOTH, Definition, Signal, System, stand_ins

SEED = 1973
CLOCK = "clock_of_the_inputs"


class Motion(StrEnum):
    """How the inputs move while the outputs are logged."""

    NONE = "no input"
    """All inputs are zero."""
    CONSTANT = "a constant input"
    """Each input has one known value."""
    CHANGING = "an input that changes"
    """Known functions of time, as rich as needed: polynomials with random coefficients."""


def experiment(system: System, free: Sequence[str], motion: Motion, order: int) -> System:
    """The autonomous system of states, unknown parameters (with zero rates) and a clock that the inputs follow.

    Known parameters stand at their values; one without a value at an arbitrary number within its bounds.

    Args:
        system: the plant, in continuous time.
        free: names of the unknown parameters.
        motion: how the inputs move.
        order: degree of the polynomials that they follow.
    """
    unknown = set(free)
    known = {s: value for s, value in stand_ins(system).items() if s.name not in unknown}
    moved = [
        Definition(name=u.name, expression=e)
        for u, e in zip(system.inputs, _inputs(system, motion, order), strict=True)
    ]
    fixed = [Definition(name=s.name, expression=value) for s, value in known.items()]
    still = tuple(Signal(name=p.name, unit=p.unit) for p in system.parameters if p.name in unknown)
    return replace(
        system,
        states=(*system.states, *still, Signal(name=CLOCK)),
        rates=(*system.rates, *([sp.S.Zero] * len(still)), sp.S.One),
        inputs=(),
        parameters=(),
        definitions=(*fixed, *moved, *system.definitions),
        operating_point=(),
    )


def _inputs(system: System, motion: Motion, order: int) -> list[sp.Expr]:
    """Polynomials in the clock; the coefficients are short, all different and not small."""
    clock = sp.Symbol(CLOCK, real=True)
    generator = np.random.default_rng(SEED)
    degree = {Motion.NONE: -1, Motion.CONSTANT: 0, Motion.CHANGING: order}[motion]
    found = []
    for _ in system.inputs:
        value: sp.Expr = sp.S.Zero
        for _ in range(degree + 1):
            value = value * clock + sp.Rational(int(generator.integers(17, 97)), 64)
        found.append(value)
    return found


def on_one_side(system: System, start: Mapping[sp.Symbol, sp.Expr]) -> System:
    """The smooth system that agrees with this one near a point: signs, magnitudes and cases as they are there."""
    if not any(
        e.has(*NON_SMOOTH) for e in (*system.rates, *system.readouts, *(d.expression for d in system.definitions))
    ):
        return system
    rates, readouts = (
        tuple(_piece(e, start) for e in system.inline(expressions)) for expressions in (system.rates, system.readouts)
    )
    return replace(system, rates=rates, readouts=readouts, definitions=())


def _piece(expression: sp.Basic, start: Mapping[sp.Symbol, sp.Expr]) -> sp.Basic:
    if not expression.has(*NON_SMOOTH):
        return expression
    if isinstance(expression, sp.Piecewise):
        for value, condition in expression.args:
            if bool(condition.xreplace(dict(start)) == sp.true):
                return _piece(value, start)
        return sp.nan
    arguments = [_piece(argument, start) for argument in expression.args]
    numbers = [sp.N(argument.xreplace(dict(start)), 30) for argument in arguments]
    if isinstance(expression, sp.sign):
        return sp.sign(numbers[0])
    if isinstance(expression, sp.Abs):
        return arguments[0] * sp.sign(numbers[0])
    if isinstance(expression, sp.Min | sp.Max):
        chosen = min if isinstance(expression, sp.Min) else max
        return arguments[numbers.index(chosen(numbers))]
    if isinstance(expression, (*NON_SMOOTH,)):
        return expression.func(*numbers)
    return expression.func(*arguments)
