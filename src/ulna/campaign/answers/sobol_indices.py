"""Which of the varied quantities a figure depends on: Sobol indices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.campaign.plans import Saltelli, seeds
from ulna.campaign.store import CampaignResult

GROUPS = 4096
"""Groups of rows that the bootstrap draws from, at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensitivity:
    """Sobol indices of a figure.

    Attributes:
        figure: whose variance is shared out. names: of what was varied.
        first_order: (d,) part of the variance that each explains alone.
        total: (d,) part in which each has a hand.
        first_order_low, first_order_high, total_low, total_high: (d,) limits by bootstrap at the given confidence.
    """

    figure: str
    names: tuple[str, ...]
    first_order: np.ndarray
    total: np.ndarray
    first_order_low: np.ndarray
    first_order_high: np.ndarray
    total_low: np.ndarray
    total_high: np.ndarray
    confidence: float


def sensitivity(result: CampaignResult, figure: str, *, confidence: float = 0.95, resamples: int = 500) -> Sensitivity:
    """Sobol indices of a figure from the runs of a `Saltelli` plan, with limits by bootstrap over its rows.

    The estimators are those of `scipy.stats.sobol_indices`; memory does not grow with the number of runs.

    Raises:
        CampaignError: another plan, a figure that is not finite in all runs, or is the same in all.

    Reference:
        A. Saltelli et al., Computer Physics Communications 181 (2010) 259–270, Table 2, (b) and (f).

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> vary = {"p": ulna.Uniform(low=0, high=1), "s": ulna.Uniform(low=0, high=1)}
        >>> result = ulna.sweep(spring, ulna.Saltelli(vary=vary, base=32), horizon=5.0)
        >>> found = ulna.sensitivity(result, "final_p")
        >>> bool(found.total[0] > found.total[1])  # at 5 s the position depends on the first position most
        True
    """
    plan = result.experiment.plan
    if not isinstance(plan, Saltelli):
        raise CampaignError(
            "sensitivity of a campaign",
            f"its plan is {type(plan).__name__}, whose runs do not tell the quantities apart.",
            "Run a campaign with the plan Saltelli(vary=..., base=256).",
        )
    if not 0 < confidence < 1 or resamples < 1:
        raise CampaignError(
            f"sensitivity(confidence={confidence}, resamples={resamples})", "a confidence lies between 0 and 1."
        )
    mean = _checked_mean(result, figure)
    groups = _group_sums(result, figure, plan, mean)
    first, total = _indices(groups.sum(axis=0))
    # Whole rows are drawn anew: a point of A belongs to its point of B.
    random = np.random.default_rng(plan.seed)
    again = [_indices(groups[random.integers(len(groups), size=len(groups))].sum(axis=0)) for _ in range(resamples)]
    tails = (0.5 - confidence / 2, 0.5 + confidence / 2)
    first_low, first_high = np.quantile([found for found, _ in again], tails, axis=0)
    total_low, total_high = np.quantile([found for _, found in again], tails, axis=0)
    return Sensitivity(
        figure=figure,
        names=plan.names,
        first_order=first,
        total=total,
        first_order_low=first_low,
        first_order_high=first_high,
        total_low=total_low,
        total_high=total_high,
        confidence=confidence,
    )


def _checked_mean(result: CampaignResult, figure: str) -> float:
    low, high, total, bad = np.inf, -np.inf, 0.0, 0
    for block in result.blocks([figure]):
        values = block[figure].astype(float)
        finite = np.isfinite(values)
        bad += int(np.count_nonzero(~finite))
        values = np.where(finite, values, 0.0)
        low, high, total = min(low, values.min()), max(high, values.max()), total + values.sum()
    if bad:
        raise CampaignError(
            f"sensitivity of '{figure}'",
            f"it is not a finite number in {bad} of {result.runs} runs.",
            "Vary less, or take a figure that every run has: 'settled', a peak error.",
        )
    if low == high:
        raise CampaignError(
            f"sensitivity of '{figure}'", f"it is {low:g} in every run, so there is no variance to explain."
        )
    return total / result.runs


def _group_sums(result: CampaignResult, figure: str, plan: Saltelli, mean: float) -> np.ndarray:
    """(groups, 3 + 3 d) sums over groups of rows; the rows of a group are drawn anew together.

    A row is its own group as long as there are not too many; beyond that rows fall into groups by chance. The sums are
    of 1, of A and B, of their squares, then for each quantity of AB − A, of B (AB − A) and of (AB − A)². All but the
    differences are taken from the mean, for less rounding.
    """
    quantities = len(plan.vary)
    sums = np.zeros((min(plan.base, GROUPS), 3 + 3 * quantities))
    size = result.store.manifest.batch_size
    for first in range(0, plan.base, size):
        last = min(first + size, plan.base)
        rows = [
            result.read(figure, block * plan.base + first, block * plan.base + last) - mean
            for block in range(quantities + 2)
        ]
        a, b = rows[:2]
        steps = np.stack(rows[2:], axis=1) - a[:, None]
        ones = np.stack([np.ones_like(a), a + b, a**2 + b**2], axis=1)
        terms = np.concatenate([ones, steps, b[:, None] * steps, steps**2], axis=1)
        own = np.arange(first, last)
        groups = own if plan.base <= GROUPS else seeds(plan, first, last) % np.uint64(GROUPS)
        np.add.at(sums, groups, terms)
    return sums


def _indices(sums: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First-order and total indices from sums over rows: the estimators of Saltelli and of Jansen."""
    count, mean = sums[0], sums[1] / (2 * sums[0])
    variance = sums[2] / (2 * count) - mean**2
    step, product, square = sums[3:].reshape(3, -1) / count
    if not variance > 0.0:
        return np.zeros_like(step), np.zeros_like(step)
    return (product - mean * step) / variance, square / 2 / variance
