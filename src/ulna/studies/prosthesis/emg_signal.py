"""Electromyograms: what was recorded from two muscles, and a synthetic recording."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ulna.base import UlnaError

BAND = (20.0, 450.0)
"""Where surface electromyograms have their power, Hz (C. J. De Luca, J. Appl. Biomech. 13(2), 1997)."""

LEAST_RATE = 100.0
"""Samples a second below which raw signals hold too little of the band; 1000 hold all of it."""
LEAST_ENVELOPE_RATE = 20.0


class RecordingError(UlnaError):
    """A recording of muscle signals that cannot be used."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """Samples of two muscles, flexor and extensor, at one rate.

    Attributes:
        rate: samples a second.
        samples: (N, 2) in `unit`; zeros in the second column where one muscle alone was recorded.
        muscles: names of the muscles recorded, one or two.
        envelope: the samples are rectified or smoothed already.
        unit: "V", or "" where nothing states it.
        said: in one line, what was found in the file and assumed about it.

    Raises:
        RecordingError: another number of channels, a rate too low, samples that are not finite.
    """

    rate: float
    samples: np.ndarray
    muscles: tuple[str, ...] = ("flexor", "extensor")
    envelope: bool = False
    unit: str = "V"
    said: str = ""

    def __post_init__(self) -> None:
        check_rate("a recording", self.rate, envelope=self.envelope)
        if self.samples.ndim != 2 or self.samples.shape[1] != 2 or len(self.muscles) not in (1, 2):
            raise RecordingError(
                "a recording",
                f"its samples have the shape {self.samples.shape}.",
                "Give two channels: flexor, extensor.",
            )
        if not np.isfinite(self.samples).all():
            row = int(np.flatnonzero(~np.isfinite(self.samples).all(axis=1))[0])
            raise RecordingError("a recording", f"sample {row} is not a finite number.")

    @property
    def times(self) -> np.ndarray:
        """(N,) s, from 0."""
        return np.arange(len(self.samples)) / self.rate


@dataclass(frozen=True, slots=True, kw_only=True)
class SyntheticMuscles:
    """Amplitude-modulated, band-limited Gaussian noise of two muscles, with hum.

    Channel c is e_c(t) n_c(t) + crosstalk of the other one + floor noise + hum; n has unit RMS in 20–450 Hz, and e_c is
    effort times `amplitude`.

    Args:
        rate: samples a second, above 900: the whole band is made.
        amplitude: RMS at full effort, V.
        floor: RMS of the noise at rest, V.
        hum: amplitude of the mains, V. hum_frequency: Hz.
        crosstalk: share of the other muscle's signal.
        seed: of the noise.

    Raises:
        RecordingError: a rate too low for the band, or an amplitude below 0.

    Reference:
        N. Hogan, R. W. Mann, "Myoelectric signal processing", IEEE Trans. Biomed. Eng. 27(7), 1980 (the model).
    """

    rate: float = 1000.0
    amplitude: float = 3e-4
    floor: float = 2e-6
    hum: float = 2e-5
    hum_frequency: float = 50.0
    crosstalk: float = 0.05
    seed: int = 0

    def __post_init__(self) -> None:
        if not (2 * BAND[1] < self.rate < math.inf):
            raise RecordingError(
                f"synthetic muscles at {self.rate:g} samples a second",
                f"signals up to {BAND[1]:g} Hz need more than {2 * BAND[1]:g}.",
            )
        for name in ("amplitude", "floor", "hum", "crosstalk"):
            if not (0 <= getattr(self, name) < math.inf):
                raise RecordingError(
                    f"synthetic muscles ({name}={getattr(self, name)})", "expected a number of at least 0."
                )


def synthetic_recording(
    muscles: SyntheticMuscles, flexor: Sequence[float] | np.ndarray, extensor: Sequence[float] | np.ndarray
) -> Recording:
    """A recording with the given efforts, shares of the greatest voluntary contraction, one a sample.

    Raises:
        RecordingError: efforts of different length, or outside [0, 1].
    """
    from scipy.signal import sosfilt

    efforts = [np.asarray(effort, dtype=float) for effort in (flexor, extensor)]
    if efforts[0].shape != efforts[1].shape or efforts[0].ndim != 1:
        raise RecordingError(
            "efforts", f"their shapes are {efforts[0].shape} and {efforts[1].shape}, expected two rows of one length."
        )
    effort = np.stack(efforts, axis=1)
    if not ((effort >= 0) & (effort <= 1)).all():
        raise RecordingError("efforts", "expected numbers in [0, 1].", "1 is the greatest voluntary contraction.")
    count = len(effort)
    settle = int(muscles.rate)
    white = np.random.default_rng(muscles.seed).standard_normal((settle + count, 4))
    band, gain = shaping_sections(muscles.rate)
    shaped = np.asarray(sosfilt(band, white, axis=0))[settle:]
    shaped = shaped / gain
    pure = muscles.amplitude * effort * shaped[:, :2]
    mixed = pure + muscles.crosstalk * pure[:, ::-1] + muscles.floor * shaped[:, 2:]
    phase = 2 * np.pi * muscles.hum_frequency * np.arange(count) / muscles.rate
    return Recording(rate=muscles.rate, samples=mixed + muscles.hum * np.sin(phase)[:, None])


def band_of(rate: float) -> tuple[float, float]:
    """(lower, upper) limits in Hz of the band that samples at this rate can hold."""
    return BAND[0], min(BAND[1], 0.45 * rate)


def check_rate(what: str, rate: float, *, envelope: bool = False) -> None:
    """Refuse a rate at which next to nothing of the band is left.

    Raises:
        RecordingError: see above.
    """
    least = LEAST_ENVELOPE_RATE if envelope else LEAST_RATE
    if not (least <= rate < math.inf):
        raise RecordingError(
            f"{what} at {rate:g} samples a second",
            f"{'envelopes' if envelope else 'raw muscle signals'} need {least:g} or more.",
            "Record at 1000." if envelope else "Record at 1000; if it is an envelope already, say envelope=True.",
        )


def shaping_sections(rate: float) -> tuple[np.ndarray, float]:
    """Second-order sections that give white noise the band of muscles, and the RMS that is left of it."""
    from scipy.signal import butter, sosfreqz

    sections = np.asarray(butter(12, BAND, btype="bandpass", fs=rate, output="sos"))
    # √(band power / total power), by Parseval from the filter itself.
    _, response = sosfreqz(sections, worN=8192)
    return sections, math.sqrt(float(np.mean(np.abs(np.asarray(response)) ** 2)))
