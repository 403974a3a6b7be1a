"""Whether signals are raw, or rectified and smoothed already."""

from __future__ import annotations

import numpy as np

SLOW = 10.0
"""Hz below which envelopes have their power, and raw muscle signals next to none."""


def is_rectified(samples: np.ndarray, rate: float) -> bool:
    """Whether (N, C) samples at a rate in Hz are rectified or envelopes: none negative, and slow or one-sided.

    Raw counts of a converter are not negative either, but swing to both sides of their middle.
    """
    return all(_one(channel, rate) for channel in samples.T if np.ptp(channel)) and bool(np.ptp(samples, axis=0).any())


def _one(channel: np.ndarray, rate: float) -> bool:
    low, middle, high = np.quantile(channel, (0.001, 0.5, 0.999))
    size = high - low
    if size <= 0 or channel.min() < -0.02 * max(abs(high), size):
        return False
    power = np.abs(np.fft.rfft(channel - channel.mean())) ** 2
    fast = power[np.fft.rfftfreq(len(channel), 1 / rate) > SLOW].sum() / max(power.sum(), 1e-300)
    # At rest a rectified signal lies at its lower end, a raw one in its middle.
    return bool(fast < 0.02 or (middle - low) / size < 0.3)
