"""What can be claimed of a loop."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from ulna.certify.errors import CertifyError


@dataclass(frozen=True, slots=True, kw_only=True)
class Region:
    """Every run that starts in an ellipsoid about the equilibrium converges to it; the largest one found is proved.

    Args:
        scale: SI size of each state by name, where 1 is far off; it shapes the ellipsoid.
    """

    scale: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, size in self.scale.items():
            if not (0 < size < math.inf):
                raise CertifyError(f"the scale of '{name}'", f"{size} is not a positive number.")


@dataclass(frozen=True, slots=True, kw_only=True)
class StableWithin:
    """Every run that starts in a box about the equilibrium converges to it.

    Args:
        box: SI distance from the equilibrium, either side, of each state by name; the others start at theirs.
    """

    box: Mapping[str, float]

    def __post_init__(self) -> None:
        if not self.box:
            raise CertifyError("StableWithin(box={})", "the box has no side.", "Give StableWithin(box={'theta': 0.5}).")
        for name, size in self.box.items():
            if not (0 <= size < math.inf):
                raise CertifyError(f"the box of '{name}'", f"{size} is not a number from 0 on.")


@dataclass(frozen=True, slots=True, kw_only=True)
class GloballyStable:
    """Every run converges to the equilibrium, wherever it starts, and stays near it where it starts near it."""


Claim = Region | StableWithin | GloballyStable
