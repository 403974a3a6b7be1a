"""`Plan`: which values the runs of a campaign take. Run k is a pure function of the plan and k."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.campaign.plans.permutation import mixed

MOST_RUNS = 2**40
"""More runs than any plan may have: a slip of the finger, not a campaign."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan(ABC):
    """What varies from run to run: `Grid`, `LatinHypercube`, `Sobol`, `Random`, `Saltelli`.

    Args:
        seed: from which every random number of the campaign follows.

    Raises:
        CampaignError: no run or beyond reason many, a seed that is no whole number from 0 to 2⁶³ − 1.
    """

    seed: int = 0

    def __post_init__(self) -> None:
        what = f"a plan {type(self).__name__}"
        if not 1 <= self.count <= MOST_RUNS:
            raise CampaignError(
                f"{what} of {self.count} runs",
                f"the number of runs must be at least one and at most 2^40 = {MOST_RUNS}.",
            )
        if not 0 <= self.seed < 2**63:
            raise CampaignError(f"{what} with seed {self.seed}", "a seed is a whole number from 0 to 2⁶³ − 1.")

    @property
    @abstractmethod
    def count(self) -> int:
        """Number of runs."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of what is varied."""

    @abstractmethod
    def support(self, name: str) -> tuple[float, float]:
        """Least and largest value that a varied quantity may take, in SI."""

    @abstractmethod
    def values(self, first: int, last: int) -> dict[str, np.ndarray]:
        """(last − first,) values in SI of every varied quantity in the runs first ≤ k < last."""


def seeds(plan: Plan, first: int, last: int) -> np.ndarray:
    """(last − first,) seeds of 64 bits for the noise of the runs first ≤ k < last.

    Run k gets output number k of SplitMix64 started from the plan's seed (G. Steele, D. Lea, C. Flood, "Fast
    splittable pseudorandom number generators", OOPSLA 2014): one pass over 2⁶⁴ values, so no two runs share one.
    """
    runs = np.arange(first + 1, last + 1, dtype=np.uint64)
    with np.errstate(over="ignore"):
        places = np.uint64(plan.seed) * np.uint64(0xD1342543DE82EF95) + runs * np.uint64(0x9E3779B97F4A7C15)
    return mixed(places)
