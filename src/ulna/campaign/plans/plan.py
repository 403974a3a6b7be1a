"""`Plan`: which values the runs of a campaign take. Run k is a pure function of the plan and k."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.campaign.plans.permutation import mixed
from ulna.campaign.plans.probability import ProbabilityDistribution, as_probability_distribution

MOST_RUNS = 2**40
"""More runs than any plan may have: a slip of the finger, not a campaign."""


@runtime_checkable
class Plan(Protocol):
    """What a campaign needs to know of a plan: `Grid`, `LatinHypercube`, `Sobol`, `Random`, `Saltelli`."""

    @property
    def count(self) -> int:
        """Number of runs."""
        ...

    @property
    def seed(self) -> int:
        """From which every random number of the campaign follows."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what is varied."""
        ...

    def support(self, name: str) -> tuple[float, float]:
        """Least and largest value that a varied quantity may take, in SI."""
        ...

    def values(self, first: int, last: int) -> dict[str, np.ndarray]:
        """(last − first,) values in SI of every varied quantity in the runs first ≤ k < last."""
        ...


def seeds(plan: Plan, first: int, last: int) -> np.ndarray:
    """(last − first,) seeds of 64 bits for the noise of the runs first ≤ k < last.

    Run k gets output number k of SplitMix64 started from the plan's seed (G. Steele, D. Lea, C. Flood, "Fast
    splittable pseudorandom number generators", OOPSLA 2014): one pass over 2⁶⁴ values, so no two runs share one.
    """
    runs = np.arange(first + 1, last + 1, dtype=np.uint64)
    with np.errstate(over="ignore"):
        places = np.uint64(plan.seed) * np.uint64(0xD1342543DE82EF95) + runs * np.uint64(0x9E3779B97F4A7C15)
    return mixed(places)


def checked_vary(what: str, given: Mapping[str, Any]) -> dict[str, ProbabilityDistribution]:
    """Names with their distributions.

    Raises:
        CampaignError: nothing varied, or something that is no distribution.
    """
    if not given:
        raise CampaignError(what, "nothing is varied.", "Give vary={'name': Uniform(low=..., high=...)}.")
    return {str(name): as_probability_distribution(value) for name, value in given.items()}


def check_count(what: str, count: int) -> None:
    """Refuse counts that are not at least one, or beyond all reason.

    Raises:
        CampaignError: for such a count.
    """
    if not 1 <= count <= MOST_RUNS:
        raise CampaignError(
            f"{what} of {count} runs", f"the number of runs must be at least one and at most 2^40 = {MOST_RUNS}."
        )


def check_seed(what: str, seed: int) -> None:
    """Refuse seeds that are not whole numbers of 63 bits.

    Raises:
        CampaignError: for such a seed.
    """
    if not 0 <= seed < 2**63:
        raise CampaignError(f"{what} with seed {seed}", "a seed is a whole number from 0 to 2⁶³ − 1.")
