"""What a drive can hold: current, voltage and power at rest, the torque margin, the speed without load."""

from __future__ import annotations

import math
from dataclasses import dataclass

import sympy as sp

from ulna.base import PlantError
from ulna.plants.arm import Forearm, rod
from ulna.plants.drive_preset import Preset


@dataclass(frozen=True, slots=True, kw_only=True)
class Hold:
    """What holding still takes. torque: at the joint in N m; current in A; voltage in V; power: electric, in W."""

    torque: float
    current: float
    voltage: float
    power: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TorqueMargin:
    """Torque asked for and torque there is at standstill, in N m at the joint, and what sets the limit.

    Attributes:
        needed: to hold the load at the angle; available: briefly; lasting: continuously (infinite where unknown).
        reason: the limit behind `available`: the current limit, or voltage over resistance.
    """

    needed: float
    available: float
    lasting: float
    reason: str

    @property
    def lifts(self) -> bool:
        """Whether the drive can hold the load with something to spare."""
        return self.available > self.needed

    @property
    def lasts(self) -> bool:
        """Whether it can hold the load continuously."""
        return self.lasting >= self.needed


def hold(preset: Preset, *, load: float | None = None, angle: float = 0.0, forearm: Forearm | None = None) -> Hold:
    """Holding a load in kg at an angle in rad from the horizontal: i = G cos θ/(η N km), u = Ra i, P = u i.

    The efficiency counts against the motor; friction may take over part of it or all.
    """
    torque = _moment(preset, load, forearm) * math.cos(angle)
    current = torque / _torque_per_ampere(preset)
    voltage = float(preset.value("Ra")) * current
    return Hold(torque=torque, current=current, voltage=voltage, power=voltage * current)


def torque_margin(
    preset: Preset,
    *,
    load: float | None = None,
    angle: float = 0.0,
    resistance: float | None = None,
    forearm: Forearm | None = None,
) -> TorqueMargin:
    """The margin for a load in kg at an angle in rad, with an armature resistance in Ω other than the preset's."""
    ohms = float(preset.value("Ra")) if resistance is None else resistance
    limits, per_ampere = preset.limits, _torque_per_ampere(preset)
    currents = {"no limit is known": math.inf}
    if limits.voltage is not None:
        currents["voltage over resistance"] = float(limits.voltage) / ohms
    if limits.current_peak is not None:
        currents["the peak current"] = float(limits.current_peak)
    reason = min(currents, key=lambda name: currents[name])
    lasting = math.inf if limits.current_continuous is None else float(limits.current_continuous)
    return TorqueMargin(
        needed=abs(_moment(preset, load, forearm) * math.cos(angle)),
        available=per_ampere * currents[reason],
        lasting=per_ampere * min(lasting, currents[reason]),
        reason=reason,
    )


def require_liftable(preset: Preset, *, load: float | None = None, forearm: Forearm | None = None) -> TorqueMargin:
    """The margin with the arm horizontal; refuses a drive that cannot hold the load there.

    Raises:
        PlantError: with needed and available torque and the limit behind it; its value is the margin.
    """
    margin = torque_margin(preset, load=load, forearm=forearm)
    if not margin.lifts:
        raise PlantError(
            f"preset '{preset.name}' with its load",
            f"holding it horizontally takes {margin.needed:.4g} N m, the drive gives {margin.available:.4g} N m "
            f"({margin.available / margin.needed - 1:+.0%}), limited by {margin.reason}.",
            "Take a smaller load, a higher gear ratio or a stronger motor.",
            value=margin,
        )
    return margin


def no_load_speed(preset: Preset, voltage: float | None = None) -> float:
    """Speed of the joint in rad/s at a constant voltage in V without gravity: η N km u/(Ra B + η N² km kb).

    Raises:
        PlantError: if neither a voltage nor a limit of it is known.
    """
    if voltage is None:
        if preset.limits.voltage is None:
            raise PlantError(f"speed without load of '{preset.name}'", "its voltage limit is not known.", "Give one.")
        voltage = float(preset.limits.voltage)
    n, kb, ohms, drag = (float(preset.value(name)) for name in ("N", "kb", "Ra", "B"))
    per_ampere = _torque_per_ampere(preset)
    return per_ampere * voltage / (ohms * drag + per_ampere * n * kb)


def _torque_per_ampere(preset: Preset) -> float:
    return float(preset.value("eta") * preset.value("N") * preset.value("km"))


def _moment(preset: Preset, load: float | None, forearm: Forearm | None) -> float:
    link = forearm or rod(preset)
    values = {p.symbol: p.si_value for p in (*preset.parameters, *link.parameters)}
    if load is not None:
        values[preset.parameter("m2").symbol] = sp.Float(load)
    moment = preset.parameter("m2").symbol * preset.parameter("g").symbol * link.reach + link.moment
    return float(moment.subs(values))
