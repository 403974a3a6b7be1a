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


def sensitivity(result: CampaignResult, figure: str, *, confidence: float = 0.95, resamples: int = 200) -> Sensitivity:
    """Sobol indices of a figure from the runs of a `Saltelli` plan, by SciPy's estimators.

    Raises:
        CampaignError: another plan, a figure that is not finite in all runs, or is the same in all.

    Reference:
        A. Saltelli et al., Computer Physics Communications 181 (2010) 259–270.
    """
    from scipy.stats import sobol_indices

    plan = result.experiment.plan
    if not isinstance(plan, Saltelli):
        raise CampaignError(
            "sensitivity of a campaign",
            f"its plan is {type(plan).__name__}, whose runs do not tell the quantities apart.",
            "Run a campaign with the plan Saltelli(vary=..., base=256).",
        )
    if not 0 < confidence < 1:
        raise CampaignError(f"sensitivity(confidence={confidence})", "it lies between 0 and 1.", "0.95 is usual.")
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
    blocks = values.reshape(len(plan.vary) + 2, 1, plan.base)
    found = sobol_indices(func={"f_A": blocks[0], "f_B": blocks[1], "f_AB": blocks[2:]}, n=plan.base)
    spread = found.bootstrap(confidence_level=confidence, n_resamples=resamples)
    first, total = spread.first_order.confidence_interval, spread.total_order.confidence_interval
    return Sensitivity(
        figure=figure,
        names=plan.names,
        first_order=np.ravel(found.first_order),
        total=np.ravel(found.total_order),
        first_order_low=np.ravel(first.low),
        first_order_high=np.ravel(first.high),
        total_low=np.ravel(total.low),
        total_high=np.ravel(total.high),
        confidence=confidence,
    )
