"""Plans that draw from distributions: `Random`, `LatinHypercube`, `Sobol`, and `Saltelli` for Sobol indices."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.campaign.plans.correlation import checked, correlated, root
from ulna.campaign.plans.permutation import shuffled
from ulna.campaign.plans.plan import Plan
from ulna.campaign.plans.probability import as_probability_distribution
from ulna.campaign.plans.sobol_points import check_points, sobol_points

_HALF = 2.0**-53


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnPlan(Plan):
    """What all plans have in common that place points in the unit cube and read them off distributions.

    Any run's point is found from its number, without those before it: a plan takes no memory, however long it is.

    Args:
        vary: name → distribution, in SI.
        seed: of everything random in the campaign.
        correlations: (name, name, number) of quantities that vary together, as `posterior` gives them: of their normal
            scores, which for normal ones are they themselves. Strata are kept for the one that is varied first.

    Raises:
        CampaignError: no run or beyond reason many, nothing varied, something that is no distribution, correlations
            that no quantities can have.
    """

    vary: Mapping[str, Any]
    correlations: tuple[tuple[str, str, Any], ...] = ()

    def __post_init__(self) -> None:
        if not self.vary:
            raise CampaignError(
                f"a plan {type(self).__name__}",
                "nothing is varied.",
                "Give vary={'name': Uniform(low=..., high=...)}.",
            )
        vary = {str(name): as_probability_distribution(given) for name, given in self.vary.items()}
        object.__setattr__(self, "vary", vary)
        pairs = checked(self.correlations, tuple(vary), f"a plan {type(self).__name__}")
        object.__setattr__(self, "correlations", pairs)
        Plan.__post_init__(self)

    @property
    def names(self) -> tuple[str, ...]:
        """What is varied."""
        return tuple(self.vary)

    def support(self, name: str) -> tuple[float, float]:
        """Least and largest value of a varied quantity."""
        return self.vary[name].support

    def values(self, first: int, last: int) -> dict[str, np.ndarray]:
        """(last − first,) values of every varied quantity."""
        points = self.points(first, last)
        if self.correlations:
            points = correlated(points, root(self.correlations, self.names, type(self).__name__), _HALF)
        return {name: law.quantile(points[:, column]) for column, (name, law) in enumerate(self.vary.items())}

    @abstractmethod
    def points(self, first: int, last: int) -> np.ndarray:
        """(last − first, quantities) points, each coordinate between 0 and 1, neither included."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CountedPlan(DrawnPlan):
    """A plan of as many runs as asked for. runs: how many; see `DrawnPlan`."""

    runs: int

    @property
    def count(self) -> int:
        """Number of runs."""
        return self.runs


@dataclass(frozen=True, slots=True, kw_only=True)
class Random(CountedPlan):
    """`Random(vary=..., runs=N)`: independent draws; run k has its own place of the counter-based generator Philox.

    Examples:
        >>> plan = ulna.Random(vary={"theta": ulna.Uniform(low=-1, high=1)}, runs=1000, seed=7)
        >>> plan.count, plan.names
        (1000, ('theta',))
    """

    def points(self, first: int, last: int) -> np.ndarray:
        """(last − first, quantities) independent points."""
        return _independent(len(self.vary), self.seed, first, last)


@dataclass(frozen=True, slots=True, kw_only=True)
class LatinHypercube(CountedPlan):
    """`LatinHypercube(vary=..., runs=N)`: of N strata of equal chance of each quantity, every one is met once.

    Reference:
        M. McKay, R. Beckman, W. Conover, Technometrics 21 (1979).

    Examples:
        >>> ulna.LatinHypercube(vary={"m2": ulna.Uniform(low=4, high=6)}, runs=4).values(0, 4)["m2"].round(1)
        array([4.5, 5.3, 5.6, 4.3])
    """

    def points(self, first: int, last: int) -> np.ndarray:
        """(last − first, quantities) points: of each quantity a stratum of its own, and a place in it by chance."""
        width = len(self.vary)
        strata = [shuffled(np.arange(first, last), self.runs, seed=self.seed, stream=k) for k in range(width)]
        inside = _independent(width, self.seed, first, last)
        return np.clip((np.stack(strata, axis=1) + inside) / self.runs, _HALF, 1.0 - _HALF)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sobol(CountedPlan):
    """`Sobol(vary=..., runs=N)`: scrambled Sobol points, evener than chance; best with a power of two runs.

    Raises:
        CampaignError: as `DrawnPlan`, and for more runs than there are points.

    Reference:
        A. Owen, "Scrambling Sobol' and Niederreiter–Xing points", Journal of Complexity 14 (1998).

    Examples:
        >>> ulna.Sobol(vary={"theta": ulna.Uniform(low=-1, high=1)}, runs=1024).count
        1024
    """

    def __post_init__(self) -> None:
        DrawnPlan.__post_init__(self)
        check_points(len(self.vary), self.count)

    def points(self, first: int, last: int) -> np.ndarray:
        """(last − first, quantities) points of the sequence."""
        return sobol_points(len(self.vary), self.seed, first, last)


@dataclass(frozen=True, slots=True, kw_only=True)
class Saltelli(DrawnPlan):
    """The runs that Sobol indices are estimated from: n points A, n points B, and for each quantity A with B's column.

    Its n (quantities + 2) runs are for `sensitivity`; they are no sample of independent points.

    Args:
        vary, seed: as of every `DrawnPlan`.
        base: n, a power of two.

    Raises:
        CampaignError: as `DrawnPlan`, and for an n that is no power of two.

    Reference:
        A. Saltelli et al., "Variance based sensitivity analysis of model output", Computer Physics Communications 181
        (2010).

    Examples:
        >>> vary = {"m2": ulna.Uniform(low=4, high=6), "Ra": ulna.Uniform(low=1, high=2)}
        >>> ulna.Saltelli(vary=vary, base=256).count
        1024
    """

    base: int

    def __post_init__(self) -> None:
        if self.base < 2 or self.base & (self.base - 1):
            raise CampaignError(f"Saltelli(base={self.base})", "the base must be a power of two.", "256 is usual.")
        if self.correlations:
            found = "shares of the variance are those of independent quantities, and these are correlated."
            raise CampaignError("Saltelli(correlations=...)", found, "Leave them out, or draw runs by LatinHypercube.")
        DrawnPlan.__post_init__(self)
        check_points(2 * len(self.vary), self.base)

    @property
    def count(self) -> int:
        """n (quantities + 2)."""
        return self.base * (len(self.vary) + 2)

    def points(self, first: int, last: int) -> np.ndarray:
        """(last − first, quantities) points: blocks A, B, then one for each quantity."""
        width = len(self.vary)
        points = np.empty((last - first, width))
        for block in range(first // self.base, (last - 1) // self.base + 1):
            begin, end = max(first, block * self.base), min(last, (block + 1) * self.base)
            both = sobol_points(2 * width, self.seed, begin - block * self.base, end - block * self.base)
            rows = both[:, width:] if block == 1 else both[:, :width].copy()
            if block >= 2:
                rows[:, block - 2] = both[:, width + block - 2]
            points[begin - first : end - first] = rows
        return points


def _independent(width: int, seed: int, first: int, last: int) -> np.ndarray:
    # One step of Philox's counter gives four numbers; each run takes whole steps of its own.
    steps = -(-width // 4)
    bits = np.random.Philox(key=seed).advance(first * steps)
    raw = bits.random_raw((last - first) * steps * 4).reshape(last - first, -1)[:, :width]
    return (raw >> np.uint64(12)).astype(float) * 2.0**-52 + _HALF
