"""One controller for each preset that needs no retuning from no load to 1.5 times the nominal (5 kg for the paper)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import sympy as sp

from ulna.base import PlantError
from ulna.design import (
    AbstractReference,
    LoadRobust,
    LoopGrid,
    Poles,
    close_loop,
    load_robust_compensator,
    loop_grid,
    sampled_grid,
)
from ulna.plants import Preset, arm_with_drive
from ulna.system import Signal

LOAD_TORQUE = Signal(name="load_torque", unit="N*m", text="torque that the design load does not explain")
SPREAD = (0.8, 1.2)
"""Armature resistance over its nominal value: tolerance and warming."""
STEEPEST = np.radians(86.0)
"""Largest angle from the horizontal, either side."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RobustTuning:
    """Design load in kg (None: the nominal one), poles of law and observer, states taken as fast, range of loads.

    Found by a search for the worst eigenvalue over loads, resistances and angles, of the continuous loop and of the
    loop sampled at 1 kHz with one sample of delay together, with observer poles no faster than 200 rad/s.
    """

    design_load: str | None
    law: tuple[str, ...]
    observer: tuple[str, ...]
    fast: tuple[str, ...]
    heaviest: float


_REAL = RobustTuning(design_load=None, law=("-12",) * 2, observer=("-100",) * 3, fast=("i",), heaviest=1.5)
_PAPER = RobustTuning(
    design_load="1",
    law=("-6.5+3j", "-6.5-3j", "-24"),
    observer=("-185+60j", "-185-60j") * 2,
    fast=(),
    heaviest=1.0,
)
TUNINGS: Mapping[str, RobustTuning] = MappingProxyType(
    {"paper": _PAPER, "bench_servo": _REAL, "transhumeral_elbow": _REAL, "human_scale": _REAL}
)
"""By preset; `heaviest` is in nominal loads."""


def load_robust_design(preset: Preset, *, reference: AbstractReference | None = None) -> LoadRobust:
    """The load-robust compensator of a preset; its estimate `load_torque_hat` is in N m.

    Args:
        reference: `SetPoint()` where left out.

    Raises:
        PlantError: for a preset without a tuning.
    """
    tuning = _tuning(preset)
    plant = arm_with_drive(preset)
    if tuning.design_load is not None:
        plant = plant.with_parameters({"m2": sp.Rational(tuning.design_load)})
    definitions = {d.name: d.expression for d in plant.definitions}
    inertia = definitions["J"] + preset.value("N") ** 2 * preset.value("Jm")
    return load_robust_compensator(
        plant,
        {"omega": 1 / inertia.subs(plant.values)},
        law=Poles(*tuning.law),
        observer=Poles(*tuning.observer),
        fast=tuning.fast,
        period=None if preset.limits.period is None else float(preset.limits.period),
        reference=reference,
        disturbance=LOAD_TORQUE,
    )


def robust_grid(
    preset: Preset, design: LoadRobust, *, counts: tuple[int, int, int] = (41, 9, 35), period: float | None = None
) -> LoopGrid:
    """The loop of a design over loads, resistances and angles; with a period, sampled with one sample of delay.

    Args:
        counts: numbers of loads (0 … heaviest), resistances (±20 %), set points (±86°).
    """
    plant = arm_with_drive(preset)
    heaviest = _tuning(preset).heaviest * float(preset.value("m2"))
    over = {
        "m2": np.linspace(0.0, heaviest, counts[0]),
        "Ra": float(preset.value("Ra")) * np.linspace(*SPREAD, counts[1]),
        "y_ref": np.linspace(-STEEPEST, STEEPEST, counts[2]),
    }
    guess = {"theta": "y_ref", "theta_hat": "y_ref"}
    if period is None:
        return loop_grid(close_loop(plant, design.compensator).system, over, guess=guess)
    return sampled_grid(plant, design.compensator, over, period=period, guess=guess)


def _tuning(preset: Preset) -> RobustTuning:
    if preset.name not in TUNINGS:
        raise PlantError(
            f"load-robust design of preset '{preset.name}'", "it has no tuning.", f"Known: {', '.join(TUNINGS)}."
        )
    return TUNINGS[preset.name]
