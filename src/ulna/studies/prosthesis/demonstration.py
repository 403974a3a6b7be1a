"""From muscle to motion: a recording, the pipeline, the intent, and the load-robust controller that follows it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ulna.base import DesignError
from ulna.studies.prosthesis.contenders import contenders, tuned_numbers
from ulna.studies.prosthesis.emg_pipeline import activations, calibrated, fresh_memory
from ulna.studies.prosthesis.emg_signal import Recording, SyntheticMuscles, synthetic_recording
from ulna.studies.prosthesis.intent import IntentMemory, ProportionalSpeed, followable, read_intent
from ulna.studies.prosthesis.plant import Bench, draws_of
from ulna.studies.prosthesis.tasks import PERIOD, Task
from ulna.studies.prosthesis.trial import ANGLE, run_trial

SHOWN = "load_robust"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Demonstration:
    """One recording from muscle to motion; (N,) times in s, (N, 2) samples in V and activations, (N,) angles in rad."""

    source: str
    times: np.ndarray
    samples: np.ndarray
    activation: np.ndarray
    wanted: np.ndarray
    reached: np.ndarray


def demonstrate(
    bench: Bench,
    recording: Recording | None = None,
    *,
    calibration: Recording | None = None,
    source: str = "",
) -> Demonstration:
    """Drive the nominal arm by a recording, or by a synthetic one: lift, wait, lower, a short lift.

    Args:
        calibration: the same muscles at their greatest contraction, both at once, which is full activation. Left out,
            the recording is calibrated on itself: full activation is the mean envelope of its strongest tenth.
        source: where the recording comes from, for the page.

    Raises:
        DesignError: a recording that is too short or silent, a calibration without recording or at another rate.
    """
    if calibration is not None and (
        recording is None or not math.isclose(recording.rate, calibration.rate, rel_tol=1e-3)
    ):
        raise DesignError(
            "a calibration of muscle signals",
            "there is no recording to calibrate."
            if recording is None
            else f"it has {calibration.rate:g} samples a second, the recording {recording.rate:g}.",
            "Record both with the same amplifier at the same rate.",
        )
    if recording is None:
        recording, source = _synthetic(), "synthetic"
        pipeline = calibrated(synthetic_recording(SyntheticMuscles(seed=9), np.ones(4000), np.ones(4000)))
    else:
        pipeline = calibrated(calibration or _strongest(recording))
    activation, _ = activations(pipeline, recording.samples, fresh_memory(pipeline))
    memory = IntentMemory(position=0.0)
    speed = ProportionalSpeed(speed=bench.motion.speed)
    wish, _ = read_intent(speed, activation, memory, rate=recording.rate, limits=bench.motion)
    times = np.arange(0.0, recording.times[-1], PERIOD)
    position = np.interp(times, recording.times, wish.position)
    nothing = np.zeros(len(times))
    task = Task(
        key="emg",
        title="driven by muscles",
        reference=followable(position, 0.0, 1 / PERIOD),
        load=nothing,
        push=nothing,
        start=0.0,
        event=0.0,
    )
    contender = next(c for c in contenders(bench) if c.key == SHOWN)
    # A second plant beside it, so that the compiled loop of the comparison serves.
    runs = run_trial(bench, contender, tuned_numbers(bench, contender), task, draws_of(bench, 2))
    every = 5
    at = times[::every]
    rows = np.minimum(np.searchsorted(recording.times, at), len(activation) - 1)
    return Demonstration(
        source=source,
        times=at,
        samples=recording.samples[rows],
        activation=activation[rows],
        wanted=position[::every],
        reached=runs[ANGLE][0, ::every],
    )


def _synthetic() -> Recording:
    rate = 1000.0
    times = np.arange(0.0, 8.0, 1 / rate)
    flexor, extensor = np.zeros_like(times), np.zeros_like(times)
    for muscle, start, end, effort in ((flexor, 1.0, 2.0, 0.6), (extensor, 3.5, 5.0, 0.7), (flexor, 6.0, 6.5, 0.9)):
        muscle[(times >= start) & (times < end)] = effort
    return synthetic_recording(SyntheticMuscles(rate=rate, seed=4), flexor, extensor)


def _strongest(recording: Recording) -> Recording:
    """The loudest samples of either channel, enough of them to calibrate on."""
    loud = np.sort(np.abs(recording.samples - recording.samples.mean(axis=0)), axis=0)[::-1]
    need = max(int(2 * recording.rate) + 1, len(loud) // 10)
    if len(loud) < need:
        return recording
    level = np.sqrt(np.mean(loud[:need] ** 2, axis=0))
    generator = np.random.default_rng(0)
    return Recording(rate=recording.rate, samples=level * generator.standard_normal((need, 2)))
