"""Cascades: a proportional-integral loop around one inner state, and the outer plant that it leaves.

Source: K. J. Åström, T. Hägglund, Advanced PID Control, 2006, sections 3.5 (anti-windup), 5.2 (cascade), 6.4 (poles).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import sympy as sp

from ulna.base import DesignError
from ulna.design.control.output_feedback import close_loop
from ulna.design.gains import Gains, gain_rule
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.exact import tidy
from ulna.system import Signal, System, SystemLike


@dataclass(frozen=True, slots=True, kw_only=True)
class InnerLoop:
    """A loop around the state z of a plant whose rate is z' = a z + w(x) + b u.

    Attributes:
        plant: the plant; inner: name of z; reference: name of its set point r, `<z>_ref`.
        proportional, integral: gains k_p, k_i of u = k_p (r − z) + k_i e (− w/b), e' = r − z.
        polynomial: (a₀, a₁) of s² + a₁ s + a₀ that z obeys exactly while nothing is limited.
        system: the controller: inputs r, z (and what w contains), output u, state the integral.
        outer: the plant in its other states with r as its input, z = r.
    """

    plant: System
    inner: str
    reference: str
    proportional: sp.Expr
    integral: sp.Expr
    polynomial: tuple[sp.Expr, sp.Expr]
    system: System
    outer: System


def inner_loop(
    plant: PlantLike,
    inner: str,
    gains: Gains,
    *,
    cancel_coupling: bool = False,
    reference_limit: sp.Expr | None = None,
    command_limit: sp.Expr | None = None,
) -> InnerLoop:
    """The loop whose two poles are placed exactly: k_p = (a₁ + a)/b, k_i = a₀/b.

    Limits are part of the controller: r is cut to ±reference_limit, u to ±command_limit, and the integral is held back
    by e' = r − z + (u_cut − u)/k_p, so that it never winds up (back-calculation with tracking time k_p/k_i).

    Args:
        plant: one input, which enters the rate of the inner state only.
        inner: name of the state whose rate is affine in itself and the input with constant coefficients.
        gains: two poles.
        cancel_coupling: subtract w(x)/b, which then must be measured or estimated.
        reference_limit, command_limit: positive, SI.

    Raises:
        DesignError: for a plant of another kind, a limit that is not positive, gains that do not fit.
    """
    plant = as_plant(plant)
    z, a, b, w = _inner_rate(plant, inner)
    a0, a1 = gain_rule(gains).coefficients(2)
    proportional, integral = tidy((a1 + a) / b), tidy(a0 / b)
    state = next(s for s in plant.states if s.name == inner)
    reference = replace(state, name=f"{inner}_ref", text=f"set point of {state.text or inner}")
    memory = Signal(name=f"{inner}_int", text=f"integral of the error of {inner}")
    wanted = _cut(reference.symbol, reference_limit, reference.name)
    free = proportional * (wanted - z) + integral * memory.symbol - (w / b if cancel_coupling else 0)
    command = _cut(free, command_limit, plant.inputs[0].name)
    error = wanted - z + ((command - free) / proportional if command_limit is not None else 0)
    seen = free.free_symbols
    controller = System(
        name=f"inner loop of {inner}, {plant.name}",
        states=(memory,),
        rates=(error,),
        inputs=(reference, *(s for s in plant.states if s.symbol in seen | {z})),
        outputs=plant.inputs,
        readouts=(command,),
        parameters=tuple(p for p in plant.parameters if p.symbol in seen | command.free_symbols),
    )
    return InnerLoop(
        plant=plant,
        inner=inner,
        reference=reference.name,
        proportional=proportional,
        integral=integral,
        polynomial=(a0, a1),
        system=controller,
        outer=_outer(plant, z, reference),
    )


def close_cascade(loop: InnerLoop, controller: SystemLike) -> System:
    """Plant, inner loop and a law or compensator designed for `loop.outer`, as one system.

    Outputs: those of the plant, its input and the inner set point.
    """
    held = close_loop(loop.plant, loop.system).system
    return replace(close_loop(held, controller).system, name=f"cascade of {loop.plant.name}")


def _inner_rate(plant: System, inner: str) -> tuple[sp.Symbol, sp.Expr, sp.Expr, sp.Expr]:
    """The symbol z, and a, b, w of z' = a z + w + b u."""
    asked = f"inner loop of '{inner}' in '{plant.name}'"
    rates = dict(zip((s.name for s in plant.states), plant.inline(plant.rates), strict=True))
    if inner not in rates or len(plant.inputs) != 1:
        raise DesignError(
            asked,
            f"the states are {', '.join(rates)}, the inputs {len(plant.inputs)}.",
            "Name a state of a plant with one input.",
        )
    z, u = sp.Symbol(inner, real=True), plant.input_symbols[0]
    rate = sp.expand(rates[inner])
    a, b = rate.diff(z), rate.diff(u)
    variable = {*plant.state_symbols, u}
    elsewhere = [name for name, other in rates.items() if name != inner and other.has(u)]
    if b == 0 or (a.free_symbols | b.free_symbols) & variable or elsewhere:
        raise DesignError(
            asked,
            f"its rate {rate} is not a z + w(x) + b u with constant a and b, or the input enters elsewhere.",
            "Choose the state that the input drives.",
        )
    return z, tidy(a), tidy(b), tidy(rate - a * z - b * u)


def _cut(value: sp.Expr, limit: sp.Expr | None, name: str) -> sp.Expr:
    if limit is None:
        return value
    if not (limit.is_number and limit > 0):
        raise DesignError(f"limit of {name}", f"it is {limit}.", "Give a positive number.")
    return sp.Min(limit, sp.Max(-limit, value))


def _outer(plant: System, z: sp.Symbol, reference: Signal) -> System:
    kept = [k for k, s in enumerate(plant.states) if s.symbol != z]
    rates, readouts = plant.inline(plant.rates), plant.inline(plant.readouts)
    return replace(
        plant,
        name=f"{plant.name}, {z.name} controlled",
        states=tuple(plant.states[k] for k in kept),
        rates=tuple(rates[k].subs(z, reference.symbol) for k in kept),
        inputs=(reference,),
        readouts=tuple(e.subs(z, reference.symbol) for e in readouts),
        definitions=(),
        operating_point=tuple((n, v) for n, v in plant.operating_point if n not in {z.name, plant.inputs[0].name}),
    )
