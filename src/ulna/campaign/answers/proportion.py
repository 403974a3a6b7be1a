"""How many of the runs settled, and how sure that is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.campaign.plans import Grid, Saltelli
from ulna.campaign.store import CampaignResult

Interval = Callable[[int, int, float], tuple[float, float]]
"""(successes, trials, confidence) → limits of a proportion."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Proportion:
    """Part of the runs for which something holds.

    Attributes:
        count, runs: for how many of how many. value: count / runs.
        low, high: limits of the chance of it at the given confidence, by the interval named `method`.
        drawn: whether the plan draws its runs by chance, one by one. Of a grid, or of the runs for Sobol indices, the
            limits mean nothing; of a Latin hypercube or of Sobol points they are wider than need be.
    """

    count: int
    runs: int
    low: float
    high: float
    confidence: float
    method: str
    drawn: bool

    @property
    def value(self) -> float:
        """count / runs."""
        return self.count / self.runs

    def __str__(self) -> str:
        if not self.drawn:
            return f"{self.value:.2%}"
        return (
            f"{self.value:.2%} ({self.low:.2%} to {self.high:.2%} at {self.confidence:.0%} confidence, {self.method})"
        )


def wilson(successes: int, trials: int, confidence: float) -> tuple[float, float]:
    """Wilson's score interval: close to the confidence asked for on average (J. Am. Stat. Assoc. 22, 1927)."""
    from scipy.stats import binomtest

    found = binomtest(successes, trials).proportion_ci(confidence, method="wilson")
    return float(found.low), float(found.high)


def clopper_pearson(successes: int, trials: int, confidence: float) -> tuple[float, float]:
    """The exact interval: never less than the confidence asked for (Biometrika 26, 1934)."""
    from scipy.stats import binomtest

    found = binomtest(successes, trials).proportion_ci(confidence, method="exact")
    return float(found.low), float(found.high)


def settled_fraction(result: CampaignResult, *, confidence: float = 0.95, interval: Interval = wilson) -> Proportion:
    """The part of the runs that reached the end with every output in its band.

    Raises:
        CampaignError: a confidence outside (0, 1).

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> result = ulna.sweep(spring, ulna.Grid(axes={"p": [1, 2, 3]}), horizon=60.0)
        >>> print(ulna.settled_fraction(result))
        100.00%
    """
    if not 0 < confidence < 1:
        raise CampaignError(
            f"settled_fraction(confidence={confidence})", "expected a number between 0 and 1.", "0.95 is usual."
        )
    count = sum(int(np.count_nonzero(block["settled"])) for block in result.blocks(["settled"]))
    low, high = interval(count, result.runs, confidence)
    return Proportion(
        count=count,
        runs=result.runs,
        low=low,
        high=high,
        confidence=confidence,
        method=interval.__name__.replace("_", " ").title().replace(" ", "–"),
        drawn=not isinstance(result.experiment.plan, Grid | Saltelli),
    )
