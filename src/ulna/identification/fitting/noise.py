"""How noisy a channel is: the step of its quantiser, and what its differences say."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

UNIFORM = math.sqrt(12.0)
"""A quantiser of step q errs by q/√12, root mean square."""

_FEW = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """The noise of a channel, SI.

    Attributes:
        std: what residuals are weighed by. step: of the quantiser that was found, 0 where there is none.
        told: whether it was given; else it is estimated. floor: the least that it may be.
    """

    std: float
    step: float = 0.0
    told: bool = False
    floor: float = 0.0


def noise_of(values: list[np.ndarray]) -> Noise:
    """The noise of a channel from its samples alone, in several experiments; a smooth motion is not noise."""
    step = quantiser_step(np.concatenate(values))
    rough = [roughness(each) for each in values if len(each) >= _FEW]
    whole = np.concatenate(values)
    # Of a channel without any noise, a simulation, the last digits that a double carries.
    least = 1e-9 * float(np.nanmax(np.abs(whole))) or 1e-12
    floor = max(step / UNIFORM, float(np.median(rough)) if rough else 0.0, least)
    return Noise(std=floor, step=step, floor=max(step / UNIFORM, least))


def quantiser_step(values: np.ndarray) -> float:
    """The step between neighbouring codes, 0 where the values lie on no grid."""
    distinct = np.unique(values[np.isfinite(values)])
    if len(distinct) < 3:
        return 0.0
    gaps = np.diff(distinct)
    span = float(distinct[-1] - distinct[0])
    gaps = gaps[gaps > 1e-12 * max(span, float(np.abs(distinct).max()))]
    if not len(gaps):
        return 0.0
    least = float(gaps.min())
    counts = gaps / least
    if least > 1e-9 * span and np.abs(counts - np.rint(counts)).max() < 0.02:
        return least
    # Codes that were written with few digits: gaps scatter about the step.
    usual = float(np.median(gaps))
    near = np.abs(gaps / usual - np.rint(gaps / usual)) < 0.15
    repeated = len(distinct) <= 0.7 * np.isfinite(values).sum()
    return usual if repeated and near.mean() > 0.8 and len(gaps) > 4 else 0.0


def roughness(values: np.ndarray) -> float:
    """Standard deviation of the noise from differences of neighbouring samples, of the order that shows least.

    The k-th difference of white noise has variance (2k choose k) σ²; of a smooth signal it vanishes.
    """
    kept = values[np.isfinite(values)]
    found = []
    for order in range(1, min(6, len(kept) // 3)):
        differences = np.abs(np.diff(kept, order))
        found.append(float(np.median(differences)) / 0.6745 / math.sqrt(math.comb(2 * order, order)))
    return min(found, default=0.0)


def even(times: np.ndarray) -> bool:
    """Whether samples follow each other at one rate, nearly."""
    steps = np.diff(times)
    return len(steps) > 1 and float(np.ptp(steps)) < 0.1 * float(np.median(steps))


def correlated_lags(residuals: list[np.ndarray], most: int) -> np.ndarray:
    """(K + 1,) autocovariances at lags 0 … K; K is where the correlation first falls into its own noise.

    Args:
        residuals: of one channel, each experiment by itself. most: the largest K.
    """
    total = sum(len(each) for each in residuals)
    first = sum(float(each @ each) for each in residuals) / total
    found = [first]
    band = 2.0 * first / math.sqrt(total)
    for lag in range(1, most + 1):
        value = sum(float(each[:-lag] @ each[lag:]) for each in residuals if len(each) > lag) / total
        if value < band:
            break
        found.append(value)
    return np.array(found)


def long_run(slopes: list[np.ndarray], residuals: list[np.ndarray]) -> np.ndarray:
    """(q, q) covariance of Σ slope·residual where residuals of neighbouring samples belong together.

    Autocovariances of the residual, weighed by Bartlett's window, with the products of slopes that far apart.

    Args:
        slopes: (N, q) of one channel by experiment. residuals: (N,) beside them.

    Reference:
        W. Newey, K. West, Econometrica 55 (1987).
    """
    shortest = min(len(each) for each in residuals)
    covariances = correlated_lags(residuals, max(1, shortest // 8))
    width = 2 * len(covariances)
    meat = covariances[0] * sum(each.T @ each for each in slopes)
    for lag, value in enumerate(covariances[1:], start=1):
        weight = (1.0 - lag / width) * value
        for each in slopes:
            product = each[:-lag].T @ each[lag:]
            meat = meat + weight * (product + product.T)
    return np.asarray(meat)


def spans(mask: np.ndarray) -> list[slice]:
    """The stretches of a mask that are true."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(int), [0]))))
    return [slice(a, b) for a, b in list(pairwise(edges))[::2]]
