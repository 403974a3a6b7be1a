"""The arm as it stands on the bench: a preset's arm with friction, a load that changes and a push at the joint."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from ulna.plants import (
    BackDriven,
    Friction,
    Preset,
    arm_with_drive,
    hold,
    no_load_speed,
    range_of_motion,
    require_liftable,
    torque_margin,
)
from ulna.sim.references import MotionLimits
from ulna.system import Picture, Signal, System

FRICTION_SPEED = sp.Rational(1, 20)
"""rad/s over which the smooth Coulomb friction changes sign (choice)."""
ENCODER_COUNTS = 16384
"""Codes a turn of the joint where the preset names none (choice: 14 bit)."""
GEAR_SPEED = sp.Rational(1, 10)
"""rad/s at which the joint's gravity moment makes the power over which the gear changes over to being driven back
(choice)."""
PICTURE = Picture(kind="arm", parts=(("angle", "theta"), ("current", "i"), ("load", "m2"), ("length", "b")))
COMFORTABLE_SPEED = 2.0
"""rad/s that a motion asks for at most (choice)."""
COMFORTABLE_ACCELERATION = 10.0
"""rad/s² that a motion asks for at most (choice)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bench:
    """A preset on the bench, in SI.

    Attributes:
        plant: inputs u, `load` (kg on top of m2) and `push` (N m at the joint); parameters symbolic.
        lumps: c1 … c6 of ω' = c1 cos θ − c2 ω + c3 i, i' = −c4 ω − c5 i + c6 u at the preset's numbers.
        extra_load: what is picked up, kg: 1 kg, or half the preset's load where 1 kg cannot be lifted with a fifth to
            spare by the weakest drive of the draws.
        moment: gravity moment with the nominal load, N m. step: of the encoder, rad.
        voltage, current: limits, infinite where unknown. cell, cell_resistance: of the battery, or infinite and 0.
        walls: passive range of motion, rad. motion: what references may ask for.
    """

    preset: Preset
    plant: System
    lumps: Mapping[str, float]
    extra_load: float
    moment: float
    step: float
    voltage: float
    current: float
    cell: float
    cell_resistance: float
    walls: tuple[float, float]
    motion: MotionLimits

    def value(self, name: str) -> float:
        """A parameter of the preset as a number in SI."""
        return float(self.preset.value(name))

    @property
    def electrical_time(self) -> float:
        """La/Ra in s."""
        return self.value("La") / self.value("Ra")


WEAKEST = {"load": 1.5, "Ra": 1.2, "eta": 0.85}
"""The worst of the draws: factors on load, resistance and efficiency."""


def bench_of(preset: Preset) -> Bench:
    """The bench of a preset.

    Raises:
        PlantError: where the drive cannot hold the preset's load; the torque margin is named.
    """
    require_liftable(preset)
    limits = preset.limits
    moment = hold(preset).torque
    passive, functional = range_of_motion("passive"), range_of_motion("functional")
    speed = COMFORTABLE_SPEED
    if limits.voltage is not None:
        speed = min(speed, 0.5 * no_load_speed(preset))
    battery = preset.battery
    return Bench(
        preset=preset,
        plant=bench_plant(preset),
        lumps=lumps_of(preset),
        extra_load=_extra_load(preset),
        moment=moment,
        step=2 * math.pi / (limits.encoder_counts or ENCODER_COUNTS),
        voltage=math.inf if limits.voltage is None else float(limits.voltage),
        current=math.inf if limits.current_peak is None else float(limits.current_peak),
        cell=math.inf if battery is None else float(battery.voltage),
        cell_resistance=0.0 if battery is None else float(battery.resistance),
        walls=(passive.lower, passive.upper),
        motion=MotionLimits(
            speed=speed, acceleration=COMFORTABLE_ACCELERATION, lower=functional.lower, upper=functional.upper
        ),
    )


