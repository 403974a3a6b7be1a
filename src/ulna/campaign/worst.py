"""The worst runs of a campaign, with what made them so."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.campaign.result import CampaignResult
from ulna.campaign.runs import OUTCOMES


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One run. number: for `replay`. value: of the figure. varied: SI values by name. outcome: how it ended."""

    number: int
    value: float
    outcome: str
    varied: Mapping[str, float]


def worst_cases(result: CampaignResult, figure: str, *, count: int = 10) -> tuple[Case, ...]:
    """The runs with the largest magnitude of a figure, worst first.

    Runs that did not reach the end stand before all others, the earliest first; a NaN of a run that did is no value.

    Raises:
        CampaignError: an unknown figure, or a count below one.
    """
    if count < 1:
        raise CampaignError(f"worst_cases(count={count})", "at least one is needed.")
    values = result[figure]
    finished = result["outcome"] == 0
    order = np.where(finished, np.where(np.isnan(values), -1.0, np.abs(values)), np.inf)
    ended = np.where(finished, np.inf, result["end_time"])
    count = min(count, result.runs)
    # Only those that can be among the worst are put in order: ties with the last of them included.
    limit = -np.partition(-order, count - 1)[count - 1]
    candidates = np.flatnonzero(order >= limit)
    ranked = candidates[np.lexsort((candidates, ended[candidates], -order[candidates]))][:count]
    return tuple(
        Case(
            number=int(run),
            value=float(values[run]),
            outcome=OUTCOMES[int(result.read("outcome", int(run), int(run) + 1)[0])],
            varied={name: float(result.read(name, int(run), int(run) + 1)[0]) for name in result.varied},
        )
        for run in ranked
    )
