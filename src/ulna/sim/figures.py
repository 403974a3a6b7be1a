"""What figures of a run mean: settling, overshoot, steady and peak error, effort. Every engine's answers are these.

The way of an output is target − first value. Reference: IEC 60050-351, 351-45-27 ff. (step response).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

BAND = 0.02
"""Half-width of the settling band as a fraction of the way."""

FIGURE_NAMES = ("settling_time", "overshoot", "steady_error", "peak_error")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OutputFigures:
    """Figures of outputs, numbers or arrays of one shape, in SI. NaN: does not apply, the output started on its target.

    Attributes:
        overshoot: farthest beyond the target as a fraction of the way; 0 where it never passes the target.
        settling_time: s from the start until it stays in the band; infinite where it does not by the end.
        steady_error: last value − target. peak_error: largest |value − target|.
    """

    overshoot: Any
    settling_time: Any
    steady_error: Any
    peak_error: Any


def output_figures(
    target: Any, first: Any, last: Any, least: Any, most: Any, settled: Any, finished: Any = True
) -> OutputFigures:
    """The figures of outputs of which the first, last, least and most value are known.

    Args:
        target, first, last, least, most: SI, numbers or arrays that broadcast.
        settled: s, the last entry into the band. finished: whether the run reached its end.
    """
    way = np.asarray(target - first, dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        farthest = np.where(way > 0, most - first, least - first) / way
    stays = np.logical_and(~outside(last, target, first), finished)
    return OutputFigures(
        overshoot=np.where(way == 0.0, np.nan, np.maximum(0.0, farthest - 1.0)),
        settling_time=np.where(way == 0.0, np.nan, np.where(stays, settled, np.inf)),
        steady_error=np.asarray(last - target),
        peak_error=np.asarray(np.maximum(np.abs(least - target), np.abs(most - target))),
    )


def ended_inside(found: Any) -> np.ndarray:
    """Whether outputs ended in their band.

    One that started on its target, where no way measures the band, has to come back from where it went.

    Args:
        found: `OutputFigures`, or whatever has arrays of these names.
    """
    returned = np.abs(found.steady_error) <= BAND * found.peak_error
    return np.where(np.isnan(found.overshoot), returned, np.isfinite(found.settling_time))


def outside(value: Any, target: Any, first: Any) -> Any:
    """Whether a value lies outside the band around the target; a NaN does."""
    return ~(np.abs(value - target) <= BAND * np.abs(target - first))


def last_entry(times: np.ndarray, distance: np.ndarray, band: float) -> np.ndarray:
    """(...) s from the first time after which the distance stays within the band, straight lines between; 0 if always.

    Infinite where it ends outside. times: (N,). distance: (..., N).
    """
    beyond = ~(distance <= band)
    last = len(times) - 1 - beyond[..., ::-1].argmax(axis=-1)
    before = np.minimum(last, len(times) - 2)
    low, high = (np.take_along_axis(distance, at[..., None], axis=-1)[..., 0] for at in (before, before + 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        entry = times[before] + (band - low) / (high - low) * (times[before + 1] - times[before]) - times[0]
    return np.where(beyond.any(axis=-1), np.where(last > before, np.inf, entry), 0.0)


def crossing(times: np.ndarray, values: np.ndarray, before: int, level: float) -> float:
    """Where the line from sample `before` to the next one meets the level."""
    low, high = float(values[before]), float(values[before + 1])
    return float(times[before]) + (level - low) / (high - low) * float(times[before + 1] - times[before])
