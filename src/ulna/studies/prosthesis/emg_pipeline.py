"""Muscle signals to activations: band-pass, notch, rectify, envelope, normalise, dead band; causal, chunk by chunk."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from ulna.base import DesignError
from ulna.studies.prosthesis.emg_signal import BAND, Recording, check_rate


@dataclass(frozen=True, slots=True, kw_only=True)
class Pipeline:
    """Settings of the way from samples (V) to activations in [0, 1].

    Args:
        rate: samples a second.
        contraction: (flexor, extensor) envelope at the greatest voluntary contraction, V; from `calibrated`.
        mains: frequency that the notch takes out, Hz, with its second harmonic where the band holds it.
        envelope: cut-off of the envelope's low-pass, Hz (second order).
        dead_band: activations below this share are 0, and the rest is stretched to begin at 0 there.

    Raises:
        DesignError: a share outside [0, 1), a contraction that is not positive.
        RecordingError: a rate too low for the band.
    """

    rate: float
    contraction: tuple[float, float]
    mains: float = 50.0
    envelope: float = 3.0
    dead_band: float = 0.08

    def __post_init__(self) -> None:
        check_rate("a pipeline", self.rate)
        if not (0 <= self.dead_band < 1):
            raise DesignError(f"a dead band of {self.dead_band}", "it lies in [0, 1).")
        if not all(0 < level < math.inf for level in self.contraction):
            raise DesignError(
                f"contractions {self.contraction}",
                "each must be positive.",
                "Record a full contraction of each muscle.",
            )
        for name, value in (("mains", self.mains), ("envelope", self.envelope)):
            if not (0 < value < self.rate / 2):
                raise DesignError(f"a pipeline with {name} {value:g} Hz", f"it lies in (0, {self.rate / 2:g}).")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FilterMemory:
    """What the filters remember between chunks: (sections, 2, 2) of each of the two stages."""

    raw: np.ndarray
    envelope: np.ndarray


def fresh_memory(pipeline: Pipeline) -> FilterMemory:
    """The memory of filters that have seen nothing but zeros."""
    raw, smooth = filter_sections(pipeline.rate, pipeline.mains, pipeline.envelope)
    return FilterMemory(raw=np.zeros((len(raw), 2, 2)), envelope=np.zeros((len(smooth), 2, 2)))


def activations(pipeline: Pipeline, samples: np.ndarray, memory: FilterMemory) -> tuple[np.ndarray, FilterMemory]:
    """(N, 2) activations of (N, 2) samples, and the memory for the next chunk; chunks of any length give the same."""
    smooth, after = envelopes(pipeline, samples, memory)
    share = np.clip(smooth / np.array(pipeline.contraction), 0.0, 1.0)
    return np.maximum(share - pipeline.dead_band, 0.0) / (1.0 - pipeline.dead_band), after


def envelopes(pipeline: Pipeline, samples: np.ndarray, memory: FilterMemory) -> tuple[np.ndarray, FilterMemory]:
    """(N, 2) envelopes in V: band-pass and notch, absolute value, low-pass."""
    from scipy.signal import sosfilt

    raw, smooth = filter_sections(pipeline.rate, pipeline.mains, pipeline.envelope)
    if not len(samples):
        return np.zeros((0, 2)), memory
    clean, raw_after = sosfilt(raw, samples, axis=0, zi=memory.raw)
    slow, smooth_after = sosfilt(smooth, np.abs(clean), axis=0, zi=memory.envelope)
    return np.maximum(np.asarray(slow), 0.0), FilterMemory(raw=raw_after, envelope=smooth_after)


def calibrated(
    contraction: Recording, *, mains: float = 50.0, envelope: float = 3.0, dead_band: float = 0.08
) -> Pipeline:
    """The pipeline whose full activation is the mean envelope of a recording of the greatest contraction of both.

    The first second, in which the filters settle, is left out.

    Raises:
        DesignError: a recording shorter than two seconds, or a silent channel.
    """
    rough = Pipeline(rate=contraction.rate, contraction=(1.0, 1.0), mains=mains, envelope=envelope, dead_band=dead_band)
    settled = int(contraction.rate)
    if len(contraction.samples) < 2 * settled:
        raise DesignError("the greatest contraction", "the recording is shorter than two seconds.")
    smooth, _ = envelopes(rough, contraction.samples, fresh_memory(rough))
    level = smooth[settled:].mean(axis=0)
    return Pipeline(
        rate=contraction.rate,
        contraction=(float(level[0]), float(level[1])),
        mains=mains,
        envelope=envelope,
        dead_band=dead_band,
    )


@cache
def filter_sections(rate: float, mains: float, envelope: float) -> tuple[np.ndarray, np.ndarray]:
    """Second-order sections: band-pass with notches of the mains and its harmonics in the band; low-pass."""
    from scipy.signal import butter, iirnotch, tf2sos

    stages = [butter(2, BAND, btype="bandpass", fs=rate, output="sos")]
    for harmonic in (1, 2, 3):
        if harmonic * mains < BAND[1]:
            stages.append(tf2sos(*iirnotch(harmonic * mains, 30.0, fs=rate)))
    return np.concatenate(stages), np.asarray(butter(2, envelope, fs=rate, output="sos"))
