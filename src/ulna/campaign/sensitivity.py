"""Which of the varied quantities a figure depends on: Sobol indices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.campaign.result import CampaignResult
from ulna.campaign.sampling import Saltelli


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
    """Sobol indices of a figure from the runs of a `Saltelli` plan, by SciPy's estimators.

    Raises:
        CampaignError: another plan, a figure that is not finite in all runs, or is the same in all.

    Reference:
        A. Saltelli et al., Computer Physics Communications 181 (2010) 259–270.
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
    values = result[figure].astype(float)
    bad = int(np.count_nonzero(~np.isfinite(values)))
    if bad:
        raise CampaignError(
            f"sensitivity of '{figure}'",
            f"it is not a finite number in {bad} of {result.runs} runs.",
            "Vary less, or take a figure that every run has: 'settled', a peak error.",
        )
    if values.min() == values.max():
        raise CampaignError(f"sensitivity of '{figure}'", f"it is {values[0]:g} in every run: nothing to share out.")
    blocks = values.reshape(len(plan.vary) + 2, plan.base)
    first, total = _indices(blocks)
    # Whole rows are drawn anew: a point of A belongs to its point of B. SciPy's own bootstrap divides 0 by 0 for a
    # quantity without any influence.
    random = np.random.default_rng(plan.seed)
    again = [_indices(blocks[:, random.integers(plan.base, size=plan.base)]) for _ in range(resamples)]
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


def _indices(blocks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First-order and total indices from the figure's values, a row for each block of the plan."""
    from scipy.stats import sobol_indices

    rows = blocks[:, None, :]
    if np.ptp(rows[:2]) == 0.0:
        return np.zeros(len(rows) - 2), np.zeros(len(rows) - 2)
    found = sobol_indices(func={"f_A": rows[0], "f_B": rows[1], "f_AB": rows[2:]}, n=rows.shape[-1])
    return np.ravel(found.first_order), np.ravel(found.total_order)
