"""How a varied quantity is distributed: `Uniform`, `LogUniform`, `Normal`, `Choice`, or any of SciPy's."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np

from ulna.campaign.errors import CampaignError


@runtime_checkable
class ProbabilityDistribution(Protocol):
    """A distribution of a number in SI, given by its quantile function."""

    @property
    def support(self) -> tuple[float, float]:
        """Least and largest value; infinite where unbounded."""
        ...

    def quantile(self, probability: np.ndarray) -> np.ndarray:
        """(N,) values x with P(X ≤ x) = probability, for probabilities in (0, 1)."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """What distributions between two finite values have in common.

    Raises:
        CampaignError: low not below high, or not finite.
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        what = f"{type(self).__name__}(low={self.low}, high={self.high})"
        if not (math.isfinite(self.low) and math.isfinite(self.high)):
            raise CampaignError(what, "its limits must be finite.")
        _check_order(what, self.low, self.high)

    @property
    def support(self) -> tuple[float, float]:
        """(low, high)."""
        return self.low, self.high


@dataclass(frozen=True, slots=True, kw_only=True)
class Uniform(Interval):
    """`Uniform(low=..., high=...)`: every value between low and high alike.

    Examples:
        >>> ulna.Uniform(low=-0.5, high=0.5)
        Uniform(low=-0.5, high=0.5)
    """

    def quantile(self, probability: np.ndarray) -> np.ndarray:
        """low + p (high − low)."""
        return self.low + probability * (self.high - self.low)


@dataclass(frozen=True, slots=True, kw_only=True)
class LogUniform(Interval):
    """`LogUniform(low=..., high=...)`: uniform in the logarithm, between low > 0 and high.

    Raises:
        CampaignError: low not positive, or not below high.

    Examples:
        >>> friction = ulna.LogUniform(low=1e-3, high=1)
        >>> friction.quantile(np.array([0.5])).round(4)
        array([0.0316])
    """

    def __post_init__(self) -> None:
        Interval.__post_init__(self)
        if not self.low > 0:
            raise CampaignError(f"LogUniform(low={self.low})", "a logarithm needs a positive low.")

    def quantile(self, probability: np.ndarray) -> np.ndarray:
        """low (high / low)^p."""
        values = self.low * np.exp(probability * math.log(self.high / self.low))
        return np.clip(values, self.low, self.high)


@dataclass(frozen=True, slots=True, kw_only=True)
class Normal:
    """Gaussian of the given mean and standard deviation, cut off below `low` and above `high`.

    Raises:
        CampaignError: a standard deviation that is not positive, limits the wrong way round or outside all chances.

    Examples:
        >>> mass = ulna.Normal(mean=5, std=0.2, low=4)
        >>> mass.quantile(np.array([0.5])).round(4)
        array([5.])
    """

    mean: float
    std: float
    low: float = -math.inf
    high: float = math.inf

    def __post_init__(self) -> None:
        if not (0 < self.std < math.inf and math.isfinite(self.mean)):
            raise CampaignError(f"Normal(mean={self.mean}, std={self.std})", "the standard deviation must be positive.")
        _check_order(f"Normal(low={self.low}, high={self.high})", self.low, self.high)
        first, last = self._chances()
        if not last - first > 1e-12:
            raise CampaignError(
                f"Normal(mean={self.mean}, std={self.std})", f"it hardly ever lies in [{self.low}, {self.high}]."
            )

    @property
    def support(self) -> tuple[float, float]:
        """(low, high)."""
        return self.low, self.high

    def quantile(self, probability: np.ndarray) -> np.ndarray:
        """Mean + std Φ⁻¹(p), p between the chances of the limits."""
        from scipy.special import ndtri

        first, last = self._chances()
        values = self.mean + self.std * ndtri(first + probability * (last - first))
        return np.clip(values, self.low, self.high)

    def _chances(self) -> tuple[float, float]:
        from scipy.special import ndtr

        return float(ndtr((self.low - self.mean) / self.std)), float(ndtr((self.high - self.mean) / self.std))


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """One of some values, all alike.

    Raises:
        CampaignError: no value, or one that is not finite.

    Examples:
        >>> motors = ulna.Choice(values=(0.5, 0.7, 1.0))
        >>> ulna.Random(vary={"km": motors}, runs=500).count
        500
    """

    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.values or not all(map(math.isfinite, self.values)):
            raise CampaignError(f"Choice{self.values}", "at least one value is needed, and all of them finite.")

    @property
    def support(self) -> tuple[float, float]:
        """Least and largest of the values."""
        return min(self.values), max(self.values)

    def quantile(self, probability: np.ndarray) -> np.ndarray:
        """The value number ⌊p N⌋."""
        place = np.minimum((probability * len(self.values)).astype(np.int64), len(self.values) - 1)
        return np.array(self.values, dtype=float)[place]


@dataclass(frozen=True, slots=True, kw_only=True)
class FromScipy:
    """A continuous distribution of `scipy.stats` by its name and arguments; `as_probability_distribution` makes one.

    Raises:
        CampaignError: a name or arguments that SciPy does not know.
    """

    name: str
    arguments: tuple[float, ...] = ()
    keywords: tuple[tuple[str, float], ...] = ()
    _frozen: Any = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        from scipy import stats  # half a second: only where one of its distributions is used

        family: Any = getattr(stats, self.name, None)
        if not isinstance(family, stats.rv_continuous):
            raise CampaignError(f"distribution '{self.name}'", "scipy.stats has no continuous one of this name.")
        try:
            frozen = family(*self.arguments, **dict(self.keywords))
            low, high = frozen.support()
        except (TypeError, ValueError) as error:
            raise CampaignError(f"distribution '{self.name}'", f"its arguments do not fit: {error}.") from None
        if math.isnan(float(low)) or math.isnan(float(high)):
            raise CampaignError(f"distribution '{self.name}'", f"its arguments {self.arguments} are out of range.")
        object.__setattr__(self, "_frozen", frozen)

    @property
    def support(self) -> tuple[float, float]:
        """Least and largest value."""
        low, high = self._frozen.support()
        return float(low), float(high)

    def quantile(self, probability: np.ndarray) -> np.ndarray:
        """SciPy's `ppf`."""
        return np.asarray(self._frozen.ppf(probability), dtype=float)


def as_probability_distribution(given: Any) -> ProbabilityDistribution:
    """The distribution that an object stands for: one of ours, or a frozen one of `scipy.stats`.

    Raises:
        CampaignError: for anything else.
    """
    if isinstance(given, ProbabilityDistribution):
        return given
    family: Any = getattr(given, "dist", None)
    arguments = getattr(given, "args", ())
    if family is not None and hasattr(family, "ppf") and hasattr(family, "pdf"):
        keywords = tuple((key, float(value)) for key, value in getattr(given, "kwds", {}).items())
        return FromScipy(name=family.name, arguments=tuple(float(a) for a in arguments), keywords=keywords)
    raise CampaignError(
        f"a distribution {given!r}",
        f"a {type(given).__name__} is none.",
        "Give Uniform(low=..., high=...), Normal(...), LogUniform(...), Choice(...) or a frozen one of scipy.stats.",
    )


def _check_order(what: str, low: float, high: float) -> None:
    if not low < high:
        raise CampaignError(what, "low is not below high.", "Give low < high.")
