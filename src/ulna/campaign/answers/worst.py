"""The worst runs of a campaign, with what made them so."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.campaign.runs import OUTCOMES
from ulna.campaign.store import CampaignResult


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
    Memory for one batch of the campaign is enough.

    Raises:
        CampaignError: an unknown figure, or a count below one.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> result = ulna.sweep(spring, ulna.Grid(axes={"p": [1, 3, 2]}), horizon=60.0)
        >>> [case.number for case in ulna.worst_cases(result, "final_p", count=2)]
        [1, 2]
    """
    if count < 1:
        raise CampaignError(f"worst_cases(count={count})", "expected at least one.")
    worst = np.zeros((3, 0))
    first = 0
    for block in result.blocks(list({figure: None, "outcome": None, "end_time": None})):
        values = block[figure].astype(float)
        finished = block["outcome"] == 0
        order = np.where(finished, np.where(np.isnan(values), -1.0, np.abs(values)), np.inf)
        ended = np.where(finished, np.inf, block["end_time"])
        numbers = np.arange(first, first + len(values))
        first += len(values)
        worst = np.concatenate([worst, [order, ended, numbers]], axis=1)
        # The number of a run settles ties, so that batches of any size give the same cases.
        worst = worst[:, np.lexsort((worst[2], worst[1], -worst[0]))[:count]]
    return tuple(_case(result, figure, int(number)) for number in worst[2])


def _case(result: CampaignResult, figure: str, number: int) -> Case:
    run = result.run(number)
    return Case(
        number=number,
        value=run[figure],
        outcome=OUTCOMES[int(run["outcome"])],
        varied={name: run[name] for name in result.varied},
    )
