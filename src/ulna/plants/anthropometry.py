"""Forearm and hand of a man from body mass, and the elbow's range of motion as plant angles."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from importlib.resources import files
from typing import Any

import sympy as sp

from ulna.base import PlantError
from ulna.plants.arm import Forearm, measured_forearm
from ulna.symbolic.formulas import exact


@dataclass(frozen=True, slots=True, kw_only=True)
class RangeOfMotion:
    """Angles the joint may take, in rad, down-positive from the horizontal: 90° − flexion."""

    name: str
    lower: float
    upper: float
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class BodySegments:
    """Forearm and hand as one rigid body about the elbow.

    Attributes:
        mass: in kg; inertia: about the elbow in kg m²; first_moment: mass times distance of its centre in kg m.
        hand_radius: centre of mass of the hand from the elbow in m, where a grasped load is.
        source: of the shares.
    """

    mass: sp.Expr
    inertia: sp.Expr
    first_moment: sp.Expr
    hand_radius: sp.Expr
    source: str


def body_segments(body_mass: Any) -> BodySegments:
    """Forearm and hand of a man of that mass in kg: shares of de Leva 1996, his mean segment lengths.

    Raises:
        PlantError: for a mass that is not a positive number.
    """
    try:
        mass = exact(body_mass)
    except (TypeError, ValueError):
        raise PlantError("body mass", f"{body_mass!r} is not a finite number.", "Give kilograms.") from None
    if not mass > 0:
        raise PlantError("body mass", f"it is {body_mass} kg.", "Give a positive number of kilograms.")
    data = _data()
    total, inertia, first, start, radius = (sp.Integer(0),) * 5
    for name in ("forearm", "hand"):
        share, com, gyration, length = (exact(data[name][key]) for key in ("mass", "com", "gyration", "length_m"))
        radius = start + com * length
        total += share * mass
        first += share * mass * radius
        inertia += share * mass * (radius**2 + (gyration * length) ** 2)
        start += length
    return BodySegments(mass=total, inertia=inertia, first_moment=first, hand_radius=radius, source=data["source"])


def anthropometric_forearm(body_mass: Any, *, gravity: Any = "9.8") -> Forearm:
    """The forearm and hand of a man of that mass in kg as a link; the load sits at length b of the preset.

    Raises:
        PlantError: for a body mass that is not positive.
    """
    segments = body_segments(body_mass)
    return measured_forearm(
        inertia=segments.inertia, moment=segments.first_moment * exact(gravity), source=segments.source
    )


def range_of_motion(name: str) -> RangeOfMotion:
    """The elbow's `passive`, `functional` or `contemporary` range.

    Raises:
        PlantError: for an unknown name.
    """
    table = _data()["range_of_motion"]
    if name not in table:
        raise PlantError(f"range of motion '{name}'", "there is none of this name.", f"Known: {', '.join(table)}.")
    least, most = table[name]["degrees"]
    return RangeOfMotion(
        name=name,
        lower=math.radians(90.0 - float(most)),
        upper=math.radians(90.0 - float(least)),
        source=table[name]["source"],
    )


@cache
def _data() -> dict[str, Any]:
    text = (files("ulna.plants") / "hardware" / "anthropometry.toml").read_text(encoding="utf-8")
    return tomllib.loads(text, parse_float=Decimal)
