"""`Grid`: every combination of given values."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.campaign.plans.plan import Plan


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid(Plan):
    """Every combination of the values along some axes; the last axis runs fastest.

    Args:
        axes: name → values in SI.
        seed: of the noise.

    Raises:
        CampaignError: no axis, an empty one, a value that is not finite, or one that is given twice.

    Examples:
        >>> plan = ulna.Grid(axes={"m2": [4.0, 5.0], "theta": [0.0, 0.1, 0.2]})
        >>> plan.count, plan.shape
        (6, (2, 3))
    """

    axes: Mapping[str, Sequence[float] | np.ndarray]

    def __post_init__(self) -> None:
        if not self.axes:
            raise CampaignError("a grid", "it has no axis.", "Give Grid(axes={'name': values, ...}).")
        axes = {name: tuple(float(v) for v in np.ravel(values)) for name, values in self.axes.items()}
        object.__setattr__(self, "axes", axes)
        for name, values in axes.items():
            if not values or not all(map(math.isfinite, values)):
                raise CampaignError(f"axis '{name}' of a grid", "it needs at least one value, and all of them finite.")
            if len(set(values)) < len(values):
                raise CampaignError(f"axis '{name}' of a grid", "a value is given twice.")
        Plan.__post_init__(self)

    @property
    def count(self) -> int:
        """Product of the axes' lengths."""
        return math.prod(self.shape)

    @property
    def shape(self) -> tuple[int, ...]:
        """Length of each axis."""
        return tuple(len(values) for values in self.axes.values())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the axes."""
        return tuple(self.axes)

    def support(self, name: str) -> tuple[float, float]:
        """Least and largest value of an axis."""
        values = self.axes[name]
        return min(values), max(values)

    def values(self, first: int, last: int) -> dict[str, np.ndarray]:
        """(last − first,) values along each axis."""
        places = np.unravel_index(np.arange(first, last), self.shape)
        return {
            name: np.array(values, dtype=float)[place]
            for (name, values), place in zip(self.axes.items(), places, strict=True)
        }
