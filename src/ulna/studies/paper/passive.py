"""The passive forearm, (1) to (12): where it rests, how it swings there, and how far the linear equation reaches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ulna.plants import SmallOscillation, SmallOscillations, model, small_oscillations
from ulna.sim import Trajectory, simulate
from ulna.system import Parameter, System

SECONDS = 2.0
_SAMPLES = 401
_RANGE = (-2.0 * math.pi, 2.0 * math.pi)
_DISPLACEMENTS = (10.0, 45.0, 90.0)
_WEAKER = 10
"""How many times weaker the biceps of the second example is: then the forearm has several equilibria."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Release:
    """The forearm let go at a displacement from its equilibrium.

    Attributes:
        degrees: the displacement.
        nonlinear, linear: the angle by (6) and by (11), each under the name of the angle.
        largest_difference: between the two on the way, in degrees.
    """

    degrees: float
    nonlinear: Trajectory
    linear: Trajectory
    largest_difference: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Passive:
    """What (10) to (12) say in numbers.

    Attributes:
        forearm: the plant; chosen: its parameters that the paper gives no numbers for.
        rests: every static equilibrium with its small oscillation; weaker: the same with a weaker biceps.
        weaker_by: how many times weaker.
        releases: nonlinear against linear response about the first equilibrium.
    """

    forearm: System
    chosen: tuple[Parameter, ...]
    rests: SmallOscillations
    weaker: SmallOscillations
    weaker_by: int
    releases: tuple[Release, ...]


def passive_forearm() -> Passive:
    """Return the study of the forearm with the catalogue's parameters."""
    forearm = model("forearm")
    spring = next(p for p in forearm.parameters if p.name == "c2")
    strength = spring.si_value
    if strength is None:
        raise ArithmeticError("the biceps of the catalogue's forearm has a strength")
    weaker = forearm.with_parameters({"c2": strength / _WEAKER})
    rests = small_oscillations(forearm, _RANGE)
    return Passive(
        forearm=forearm,
        chosen=tuple(p for p in forearm.parameters if p.source.startswith("choice")),
        rests=rests,
        weaker=small_oscillations(weaker, _RANGE),
        weaker_by=_WEAKER,
        releases=_releases(forearm, rests.points[0], _DISPLACEMENTS),
    )


def rest_angle(oscillation: SmallOscillation) -> float:
    """The angle of the equilibrium, in rad."""
    return float(next(iter(oscillation.equilibrium.values())))


def _releases(forearm: System, about: SmallOscillation, displacements: Sequence[float]) -> tuple[Release, ...]:
    times = np.linspace(0.0, SECONDS, _SAMPLES)
    angle = forearm.states[0].name
    rest, linear_system = rest_angle(about), about.linear.with_values()
    found = []
    for degrees in displacements:
        start = math.radians(degrees)
        nonlinear = simulate(forearm, (rest + start, 0.0), times)
        linear = simulate(linear_system, (start, 0.0), times)
        difference = math.degrees(float(np.abs(nonlinear[angle] - linear[angle]).max()))
        found.append(Release(degrees=degrees, nonlinear=nonlinear, linear=linear, largest_difference=difference))
    return tuple(found)
