"""How the runs of a campaign ended."""

from __future__ import annotations

import numpy as np

from ulna.campaign.runs import OUTCOMES
from ulna.campaign.store import CampaignResult


def outcome_counts(result: CampaignResult) -> dict[str, int]:
    """How many runs ended in each way that occurs, by name; memory for one batch is enough."""
    counts = np.zeros(len(OUTCOMES), dtype=np.int64)
    for block in result.blocks(["outcome"]):
        counts += np.bincount(block["outcome"], minlength=len(OUTCOMES))
    return {name: int(count) for name, count in zip(OUTCOMES, counts, strict=True) if count}
