"""How a signal spreads over time: quantiles at each instant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.campaign.runs import path
from ulna.campaign.store import CampaignResult


@dataclass(frozen=True, slots=True, kw_only=True)
class Fan:
    """Quantiles of a signal over time.

    Attributes:
        signal, unit: what spreads. times: (N,) s. levels: (L,). values: (L, N) in SI.
        runs: how many are in it. early: how many of them ended early and count up to there.
    """

    signal: str
    unit: str
    times: np.ndarray
    levels: tuple[float, ...]
    values: np.ndarray
    runs: int
    early: int


def fan(
    result: CampaignResult,
    signal: str,
    *,
    runs: int = 200,
    levels: Sequence[float] = (0.05, 0.25, 0.5, 0.75, 0.95),
) -> Fan:
    """The spread of a signal over some runs of the campaign, evenly chosen and computed anew.

    Raises:
        CampaignError: no run, or levels outside [0, 1].
        SimulationError: an unknown signal.
    """
    if runs < 1 or not all(0 <= level <= 1 for level in levels):
        raise CampaignError(
            f"fan(runs={runs}, levels={tuple(levels)})", "expected one run or more, and levels in [0, 1]."
        )
    experiment = result.experiment
    chosen = np.unique(np.linspace(0, result.runs - 1, min(runs, result.runs)).astype(np.int64))
    times = np.linspace(0.0, experiment.horizon, experiment.measures.samples + 1)
    rows = np.full((len(chosen), len(times)), np.nan)
    early = 0
    for row, number in zip(rows, chosen, strict=True):
        trajectory = path(experiment, int(number))
        early += not trajectory.outcome.finished
        inside = times <= trajectory.times[-1]
        row[inside] = np.interp(times[inside], trajectory.times, trajectory[signal])
    system = experiment.system
    units = {s.name: s.unit for s in (*system.states, *system.outputs, *system.inputs)}
    alive = ~np.isnan(rows).all(axis=0)
    values = np.full((len(levels), len(times)), np.nan)
    values[:, alive] = np.nanquantile(rows[:, alive], levels, axis=0)
    return Fan(
        signal=signal,
        unit=units.get(signal, ""),
        times=times,
        levels=tuple(levels),
        values=values,
        runs=len(chosen),
        early=early,
    )
