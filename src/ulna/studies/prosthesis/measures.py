"""What is read off the runs: how fast, how exact, at what current, energy, heat and ripple."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache

import numpy as np

from ulna.plants import Heating
from ulna.sim import last_entry, output_figures
from ulna.studies.prosthesis.plant import Bench
from ulna.studies.prosthesis.tasks import PERIOD, Task
from ulna.studies.prosthesis.trial import ANGLE, CURRENT, LIMITED, VOLTAGE, Runs

TREMOR = (4.0, 12.0)
"""Hz: the band of tremor, in which a prosthesis must not move by itself."""
SETTLED = math.radians(1.0)
"""Half-width of the band in which a motion counts as settled, rad."""
STEADY = 0.5
"""s at the end of a task over which the steady error is the mean."""
BRAKE_AFTER = 0.5
"""s within the band after which a brake would take over from the motor."""

UNITS: Mapping[str, str] = {
    "rise": "s",
    "settling": "s",
    "overshoot": "%",
    "steady_error": "deg",
    "rms_error": "deg",
    "peak_error": "deg",
    "peak_current": "A",
    "rms_current": "A",
    "energy": "J",
    "power": "W",
    "power_with_brake": "W",
    "warming": "K",
    "ripple": "deg",
    "chatter": "V",
    "limited": "%",
}
"""Unit of every measure, for tables and files."""


def measure(bench: Bench, task: Task, runs: Runs) -> dict[str, np.ndarray]:
    """(D,) of every measure; infinite where a motion never rises or settles, NaN where it does not apply.

    rise: 10 to 90 % of the way. settling: from the start of the motion, or the event, until the error stays within 1°,
    straight lines between the samples.
    overshoot: beyond the target, share of the way. steady_error: mean |error| of the last half second. energy: ∫ u i dt
    into the motor, what comes back counted. power: its mean. power_with_brake: the same with a brake that holds from
    half a second after settling on, the motor off. warming: of the winding at the end, two-node model from cold,
    constant resistance. ripple: RMS of the error in 4 to 12 Hz, from one second after the start. chatter: RMS of the
    voltage's change between samples. limited: share of samples at which the drive could not give what was asked.
    """
    error = runs[ANGLE] - task.reference[0]
    power = runs[VOLTAGE] * runs[CURRENT]
    distance = np.abs(runs[ANGLE] - task.reference[0, -1] if task.reaches else error)
    settled = np.maximum(0.0, last_entry(task.times, distance, SETTLED) - task.event)
    found = {
        **_way(task, runs[ANGLE]),
        "settling": settled,
        "steady_error": np.degrees(np.abs(error[:, -round(STEADY / PERIOD) :]).mean(axis=1)),
        "rms_error": np.degrees(np.sqrt(np.mean(error**2, axis=1))),
        "peak_error": np.degrees(np.abs(error).max(axis=1)),
        "peak_current": np.abs(runs[CURRENT]).max(axis=1),
        "rms_current": np.sqrt(np.mean(runs[CURRENT] ** 2, axis=1)),
        "energy": power.sum(axis=1) * PERIOD,
        "power": power.mean(axis=1),
        "power_with_brake": _braked(task, power, settled),
        "warming": _warming(bench, runs[CURRENT]),
        "ripple": np.degrees(_ripple(error)),
        "chatter": np.sqrt(np.mean(np.diff(runs[VOLTAGE], axis=1) ** 2, axis=1)),
        "limited": 100 * runs[LIMITED][:, 1:].mean(axis=1),
    }
    return {name: found[name] for name in UNITS}


def _way(task: Task, angle: np.ndarray) -> dict[str, np.ndarray]:
    nothing = np.full(len(angle), math.nan)
    if not task.reaches:
        return {"rise": nothing, "overshoot": nothing}
    start, target = task.reference[0, 0], task.reference[0, -1]
    progress = (angle - start) / (target - start)
    first = np.where((progress >= 0.1).any(axis=1), (progress >= 0.1).argmax(axis=1), math.inf)
    done = np.where((progress >= 0.9).any(axis=1), (progress >= 0.9).argmax(axis=1), math.inf)
    with np.errstate(invalid="ignore"):
        rise = np.where(np.isfinite(done), (done - first) * PERIOD, math.inf)
    ends = angle[:, -1], angle.min(axis=1), angle.max(axis=1)
    return {"rise": rise, "overshoot": 100 * output_figures(target, start, *ends, 0.0).overshoot}


def _braked(task: Task, power: np.ndarray, settled: np.ndarray) -> np.ndarray:
    """Mean power if the brake takes over once the arm has been within its band for `BRAKE_AFTER`."""
    engaged = np.minimum(task.event + settled + BRAKE_AFTER, task.count * PERIOD)
    until = np.arange(power.shape[1]) * PERIOD < engaged[:, None]
    return (power * until).mean(axis=1)


def _ripple(error: np.ndarray) -> np.ndarray:
    from scipy.signal import butter, sosfilt

    sections = butter(2, TREMOR, btype="bandpass", fs=1 / PERIOD, output="sos")
    return np.sqrt(np.mean(np.asarray(sosfilt(sections, error, axis=1))[:, round(1 / PERIOD) :] ** 2, axis=1))


def _warming(bench: Bench, current: np.ndarray) -> np.ndarray:
    """Rise of the winding at the end in K, NaN where the preset has no thermal data; exact for held losses."""
    heating = bench.preset.heating
    if heating is None:
        return np.full(len(current), math.nan)
    step = 50
    count = (current.shape[1] - 1) // step * step
    loss = bench.value("Ra") * (current[:, :count] ** 2).reshape(len(current), -1, step).mean(axis=2)
    grow, feed = _thermal_step(heating, step * PERIOD)
    rise = np.zeros((len(current), 2))
    for column in loss.T:
        rise = rise @ grow.T + column[:, None] * feed
    return rise[:, 0]


@cache
def _thermal_step(heating: Heating, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    from scipy.linalg import expm

    r_wh, r_ha, c_w, c_h = (
        float(value)
        for value in (
            heating.winding_to_housing,
            heating.housing_to_ambient,
            heating.winding_capacity,
            heating.housing_capacity,
        )
    )
    matrix = np.zeros((3, 3))
    matrix[0] = [-1 / (r_wh * c_w), 1 / (r_wh * c_w), 1 / c_w]
    matrix[1] = [1 / (r_wh * c_h), -1 / (r_wh * c_h) - 1 / (r_ha * c_h), 0.0]
    grown = expm(matrix * seconds)
    return grown[:2, :2], grown[:2, 2]
