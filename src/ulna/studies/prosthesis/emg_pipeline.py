"""Muscle signals to activations: band-pass, notch, rectify, envelope, normalise, dead band; causal, chunk by chunk."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from ulna.base import DesignError
from ulna.studies.prosthesis.emg_signal import Recording, band_of, check_rate

CONTRAST = 3.0
"""Times that the envelope of a contraction is above the rest, at least: noise alone flickers by less than two."""
SILENT = 0.05
"""Share of the other muscle's contraction below which a muscle counts as silent: crosstalk is as large."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pipeline:
    """Settings of the way from samples (V) to activations in [0, 1].

    Args:
        rate: samples a second.
        contraction: (flexor, extensor) envelope at the greatest voluntary contraction, in the unit of the samples; from
            `calibrated`. Infinite for a muscle that was not recorded or never contracted: its activation is 0.
        rest: (flexor, extensor) envelope at rest, which counts as 0.
        rectified: the samples are rectified or envelopes already; band-pass and notch are left out.
        mains: frequency that the notch takes out, Hz, with its harmonics where the band holds them.
        envelope: cut-off of the envelope's low-pass, Hz (second order).
        dead_band: activations below this share are 0, and the rest is stretched to begin at 0 there.

    Raises:
        DesignError: a share outside [0, 1), a contraction that is not positive.
        RecordingError: a rate too low for the band.
    """

    rate: float
    contraction: tuple[float, float]
    rest: tuple[float, float] = (0.0, 0.0)
    rectified: bool = False
    mains: float = 50.0
    envelope: float = 3.0
    dead_band: float = 0.08

    def __post_init__(self) -> None:
        check_rate("a pipeline", self.rate, envelope=self.rectified)
        if not (0 <= self.dead_band < 1):
            raise DesignError(f"a dead band of {self.dead_band}", "expected a number in [0, 1).")
        if not all(rest < level for level, rest in zip(self.contraction, self.rest, strict=True)) or min(self.rest) < 0:
            raise DesignError(
                f"contractions {self.contraction} over rest {self.rest}",
                "expected each contraction above its rest, and rests of at least 0.",
                "Record a full contraction of each muscle.",
            )
        if not (0 < self.mains < math.inf):
            raise DesignError(
                f"a pipeline with mains={self.mains:g} Hz", "expected a number above 0.", "Give 50 or 60."
            )
        if not (0 < self.envelope < self.rate / 2):
            raise DesignError(
                f"a pipeline with envelope={self.envelope:g} Hz", f"expected a number in (0, {self.rate / 2:g})."
            )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FilterMemory:
    """What the filters remember between chunks: (sections, 2, 2) of each of the two stages; None before all samples."""

    raw: np.ndarray | None = None
    envelope: np.ndarray | None = None


def fresh_memory() -> FilterMemory:
    """The memory of filters that will take the first sample as what has always been."""
    return FilterMemory()


def activations(pipeline: Pipeline, samples: np.ndarray, memory: FilterMemory) -> tuple[np.ndarray, FilterMemory]:
    """(N, 2) activations of (N, 2) samples, and the memory for the next chunk; chunks of any length give the same."""
    smooth, after = envelopes(pipeline, samples, memory)
    rest = np.array(pipeline.rest)
    share = np.clip((smooth - rest) / (np.array(pipeline.contraction) - rest), 0.0, 1.0)
    return np.maximum(share - pipeline.dead_band, 0.0) / (1.0 - pipeline.dead_band), after


def envelopes(pipeline: Pipeline, samples: np.ndarray, memory: FilterMemory) -> tuple[np.ndarray, FilterMemory]:
    """(N, 2) envelopes in the unit of the samples: band-pass and notch, absolute value, low-pass.

    The filters start where a constant first sample would have led them: an offset makes no envelope.
    """
    from scipy.signal import sosfilt, sosfilt_zi

    if not len(samples):
        return np.zeros((0, 2)), memory
    raw, smooth = filter_sections(pipeline.rate, pipeline.mains, pipeline.envelope)
    raw_memory, slow_memory = memory.raw, memory.envelope
    if pipeline.rectified:
        clean = samples
    else:
        if raw_memory is None:
            raw_memory = sosfilt_zi(raw)[:, :, None] * samples[0]
        clean, raw_memory = sosfilt(raw, samples, axis=0, zi=raw_memory)
    size = np.abs(clean)
    if slow_memory is None:
        first = size[0] if pipeline.rectified else np.zeros(2)
        slow_memory = sosfilt_zi(smooth)[:, :, None] * first
    slow, slow_memory = sosfilt(smooth, size, axis=0, zi=slow_memory)
    return np.maximum(np.asarray(slow), 0.0), FilterMemory(raw=raw_memory, envelope=slow_memory)


