"""The drive as parts: DC motor, and a gear whose efficiency depends on which side drives."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from ulna.base import PlantError
from ulna.plants.arm import CURRENT
from ulna.plants.drive_preset import Preset
from ulna.system import Parameter, Signal, System


@dataclass(frozen=True, slots=True, kw_only=True)
class BackDriven:
    """What the gear loses when the load drives it.

    The torque at the joint is e N τ with e = η while the motor drives and at rest, and 1/η_b while it is driven:
    e = η + (1/η_b − η) s(r) of the power ratio r = −P/p, a smooth step that is exactly 0 at rest, stays within 0.026
    while the motor drives and tends to 1. A dry gear jumps at rest, where it takes up either torque; the smooth form
    keeps the motor's side there, and so gives back up to 0.15 p (η = 0.7) at powers below p.

    Attributes:
        efficiency: η_b in (0, 1]; equal loss of torque both ways gives 2 − 1/η.
        power: p in W, the power over which the gear changes over.
    """

    efficiency: sp.Expr
    power: sp.Expr

    def __post_init__(self) -> None:
        if not (0 < self.efficiency <= 1 and self.power > 0):
            raise PlantError(
                "gear driven back",
                f"efficiency {self.efficiency}, power {self.power} W.",
                "Give an efficiency in (0, 1] and a positive power; a gear that cannot be driven back is SelfLocking.",
            )


def motor_system(preset: Preset, *, heated: bool = False) -> System:
    """The motor as a part: inputs u and the speed of its shaft, state i, output its torque.

    La i' = u − R i − kb · shaft, torque = km i; R = Ra (1 + α T_w) where the winding's rise is an input.
    """
    resistance, inductance, kb, km = (preset.parameter(n) for n in ("Ra", "La", "kb", "km"))
    u = Signal(name="u", unit="V", text="armature voltage")
    shaft = Signal(name="shaft", unit="rad/s", text="speed of the motor shaft")
    i, ohms = CURRENT.symbol, resistance.symbol
    inputs, parameters = (u, shaft), (resistance, inductance, kb, km)
    if heated and preset.heating is not None:
        rise = Signal(name="rise", unit="K", text="rise of the winding")
        copper = Parameter(name="alpha_cu", unit="1/K", value=preset.heating.copper, text="coefficient of copper")
        ohms *= 1 + copper.symbol * rise.symbol
        inputs, parameters = (*inputs, rise), (*parameters, copper)
    return System(
        name="motor",
        states=(CURRENT,),
        rates=((u.symbol - ohms * i - kb.symbol * shaft.symbol) / inductance.symbol,),
        inputs=inputs,
        outputs=(
            Signal(name="motor_torque", unit="N*m", text="torque of the motor"),
            CURRENT,
            Signal(name="copper_loss", unit="W", text="heat in the winding"),
            Signal(name="electric_power", unit="W", text="power into the motor"),
            Signal(name="induced_power", unit="W", text="power into the back-EMF"),
            Signal(name="magnetic_energy", unit="J", text="energy in the inductance"),
        ),
        readouts=(
            km.symbol * i,
            i,
            ohms * i**2,
            u.symbol * i,
            kb.symbol * shaft.symbol * i,
            inductance.symbol * i**2 / 2,
        ),
        parameters=parameters,
    )


def gear_system(preset: Preset, back_driven: BackDriven | None) -> System:
    """The gear as a static part: inputs the motor's torque and the joint's speed, outputs shaft speed and torque."""
    ratio, efficiency = preset.parameter("N"), preset.parameter("eta")
    tau = Signal(name="tau", unit="N*m", text="torque of the motor")
    speed = Signal(name="speed", unit="rad/s", text="speed of the joint")
    n, e, parameters = ratio.symbol, efficiency.symbol, (ratio, efficiency)
    if back_driven is not None:
        back = Parameter(name="eta_b", value=back_driven.efficiency, text="efficiency of the gear, driven back")
        scale = Parameter(name="P_b", unit="W", value=back_driven.power, text="power of the change-over")
        r = -n * tau.symbol * speed.symbol / scale.symbol
        e += (1 / back.symbol - e) * _share_driven_back(r)
        parameters = (*parameters, back, scale)
    return System(
        name="gear",
        states=(),
        rates=(),
        inputs=(tau, speed),
        outputs=(
            Signal(name="shaft_speed", unit="rad/s", text="speed of the motor shaft"),
            Signal(name="joint_torque", unit="N*m", text="torque on the joint"),
            Signal(name="joint_power", unit="W", text="power into the joint"),
        ),
        readouts=(n * speed.symbol, e * n * tau.symbol, e * n * tau.symbol * speed.symbol),
        parameters=parameters,
    )


def _share_driven_back(r: sp.Expr) -> sp.Expr:
    """A smooth step: 0 at r = 0 and for r → −∞ (at most 0.026 between), 1 for r → ∞; never negative."""
    root = sp.sqrt(r**2 + 1)
    positive = r + root  # in (0, ∞), 1 at r = 0
    return ((positive - 1) / (positive + 1)) ** 2 * (1 + r / root) / 2
