"""Plans that draw from distributions: `Random`, `LatinHypercube`, `Sobol`, and `Saltelli` for Sobol indices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ulna.campaign.distributions import Distribution
from ulna.campaign.errors import CampaignError
from ulna.campaign.plan import check_count, check_seed, checked_vary

SOBOL_BITS = 30
"""Resolution of Sobol's points, and logarithm of how many there are at most."""

_HALF = 2.0**-53


@dataclass(frozen=True, slots=True, kw_only=True)
class Random:
    """Independent draws; run k uses its own place of the counter-based generator Philox.

    Args:
        vary: name → distribution, in SI.
        runs: how many.
        seed: of everything random in the campaign.

    Raises:
        CampaignError: fewer than one run, nothing varied, no distribution.
    """

    vary: Mapping[str, Any]
    runs: int
    seed: int = 0

    def __post_init__(self) -> None:
        _check(self)

    @property
    def count(self) -> int:
        """Number of runs."""
        return self.runs

    @property
    def names(self) -> tuple[str, ...]:
        """What is varied."""
        return tuple(self.vary)

    def support(self, name: str) -> tuple[float, float]:
        """Least and largest value of a varied quantity."""
        return self.vary[name].support

    def values(self, first: int, last: int) -> dict[str, np.ndarray]:
        """(last − first,) values of every varied quantity."""
        # One step of Philox's counter gives four numbers; each run takes whole steps of its own.
        steps = -(-len(self.vary) // 4)
        bits = np.random.Philox(key=self.seed).advance(first * steps)
        raw = bits.random_raw((last - first) * steps * 4).reshape(last - first, -1)[:, : len(self.vary)]
        return _placed(self.vary, (raw >> np.uint64(12)).astype(float) * 2.0**-52 + _HALF)


@dataclass(frozen=True, slots=True, kw_only=True)
class LatinHypercube:
    """A Latin hypercube: of N strata of equal chance of each quantity, every one is met once.

    The table of all points (N × quantities doubles) is drawn once per process.

    Args:
        vary: name → distribution, in SI.
        runs: how many.
        seed: of everything random in the campaign.

    Raises:
        CampaignError: fewer than one run, nothing varied, no distribution.

    Reference:
        M. McKay, R. Beckman, W. Conover, Technometrics 21 (1979).
    """

    vary: Mapping[str, Any]
    runs: int
    seed: int = 0

    def __post_init__(self) -> None:
        _check(self)

    @property
    def count(self) -> int:
        """Number of runs."""
        return self.runs

    @property
    def names(self) -> tuple[str, ...]:
        """What is varied."""
        return tuple(self.vary)

    def support(self, name: str) -> tuple[float, float]:
        """Least and largest value of a varied quantity."""
        return self.vary[name].support

    def values(self, first: int, last: int) -> dict[str, np.ndarray]:
        """(last − first,) values of every varied quantity."""
        return _placed(self.vary, _hypercube(len(self.vary), self.runs, self.seed)[first:last])


@dataclass(frozen=True, slots=True, kw_only=True)
class Sobol:
    """Scrambled Sobol points, evener than chance; best with a power of two runs.

    Args:
        vary: name → distribution, in SI.
        runs: how many.
        seed: of everything random in the campaign, the scrambling included.

    Raises:
        CampaignError: fewer than one run, nothing varied, no distribution.

    Reference:
        A. Owen, "Scrambling Sobol' and Niederreiter–Xing points", Journal of Complexity 14 (1998).
    """

    vary: Mapping[str, Any]
    runs: int
    seed: int = 0

    def __post_init__(self) -> None:
        _check(self)

    @property
    def count(self) -> int:
        """Number of runs."""
        return self.runs

    @property
    def names(self) -> tuple[str, ...]:
        """What is varied."""
        return tuple(self.vary)

    def support(self, name: str) -> tuple[float, float]:
        """Least and largest value of a varied quantity."""
        return self.vary[name].support

    def values(self, first: int, last: int) -> dict[str, np.ndarray]:
        """(last − first,) values of every varied quantity."""
        return _placed(self.vary, _sobol(len(self.vary), self.seed, first, last))


@dataclass(frozen=True, slots=True, kw_only=True)
class Saltelli:
    """The runs that Sobol indices are estimated from: n points A, n points B, and for each quantity A with B's column.

    Its n (quantities + 2) runs are for `sensitivity`; they are no sample of independent points.

    Args:
        vary: name → distribution, in SI.
        base: n, a power of two.
        seed: of everything random in the campaign.

    Raises:
        CampaignError: n no power of two, nothing varied, no distribution.

    Reference:
        A. Saltelli et al., "Variance based sensitivity analysis of model output", Computer Physics Communications 181
        (2010).
    """

    vary: Mapping[str, Any]
    base: int
    seed: int = 0

    def __post_init__(self) -> None:
        if self.base < 2 or self.base & (self.base - 1):
            raise CampaignError(f"Saltelli(base={self.base})", "the base must be a power of two.", "256 is usual.")
        _check(self)

    @property
    def count(self) -> int:
        """n (quantities + 2)."""
        return self.base * (len(self.vary) + 2)

    @property
    def names(self) -> tuple[str, ...]:
        """What is varied."""
        return tuple(self.vary)

    def support(self, name: str) -> tuple[float, float]:
        """Least and largest value of a varied quantity."""
        return self.vary[name].support

    def values(self, first: int, last: int) -> dict[str, np.ndarray]:
        """(last − first,) values of every varied quantity: blocks A, B, then one for each quantity."""
        width = len(self.vary)
        points = np.empty((last - first, width))
        for block in range(first // self.base, (last - 1) // self.base + 1):
            begin, end = max(first, block * self.base), min(last, (block + 1) * self.base)
            both = _sobol(2 * width, self.seed, begin - block * self.base, end - block * self.base)
            rows = both[:, width:] if block == 1 else both[:, :width].copy()
            if block >= 2:
                rows[:, block - 2] = both[:, width + block - 2]
            points[begin - first : end - first] = rows
        return _placed(self.vary, points)


def _check(plan: Random | LatinHypercube | Sobol | Saltelli) -> None:
    what = f"a plan {type(plan).__name__}"
    object.__setattr__(plan, "vary", dict(checked_vary(what, plan.vary)))
    check_count(what, plan.count)
    check_seed(what, plan.seed)


def _placed(vary: Mapping[str, Distribution], points: np.ndarray) -> dict[str, np.ndarray]:
    return {name: law.quantile(points[:, column]) for column, (name, law) in enumerate(vary.items())}


@lru_cache(maxsize=2)
def _hypercube(width: int, runs: int, seed: int) -> np.ndarray:
    from scipy.stats import qmc

    points = qmc.LatinHypercube(width, rng=np.random.default_rng(seed)).random(runs)
    return np.clip(points, _HALF, 1.0 - _HALF)


def _sobol(width: int, seed: int, first: int, last: int) -> np.ndarray:
    from scipy.stats import qmc

    if width > qmc.Sobol.MAXDIM:
        raise CampaignError("Sobol points", f"{width} dimensions, {qmc.Sobol.MAXDIM} are known.", "Use Random.")
    if last > 2**SOBOL_BITS:
        raise CampaignError("Sobol points", f"{last} asked for, there are {2**SOBOL_BITS}.", "Use Random.")
    engine = qmc.Sobol(width, bits=SOBOL_BITS, rng=np.random.default_rng(seed))
    points = []
    if first:
        engine.fast_forward(first)
    elif last > 1:
        # SciPy warns when the first call draws no power of two; the sequence does not care.
        points.append(engine.random(1))
        first = 1
    points.append(engine.random(last - first))
    # In the middle of their cells they keep clear of 0, whose quantile may be infinite.
    return np.concatenate(points) + 2.0 ** -(SOBOL_BITS + 1)
