"""The forearm as one link about the elbow: from a rod, or from inertia and gravity moment; friction, brake, load."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import sympy as sp

from ulna.base import PlantError
from ulna.plants.drive_preset import Preset
from ulna.plants.friction import Friction, LuGre, friction_part
from ulna.symbolic.formulas import exact
from ulna.system import Definition, Parameter, Signal, System

THETA = Signal(name="theta", unit="rad", text="angle, down-positive from the horizontal")
OMEGA = Signal(name="omega", unit="rad/s", text="angular velocity")
CURRENT = Signal(name="i", unit="A", text="armature current")
REFLECTED = sp.Symbol("N", real=True) ** 2 * sp.Symbol("Jm", real=True)
"""N² Jm, the rotor's inertia seen from the joint."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Forearm:
    """A link without its load: inertia about the elbow in kg m² and gravity moment in N m, in its own parameters.

    Attributes:
        parameters: what the two expressions contain beside b and g, which every preset has.
        reach: distance of the load from the elbow, in the same symbols.
    """

    parameters: tuple[Parameter, ...]
    inertia: sp.Expr
    moment: sp.Expr
    reach: sp.Expr


@dataclass(frozen=True, slots=True, kw_only=True)
class Brake:
    """A brake on the joint, input `brake` from 0 (free) to 1: −brake · torque · tanh(ω/creep).

    The smooth form creeps: under a moment M it slips at creep · artanh(M/torque), nothing beyond `torque` is held.
    """

    torque: sp.Expr
    creep: sp.Expr


@dataclass(frozen=True, slots=True, kw_only=True)
class SelfLocking:
    """A gear that cannot be driven back while the motor has no current: −torque · exp(−(i/release)²) · tanh(ω/creep).

    Attributes:
        torque: what it holds in N m; creep: slip speed in rad/s; release: current in A that frees it.
    """

    torque: sp.Expr
    creep: sp.Expr
    release: sp.Expr


def rod(preset: Preset) -> Forearm:
    """A thin uniform rod of mass m1 and length b with the load at its end: J = m1 b²/3, moment m1 g b/2."""
    m1, b, g = (preset.parameter(n).symbol for n in ("m1", "b", "g"))
    return Forearm(parameters=(preset.parameter("m1"),), inertia=m1 * b**2 / 3, moment=m1 * g * b / 2, reach=b)


def measured_forearm(*, inertia: Any, moment: Any, source: str = "") -> Forearm:
    """A forearm of known inertia J in kg m² about the elbow and gravity moment m g l in N m, the load at length b.

    Raises:
        PlantError: for values that are not positive.
    """
    values = {}
    for name, text, unit, given in (
        ("J_arm", "inertia of the forearm about the elbow", "kg*m^2", inertia),
        ("G_arm", "gravity moment of the forearm", "N*m", moment),
    ):
        try:
            number = exact(given)
        except (TypeError, ValueError):
            raise PlantError(f"{text}", f"{given!r} is not a finite number.") from None
        if not number > 0:
            raise PlantError(f"{text}", f"it is {given} {unit}.", "It must be positive.")
        values[name] = Parameter(name=name, value=number, unit=unit, text=text, source=source)
    return Forearm(
        parameters=tuple(values.values()),
        inertia=values["J_arm"].symbol,
        moment=values["G_arm"].symbol,
        reach=sp.Symbol("b", real=True),
    )


def link_system(
    preset: Preset, forearm: Forearm, friction: Friction | LuGre | None, brake: Brake | SelfLocking | None
) -> System:
    """The joint as a part: input the gear's torque, states theta and omega, output the angle y.

    LuGre's friction has its bristle as a further state.
    (J + N² Jm) ω' = G cos θ − B ω − friction − brake + torque, with the load m2 at the forearm's reach:
    J = J_arm + m2 r², G = G_arm + m2 g r.
    """
    m2, g, viscous, ratio, rotor, b = (preset.parameter(n) for n in ("m2", "g", "B", "N", "Jm", "b"))
    reach = forearm.reach
    inertia = Definition(name="J", expression=m2.symbol * reach**2 + forearm.inertia)
    moment = Definition(name="G", expression=m2.symbol * g.symbol * reach + forearm.moment)
    torque, omega = Signal(name="torque", unit="N*m", text="torque of the gear on the joint"), OMEGA.symbol
    holding, inputs, extra = _holding(brake)
    dry = friction_part(friction, omega)
    drag = viscous.symbol * omega + dry.torque + holding
    total = inertia.symbol + REFLECTED
    return System(
        name="link",
        states=(THETA, OMEGA, *dry.states),
        rates=(omega, (moment.symbol * sp.cos(THETA.symbol) - drag + torque.symbol) / total, *dry.rates),
        inputs=(torque, *inputs),
        outputs=(
            Signal(name="y", unit="rad", text="measured angle"),
            OMEGA,
            Signal(name="friction_loss", unit="W", text="heat of friction and brake"),
            Signal(name="mechanical_energy", unit="J", text="kinetic energy and height"),
        ),
        readouts=(
            THETA.symbol,
            omega,
            drag * omega,
            total * omega**2 / 2 - moment.symbol * sp.sin(THETA.symbol),
        ),
        parameters=(*forearm.parameters, m2, b, g, ratio, rotor, viscous, *dry.parameters, *extra),
        definitions=(inertia, moment),
        operating_point=(("theta", sp.Integer(0)),),
    )


def _holding(brake: Brake | SelfLocking | None) -> tuple[sp.Expr, tuple[Signal, ...], tuple[Parameter, ...]]:
    if brake is None:
        return sp.Integer(0), (), ()
    torque = Parameter(name="T_hold", unit="N*m", value=brake.torque, text="largest torque held")
    creep = Parameter(name="w_hold", unit="rad/s", value=brake.creep, text="slip speed of the smooth form")
    grip = torque.symbol * sp.tanh(OMEGA.symbol / creep.symbol)
    if isinstance(brake, Brake):
        engaged = Signal(name="brake", text="brake, 0 free to 1 engaged")
        return engaged.symbol * grip, (engaged,), (torque, creep)
    release = Parameter(name="i_release", unit="A", value=brake.release, text="current that frees the gear")
    motor = Signal(name="current", unit="A", text="motor current")
    return sp.exp(-((motor.symbol / release.symbol) ** 2)) * grip, (motor,), (torque, creep, release)
