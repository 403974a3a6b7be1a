"""Whether what a fit leaves over is noise: whiteness, correlation with the inputs, size beside the channel's noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ulna.identification.fitting.noise import Noise

LAGS = 20
SUSPICIOUS = 1e-3
"""Of true models one in a thousand has a smaller probability."""
BEYOND = 1.25
"""A residual so many times the noise of its channel is more than noise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ResidualTest:
    """The residual of one output.

    Attributes:
        output: its name. unit: SI. rms: of the residual. noise: what the channel's own noise is, by its quantiser and
            its differences or as given. largest: absolute value. samples: how many.
        whiteness: probability of a larger Ljung–Box statistic if residuals are independent, 20 lags.
        with_inputs: by input the probability of correlations as large, if the residual has nothing to do with it.
    """

    output: str
    unit: str
    rms: float
    noise: float
    largest: float
    samples: int
    whiteness: float
    with_inputs: Mapping[str, float] = field(default_factory=dict)

    @property
    def ratio(self) -> float:
        """Residual over noise: 1 for a model that leaves nothing but noise."""
        return self.rms / self.noise

    @property
    def explained(self) -> bool:
        """Whether noise accounts for the residual: it is as small, or at least looks like noise."""
        return self.ratio < BEYOND or self.whiteness > SUSPICIOUS

    @property
    def text(self) -> str:
        """The verdict in words."""
        if self.explained:
            return "the residual is what the noise of the channel explains"
        driven = [name for name, chance in self.with_inputs.items() if chance < SUSPICIOUS]
        tail = f" and follows {', '.join(driven)}" if driven else ""
        return f"the residual is {self.ratio:.3g} times the noise of the channel{tail}: the model leaves something out"


def residual_test(
    output: str,
    unit: str,
    residuals: Sequence[np.ndarray],
    inputs: Mapping[str, Sequence[np.ndarray]],
    noise: Noise,
) -> ResidualTest:
    """The tests of one output over all experiments.

    Args:
        output, unit: of it. residuals: by experiment, SI, NaN where lost. inputs: by name and experiment beside them.
        noise: of the channel.

    Reference:
        G. Ljung, G. Box, Biometrika 65 (1978); L. Ljung, System Identification, 2nd ed., section 16.6.
    """
    kept = [np.isfinite(each) for each in residuals]
    clean = [each[k] for each, k in zip(residuals, kept, strict=True)]
    whole = np.concatenate(clean)
    return ResidualTest(
        output=output,
        unit=unit,
        rms=float(np.sqrt(np.mean(whole**2))),
        noise=noise.std,
        largest=float(np.abs(whole).max()),
        samples=len(whole),
        whiteness=_whiteness(clean),
        with_inputs={
            name: _with_input(clean, [u[k] for u, k in zip(given, kept, strict=True)]) for name, given in inputs.items()
        },
    )


def _whiteness(residuals: Sequence[np.ndarray]) -> float:
    from scipy.special import chdtrc

    count = sum(map(len, residuals))
    lags = min(LAGS, count // 5)
    variance = sum(float(each @ each) for each in residuals) / count
    if lags < 1 or variance <= 0.0:
        return 1.0
    total = 0.0
    for lag in range(1, lags + 1):
        value = sum(float(e[:-lag] @ e[lag:]) for e in residuals if len(e) > lag) / (count * variance)
        total += value**2 / (count - lag)
    return float(chdtrc(lags, count * (count + 2) * total))


def _with_input(residuals: Sequence[np.ndarray], inputs: Sequence[np.ndarray]) -> float:
    """Probability of r'(λ R)⁻¹r: r the correlations of the residual with the input at 21 lags, R the input's own."""
    from scipy.special import chdtrc

    centred = [u - np.concatenate(list(inputs)).mean() for u in inputs]
    count = sum(map(len, residuals))
    lags = min(LAGS, count // 10)
    variance = sum(float(e @ e) for e in residuals) / count
    own = np.array([_sum(centred, centred, lag) for lag in range(lags + 1)]) / count
    if own[0] <= 0.0 or variance <= 0.0:
        return 1.0
    cross = np.array([_sum(centred, residuals, lag) for lag in range(lags + 1)]) / count
    matrix = own[np.abs(np.subtract.outer(np.arange(lags + 1), np.arange(lags + 1)))]
    values, vectors = np.linalg.eigh(matrix)
    good = values > 1e-6 * values[-1]
    part = (vectors[:, good].T @ cross) ** 2 / values[good]
    return float(chdtrc(int(good.sum()), count * float(part.sum()) / variance))


def _sum(first: Sequence[np.ndarray], second: Sequence[np.ndarray], lag: int) -> float:
    """Σ first(t − lag)·second(t)."""
    return sum(float(u[: len(u) - lag] @ e[lag:]) for u, e in zip(first, second, strict=True) if len(u) > lag)
