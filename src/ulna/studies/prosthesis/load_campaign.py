"""The load-robust loop as on hardware, for random loads, resistances and set points: does every run come to rest?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ulna.models import Preset, arm_with_drive
from ulna.sim import EnsembleResult, Quantiser, Sampled, Saturation, run_ensemble
from ulna.studies.prosthesis.load_robust_designs import SPREAD, TUNINGS, load_robust_design

COUNTS = 8192
"""Encoder positions per turn where the preset names none (13 bits)."""
VOLTAGE = 60.0
"""V, the limit of the paper's arm, which names none: a choice."""
PERIOD = 1e-3
"""s, where the preset names none."""
HORIZON = 6.0
"""s of every run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadCampaign:
    """Runs of one controller on many plants.

    Attributes:
        preset: the arm; loads (N,) kg; resistances (N,) ohm; set_points (N,) rad: what was drawn.
        runs: how they went.
    """

    preset: Preset
    loads: np.ndarray
    resistances: np.ndarray
    set_points: np.ndarray
    runs: EnsembleResult

    @property
    def worst_error(self) -> float:
        """Largest |angle − set point| at the end, degrees; infinite if a run did not reach its end."""
        if not bool(np.all(self.runs.finished)):
            return float("inf")
        return float(np.degrees(np.abs(self.runs.steady_error[:, 0]).max()))


def load_campaign(preset: Preset, runs: int, *, seed: int = 0, threads: int | None = None) -> LoadCampaign:
    """The preset's load-robust compensator at 1 kHz with encoder, voltage limit and one sample of delay.

    Every run starts at rest in the horizontal without current; its load (0 … heaviest), armature resistance (±20 %)
    and set point (±60°) are drawn evenly.

    Args:
        preset: an arm with a load-robust design.
        runs: how many.
        seed: of the draws.
        threads: as of `run_ensemble`.

    Raises:
        PlantError: for a preset without a tuning.
        OptionalDependencyError: without Numba, the extra [campaign].
    """
    design = load_robust_design(preset)
    whole = design.compensator
    random = np.random.default_rng(seed)
    heaviest = TUNINGS[preset.name].heaviest * float(preset.value("m2"))
    loads = random.uniform(0.0, heaviest, runs)
    resistances = float(preset.value("Ra")) * random.uniform(*SPREAD, runs)
    set_points = np.radians(random.uniform(-60.0, 60.0, runs))
    limits = preset.limits
    period = PERIOD if limits.period is None else float(limits.period)
    volts = VOLTAGE if limits.voltage is None else float(limits.voltage)
    clock = Sampled(
        controller=whole.law.system,
        estimator=whole.observer.system,
        period=period,
        delay=period,
        saturation=Saturation(lower=-volts, upper=volts),
        sensors=Quantiser(step=2.0 * np.pi / (limits.encoder_counts or COUNTS)),
        plant_steps=_steps(preset, period),
        references={"y_ref": 0.0},
    )
    done = run_ensemble(
        arm_with_drive(preset),
        np.zeros((runs, 3)),
        HORIZON,
        time=clock,
        parameters={"m2": loads, "Ra": resistances},
        references={"y_ref": set_points},
        targets={"y": set_points},
        threads=threads,
    )
    return LoadCampaign(preset=preset, loads=loads, resistances=resistances, set_points=set_points, runs=done)


def _steps(preset: Preset, period: float) -> int:
    """Runge-Kutta steps a period: the electrical time constant may be a small part of it, and needs two of its own."""
    electrical = float(preset.value("La") / (preset.value("Ra") * SPREAD[1]))
    return max(1, int(np.ceil(2.0 * period / electrical)))
