"""From muscle to motion: a recording, the pipeline, the intent, and the load-robust controller that follows it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ulna.base import DesignError
from ulna.studies.prosthesis.contenders import contenders, tuned_numbers
from ulna.studies.prosthesis.emg_pipeline import Pipeline, activations, calibrated, calibrated_on_itself, fresh_memory
from ulna.studies.prosthesis.emg_signal import Recording, SyntheticMuscles, synthetic_recording
from ulna.studies.prosthesis.intent import IntentMemory, ProportionalSpeed, followable, read_intent
from ulna.studies.prosthesis.plant import Bench, draws_of
from ulna.studies.prosthesis.tasks import PERIOD, Task
from ulna.studies.prosthesis.trial import ANGLE, run_trial

SHOWN = "load_robust"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Demonstration:
    """One recording from muscle to motion; (N,) times in s, (N, 2) samples and activations, (N,) angles in rad.

    `said` tells in one line what was recorded and what was assumed about it; the samples are in `unit`, "" for unknown.
    """

    said: str
    unit: str
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
    mains: float = 50.0,
) -> Demonstration:
    """Drive the nominal arm by a recording, or by a synthetic one: lift, wait, lower, a short lift.

    Args:
        calibration: the same muscles at their greatest contraction, both at once, which is full activation. Left out,
            the recording is calibrated on itself: full activation is the mean envelope of its strongest tenth.
        mains: frequency that the notch takes out, Hz.

    Raises:
        DesignError: a recording that is too short or silent, a calibration without recording or of another kind.
    """
    pipeline, recording, said = _calibrated(recording, calibration, mains)
    activation, _ = activations(pipeline, recording.samples, fresh_memory())
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
        said=said,
        unit=recording.unit,
        times=at,
        samples=recording.samples[rows],
        activation=activation[rows],
        wanted=position[::every],
        reached=runs[ANGLE][0, ::every],
    )


def _calibrated(
    recording: Recording | None, calibration: Recording | None, mains: float
) -> tuple[Pipeline, Recording, str]:
    if recording is None:
        if calibration is not None:
            raise DesignError("a calibration of muscle signals", "there is no recording to calibrate.")
        recording = _synthetic()
        muscles = SyntheticMuscles(seed=9)
        greatest = synthetic_recording(muscles, np.ones(4000), np.ones(4000))
        return calibrated(greatest, mains=mains), recording, "synthetic muscles"
    if calibration is None:
        pipeline, found = calibrated_on_itself(recording, mains=mains)
        return pipeline, recording, "; ".join(each for each in (recording.said, found) if each)
    for what, here, there in (
        ("samples a second", recording.rate, calibration.rate),
        ("muscles", len(recording.muscles), len(calibration.muscles)),
        ("as unit", recording.unit or "none", calibration.unit or "none"),
        ("as kind", _kind(recording), _kind(calibration)),
    ):
        alike = (
            math.isclose(here, there, rel_tol=1e-3) if isinstance(here, float) and isinstance(there, float) else None
        )
        if not (here == there if alike is None else alike):
            raise DesignError(
                "a calibration of muscle signals",
                f"it has {_short(there)} {what}, the recording {_short(here)}.",
                "Record both with the same amplifier at the same rate.",
            )
    rest = (0.0, 0.0)
    if recording.envelope:
        low = np.quantile(recording.samples, 0.1, axis=0)
        rest = (max(0.0, float(low[0])), max(0.0, float(low[1])))
    return calibrated(calibration, mains=mains, rest=rest), recording, recording.said


def _kind(recording: Recording) -> str:
    return "envelopes" if recording.envelope else "raw signals"


def _short(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:g}"


def _synthetic() -> Recording:
    rate = 1000.0
    times = np.arange(0.0, 8.0, 1 / rate)
    flexor, extensor = np.zeros_like(times), np.zeros_like(times)
    for muscle, start, end, effort in ((flexor, 1.0, 2.0, 0.6), (extensor, 3.5, 5.0, 0.7), (flexor, 6.0, 6.5, 0.9)):
        muscle[(times >= start) & (times < end)] = effort
    return synthetic_recording(SyntheticMuscles(rate=rate, seed=4), flexor, extensor)