def bench_plant(preset: Preset) -> System:
    """The arm with its drive, Coulomb friction (parameters T_c, w_c), and the inputs `load` and `push`.

    The gear driven back has the preset's efficiency eta_b, or eta where it names none; P_b: see `BackDriven`.
    The load m2 + load sits at the end of the rod; a load taken up moves with the hand already. The push is a torque,
    positive downwards.
    """
    named = {p.name for p in preset.parameters}
    gear = BackDriven(
        efficiency=preset.value("eta_b" if "eta_b" in named else "eta"),
        power=sp.Rational(f"{hold(preset).torque:.4g}") * GEAR_SPEED,
    )
    arm = arm_with_drive(preset, friction=Friction(torque=sp.Integer(0), speed=FRICTION_SPEED), back_driven=gear)
    load, push = Signal(name="load", unit="kg", text="taken up"), Signal(name="push", unit="N*m", text="torque")
    m1, m2, b, ratio, rotor = (sp.Symbol(name, real=True) for name in ("m1", "m2", "b", "N", "Jm"))
    carried = {m2: m2 + load.symbol}
    inertia = (m2 + load.symbol) * b**2 + m1 * b**2 / 3 + ratio**2 * rotor
    rates = [rate.xreplace(carried) for rate in arm.inline(arm.rates)]
    omega = [s.name for s in arm.states].index("omega")
    rates[omega] += push.symbol / inertia
    return replace(
        arm, name=f"bench with {preset.name}", inputs=(*arm.inputs, load, push), rates=tuple(rates), definitions=(),
        picture=PICTURE,
    )  # fmt: skip


def lumps_of(preset: Preset) -> dict[str, float]:
    """c1 … c6 of ω' = c1 cos θ − c2 ω + c3 i, i' = −c4 ω − c5 i + c6 u: the preset's arm without friction."""
    m1, m2, b, g, n, jm, drag, ohms, henry, kb, km, eta = (
        float(preset.value(name)) for name in ("m1", "m2", "b", "g", "N", "Jm", "B", "Ra", "La", "kb", "km", "eta")
    )
    inertia = m2 * b**2 + m1 * b**2 / 3 + n**2 * jm
    return {
        "c1": (m2 + m1 / 2) * g * b / inertia,
        "c2": drag / inertia,
        "c3": eta * n * km / inertia,
        "c4": n * kb / henry,
        "c5": ohms / henry,
        "c6": 1 / henry,
    }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Draws:
    """Plants that differ, the same for every controller and task.

    Attributes:
        parameters: (D, P) SI values in the order of the plant's parameters; the first row is nominal, without friction.
        seed: of the encoder's noise.
    """

    parameters: np.ndarray
    seed: int

    @property
    def count(self) -> int:
        """D."""
        return len(self.parameters)


def draws_of(bench: Bench, count: int, *, seed: int = 1) -> Draws:
    """The nominal plant and count − 1 random ones.

    Load 0.5 to 1.5 of the preset's, resistance ±20 %, efficiency 0.85 to 1 of its value, driven back and driving,
    Coulomb friction up to 5 % of the nominal gravity moment; uniform and independent.
    """
    names = [p.name for p in bench.plant.parameters]
    nominal = np.array([float(p.si_value or 0) for p in bench.plant.parameters])
    table = np.tile(nominal, (count, 1))
    spread = np.random.default_rng(seed).uniform(size=(count, 4))
    spread[0] = [0.5, 0.5, 1.0, 0.0]
    table[:, names.index("m2")] *= 0.5 + spread[:, 0]
    table[:, names.index("Ra")] *= 0.8 + 0.4 * spread[:, 1]
    table[:, [names.index("eta"), names.index("eta_b")]] *= 0.85 + 0.15 * spread[:, 2:3]
    table[:, names.index("T_c")] = 0.05 * bench.moment * spread[:, 3]
    return Draws(parameters=table, seed=seed)


def _extra_load(preset: Preset) -> float:
    heavy = WEAKEST["load"] * float(preset.value("m2"))
    ohms = WEAKEST["Ra"] * float(preset.value("Ra"))
    margin = torque_margin(preset, load=heavy + 1.0, resistance=ohms)
    fits = margin.available * WEAKEST["eta"] > 1.2 * margin.needed
    return 1.0 if fits else 0.5 * float(preset.value("m2"))
