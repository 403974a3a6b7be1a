"""What the hand carries, from the torque that an observer cannot explain, with its uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ulna.base import PlantError
from ulna.plants.arm import rod
from ulna.plants.drive_preset import Preset

_STEEP = 0.05
"""Least |cos θ| at which gravity tells anything about the load."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadEstimate:
    """A load in kg at rest: the estimate and the least and largest load that fit the tolerances."""

    mass: float
    lower: float
    upper: float


def load_estimate(
    preset: Preset,
    torque: float,
    angle: float,
    *,
    design_load: float | None = None,
    resistance_tolerance: float = 0.2,
    friction: float = 0.0,
) -> LoadEstimate:
    """The load at rest from an estimated torque d̂ in N m beyond that of the design load, at an angle in rad.

    The observer infers the motor's torque from the voltage over the nominal resistance, so at rest
    d̂ = cos θ (G Ra/Ra₀ − G₀) ± friction and G = Ra₀/Ra (G₀ + (d̂ ± friction)/cos θ); m2 = (G − G_arm)/(g b).

    Args:
        design_load: in kg, what the observer was designed for; the preset's own where left out.
        resistance_tolerance: share by which Ra may differ from nominal, below 1.
        friction: Coulomb torque in N m that may hold part of the load.

    Raises:
        PlantError: where the forearm is so steep that gravity tells nothing, or for a tolerance of 1 or more.
    """
    lean = math.cos(angle)
    if abs(lean) < _STEEP:
        raise PlantError(
            f"load at {math.degrees(angle):.4g} deg", "the forearm is upright.", "Measure it nearer the horizontal."
        )
    if not 0 <= resistance_tolerance < 1:
        raise PlantError("resistance tolerance", f"it is {resistance_tolerance}.", "Give a share from 0 to below 1.")
    g, b = float(preset.value("g")), float(preset.value("b"))
    arm = float(rod(preset).moment.subs({p.symbol: p.si_value for p in preset.parameters}))
    designed = arm + (float(preset.value("m2")) if design_load is None else design_load) * g * b

    def mass(resistance: float, held: float) -> float:
        return ((designed + (torque + held) / lean) / resistance - arm) / (g * b)

    corners = [mass(1 + s * resistance_tolerance, f * friction) for s in (-1, 1) for f in (-1, 1)]
    return LoadEstimate(mass=mass(1.0, 0.0), lower=max(0.0, min(corners)), upper=max(corners))
