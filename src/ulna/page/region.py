"""The proved region of a certificate as outlines in the planes of two states."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
import sympy as sp

from ulna.base import SimulationError, UlnaError
from ulna.certify import Certificate, SampledCertificate
from ulna.symbolic.compiling import batch_vector
from ulna.symbolic.formulas import parse_formula
from ulna.system import System

_DIRECTIONS, _FIRST, _GROWTH, _OUTWARDS, _HALVINGS = 96, 1e-3, 1.05, 320, 40
"""Rays from the point of rest; the first step along one, its growth and how many of them; halvings on the way back."""


def region_of(certificate: Certificate | SampledCertificate, plant: System) -> dict[str, Any]:
    """For each pair of the plant's states the outline of V ≤ level with everything else at rest, and where that is.

    Along every ray from the point of rest V is followed to where it first leaves the level, so that all of what is
    drawn belongs to the proved region. Of a loop on its processor it is the box in which runs start.

    Raises:
        SimulationError: a certificate of other states, or one without a region.
    """
    names = [s.name for s in plant.states]
    if not set(names) <= set(certificate.states):
        found = f"it is about {', '.join(certificate.states)}; the plant has {', '.join(names)}."
        raise SimulationError(f"the certificate of '{certificate.name}'", found, "Prove the loop that is shown.")
    if isinstance(certificate, SampledCertificate):
        return _start_box(certificate, names)
    if not certificate.P or not certificate.level:
        return {
            "outlines": [],
            "rest": {},
            "text": "From every start the run is proved to converge to the equilibrium.",
        }
    level, value, rest = _function(certificate)
    outlines = []
    for x, y in combinations(names, 2):
        places = [certificate.states.index(name) for name in (x, y)]
        outlines.append({"x": x, "y": y, "points": _edge(value, rest, places, level)})
    text = "From inside the green line, all else at rest, every run is proved to come to rest."
    return {"outlines": outlines, "rest": dict(zip(certificate.states, map(float, rest), strict=True)), "text": text}


def _start_box(certificate: SampledCertificate, names: Sequence[str]) -> dict[str, Any]:
    # The plant's states come first, then the memory of the processor.
    rest = {name: float(Fraction(certificate.center[k])) for k, name in enumerate(certificate.states)}
    sides = {name: float(Fraction(certificate.start[k])) for k, name in enumerate(certificate.states)}
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))
    outlines = [
        {"x": x, "y": y, "points": [[rest[x] + a * sides[x], rest[y] + b * sides[y]] for a, b in corners]}
        for x, y in combinations(names, 2)
    ]
    text = "From inside the green box, the processor's memory at rest, every run is proved to end near rest."
    return {"outlines": outlines, "rest": rest, "text": text}


def _function(certificate: Certificate) -> tuple[float, Any, np.ndarray]:
    """(level, V of the states, the states at rest)."""
    try:
        where = f"the certificate of '{certificate.name}'"
        states = {name: sp.Symbol(name, real=True) for name in certificate.states}
        moved = {name: sp.Symbol(name, real=True) for name in certificate.coordinates}
        forward = [parse_formula(text, states, where=where) for text in certificate.forward]
        inverse = [parse_formula(text, moved, where=where) for text in certificate.inverse]
        center = [sp.Rational(text) for text in certificate.center]
        P = np.array([[float(sp.Rational(text)) for text in row] for row in certificate.P])
        level = float(sp.Rational(certificate.level))
        at = dict(zip(moved.values(), center, strict=True))
        rest = np.array([float(each.xreplace(at)) for each in inverse])
    except (UlnaError, TypeError, ValueError) as error:
        raise SimulationError(f"the certificate of '{certificate.name}'", f"{error}") from None
    evaluate = batch_vector("certificate", forward, list(states.values()))
    middle = np.array([float(each) for each in center])

    def value(rows: np.ndarray) -> np.ndarray:
        away = evaluate(dict(zip(certificate.states, rows.T, strict=True))) - middle
        return np.einsum("ki,ij,kj->k", away, P, away)

    return level, value, rest


def _edge(value: Any, rest: np.ndarray, places: list[int], level: float) -> list[list[float]]:
    """Where rays from the point of rest first leave the level, one after the other."""
    angles = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    rays = np.zeros((_DIRECTIONS, len(rest)))
    rays[:, places] = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    inside, outside, open_ = np.zeros(_DIRECTIONS), np.full(_DIRECTIONS, _FIRST), np.ones(_DIRECTIONS, dtype=bool)
    for _ in range(_OUTWARDS):
        open_ &= value(rest + outside[:, None] * rays) <= level
        inside = np.where(open_, outside, inside)
        outside = np.where(open_, outside * _GROWTH, outside)
    for _ in range(_HALVINGS):
        middle = (inside + outside) / 2
        held = value(rest + middle[:, None] * rays) <= level
        inside, outside = np.where(held, middle, inside), np.where(held, outside, middle)
    return [[float(each) for each in row] for row in (rest + inside[:, None] * rays)[:, places]]
