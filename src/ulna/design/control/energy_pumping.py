"""Swing-up of pendulums by energy: pumped by the sign of the power until a local law catches."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import sympy as sp

from ulna.base import DesignError
from ulna.design.control.law import Law
from ulna.design.forms import input_output_form
from ulna.design.gains import Gains, gain_rule
from ulna.design.linear import as_numbers, as_rational, linear_plant
from ulna.symbolic.exact import is_zero
from ulna.symbolic.formulas import exact, parse_formula
from ulna.system import System, with_uses

_PUSH_OFF = sp.Rational(1, 10**6)
"""Power per input below which the push turns round: not zero, so that a pendulum that hangs at rest is pushed off."""


def swing_up(
    catch: Law,
    *,
    energy: str,
    push: float,
    gain: float,
    within: Mapping[str, float],
    pivot: str | None = None,
    hold: Gains | None = None,
) -> Law:
    """The law v = −sat(k (E − E*)) sgn(∂E'/∂v) that pumps energy, and the catch where V = dxᵀ P dx is small.

    Args:
        catch: a local law without memory or set point; its plant and its rest point x* are those of the swing-up.
        energy: E, a formula of the states; what is wanted is its value at x*.
        push: largest |v|. gain: k, of v per energy.
        within: half-width by state, SI: the catch acts inside the largest V ≤ c that stays within them all. P solves
            the Lyapunov equation of the loop with the catch, with I + KᵀK on the right.
        pivot: the output whose highest derivative with an input is v (a cart's acceleration); left out, v is the input.
        hold: poles that draw the pivot back, added to v.

    Raises:
        DesignError: for a plant without exactly one input, a catch that is not local, an energy that v does not
            change, or unknown states.

    Reference:
        K. J. Åström, K. Furuta, Swinging up a pendulum by energy control, Automatica 36 (2000).

    Examples:
        >>> plant = ulna.model("cart_pole").with_values()
        >>> catch = ulna.local_law(plant, [-2, -2.5, -3, -3.5])
        >>> law = ulna.swing_up(catch, energy="om^2/2 + 9.8*cos(th)", push=10, gain=20, within={"th": 0.3}, pivot="y")
        >>> law.method
        'swing-up by energy, caught by a law that is local, on the linearisation at the origin'
    """
    plant = catch.plant
    asked = f"a swing-up of '{plant.name}'"
    if len(plant.inputs) != 1 or catch.form is not None or catch.system.states or not catch.gains:
        raise DesignError(asked, "it needs one input and a local law without memory.", "Give catch=local_law(...).")
    unknown = sorted(set(within) - {s.name for s in plant.states})
    if unknown or not within or min(within.values()) <= 0:
        found = f"within= gives {', '.join(within) or 'nothing'}."
        raise DesignError(asked, found, "Give a positive half-width for one state or more.")
    linear = linear_plant(plant)
    x, u = plant.state_symbols, plant.input_symbols[0]
    names = {s.name: s.symbol for s in (*plant.states, *plant.parameters)}
    E = parse_formula(energy, names, where=asked)
    command, v, drawn = _pumped(plant, pivot, hold)
    rates = sp.Matrix(plant.inline(plant.rates)).subs(u, command)
    power = sp.diff((sp.Matrix([E]).jacobian(list(x)) * rates)[0], v)
    if is_zero(power).holds:
        raise DesignError(asked, f"the input does not change {energy}.", "Give the pendulum's energy, or the pivot.")
    most, k = exact(push), exact(gain)
    surplus = E - E.subs(linear.point)
    wanted = -sp.Max(-most, sp.Min(most, k * surplus)) * sp.Piecewise((1, power >= -_PUSH_OFF), (-1, True)) - drawn
    turned = {s: linear.point[s] + sp.atan2(sp.sin(d), sp.cos(d)) for s, d in _angles(plant, linear.point).items()}
    dx = sp.Matrix([turned.get(s, s) - linear.point[s] for s in x])
    P, level = _ellipsoid(as_numbers(linear.A - linear.B * catch.gains), as_numbers(catch.gains), plant, within)
    near = (dx.T * P * dx)[0] <= level
    expression = sp.Piecewise((catch.expressions[0].subs(turned), near), (command.subs(v, wanted), True))
    expressions = sp.ImmutableDenseMatrix([expression])
    return Law(
        plant=plant,
        method=f"swing-up by energy, caught by a law that is {catch.method}",
        expressions=expressions,
        system=System(
            name=f"law of {plant.name}",
            text="swing-up by energy with a catch",
            states=(),
            rates=(),
            inputs=plant.states,
            outputs=plant.inputs,
            readouts=(expression,),
        ),
    )


def _pumped(plant: System, pivot: str | None, hold: Gains | None) -> tuple[sp.Expr, sp.Symbol, sp.Expr]:
    """The input in v, v, and what draws the pivot back."""
    v = sp.Symbol("v_pump", real=True)
    if pivot is None:
        return v, v, sp.Integer(0)
    form = input_output_form(with_uses(plant, controlled=[pivot]))
    drawn = sp.Integer(0)
    if hold is not None:
        rest = linear_plant(plant).point
        drawn = sp.Add(
            *(
                a * (z - z.subs(rest))
                for a, z in zip(gain_rule(hold).polynomials(form.indices)[0], form.chain, strict=True)
            )
        )
    return (v - form.alpha[0]) / form.beta[0], v, drawn


def _angles(plant: System, point: Mapping[sp.Symbol, sp.Expr]) -> dict[sp.Symbol, sp.Expr]:
    """x − x* of every state after a turn of which all is the same."""
    rates = plant.inline(plant.rates)
    return {
        s: s - point[s]
        for s in plant.state_symbols
        if any(r.has(s) for r in rates) and all(r == r.xreplace({s: s + 2 * sp.pi}) for r in rates)
    }


def _ellipsoid(
    closed: np.ndarray, K: np.ndarray, plant: System, within: Mapping[str, float]
) -> tuple[sp.ImmutableDenseMatrix, sp.Expr]:
    from scipy.linalg import solve_continuous_lyapunov

    P = solve_continuous_lyapunov(closed.T, -(np.eye(len(closed)) + K.T @ K))
    shape = np.linalg.inv(P)
    widths = {s.name: shape[k, k] for k, s in enumerate(plant.states)}
    level = min(float(w) ** 2 / widths[name] for name, w in within.items())
    return as_rational((P + P.T) / 2), exact(float(f"{level:.12g}"))