def calibrated(
    contraction: Recording,
    *,
    mains: float = 50.0,
    envelope: float = 3.0,
    dead_band: float = 0.08,
    rest: tuple[float, float] = (0.0, 0.0),
) -> Pipeline:
    """The pipeline whose full activation is the mean envelope of a recording of the greatest contraction of both.

    The first second, in which the filters settle, is left out. A muscle that was not recorded stays at 0.

    Raises:
        DesignError: a recording shorter than two seconds, or a silent channel.
    """
    rough, smooth = _settled(contraction, mains, envelope, dead_band)
    level = smooth.mean(axis=0)
    if len(contraction.muscles) == 1:
        level[1] = math.inf
    return replace(rough, contraction=(float(level[0]), float(level[1])), rest=rest)


def calibrated_on_itself(
    recording: Recording, *, mains: float = 50.0, envelope: float = 3.0, dead_band: float = 0.08
) -> tuple[Pipeline, str]:
    """The pipeline that takes the strongest tenth of a recording as full, the quietest as rest; and what it found.

    A muscle whose strongest tenth is less than three times its rest, or moves by less than a twentieth of what the
    other does, never contracted, and stays at 0.

    Raises:
        DesignError: a recording shorter than two seconds, or one in which no muscle contracts.
    """
    rough, smooth = _settled(recording, mains, envelope, dead_band)
    ordered = np.sort(smooth, axis=0)
    tenth = max(1, len(ordered) // 10)
    rest, full = ordered[tenth - 1], ordered[-tenth:].mean(axis=0)
    # A recorded envelope may rest anywhere.
    contracts = (full > (1.05 if recording.envelope else CONTRAST) * rest) & (full > 0)
    contracts &= full - rest > SILENT * np.where(contracts, full - rest, 0.0).max()
    if not contracts.any():
        raise DesignError(
            "a recording as its own calibration",
            "no muscle contracts in it: its strongest tenth is as loud as its rest.",
            "Give a recording of the greatest contraction as calibration.",
        )
    quiet = [name for name, moves in zip(recording.muscles, contracts, strict=False) if not moves]
    level = np.where(contracts, full, math.inf)
    pipeline = replace(rough, contraction=(float(level[0]), float(level[1])), rest=(float(rest[0]), float(rest[1])))
    return pipeline, f"{quiet[0]} never contracts and counts as silent" if quiet else ""


def _settled(recording: Recording, mains: float, envelope: float, dead_band: float) -> tuple[Pipeline, np.ndarray]:
    """A pipeline without calibration and the envelopes it makes after the first second."""
    rough = Pipeline(
        rate=recording.rate,
        contraction=(1.0, 1.0),
        rectified=recording.envelope,
        mains=mains,
        envelope=envelope,
        dead_band=dead_band,
    )
    settled = int(recording.rate)
    if len(recording.samples) < 2 * settled:
        raise DesignError("calibrating muscle signals", "the recording is shorter than two seconds.")
    smooth, _ = envelopes(rough, recording.samples, fresh_memory())
    return rough, smooth[settled:]


@cache
def filter_sections(rate: float, mains: float, envelope: float) -> tuple[np.ndarray, np.ndarray]:
    """Second-order sections: band-pass with notches of the mains and its harmonics in the band; low-pass.

    The band is that of muscles as far as the rate holds it (`band_of`).
    """
    from scipy.signal import butter, iirnotch, tf2sos

    band = band_of(rate)
    stages = [butter(2, band, btype="bandpass", fs=rate, output="sos")]
    for harmonic in (1, 2, 3):
        if harmonic * mains < band[1]:
            stages.append(tf2sos(*iirnotch(harmonic * mains, 30.0, fs=rate)))
    return np.concatenate(stages), np.asarray(butter(2, envelope, fs=rate, output="sos"))
