"""What can be claimed of a loop."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import sympy as sp

from ulna.certify.errors import CertifyError
from ulna.symbolic.formulas import exact


@dataclass(frozen=True, slots=True, kw_only=True)
class Region:
    """Every run that starts in an ellipsoid about the equilibrium converges to it; the largest one found is proved.

    Args:
        scale: SI size of each state by name, where 1 is far off; it shapes the ellipsoid.

    Examples:
        >>> ulna.Region(scale={"x1": 1.0, "x2": 5.0}).scale  # for `prove`: five times as long along x2
        {'x1': 1.0, 'x2': 5.0}
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

    Examples:
        >>> law = ulna.state_feedback("duffing", [-1, -2])
        >>> chip = ulna.Hardware(saturation=ulna.Saturation(lower=-2, upper=2))
        >>> loop = ulna.close_loop("duffing", law, hardware=chip)
        >>> ulna.prove(loop, ulna.StableWithin(box={"x1": 0.1, "x2": 0.1})).holds
        True
    """

    box: Mapping[str, float]

    def __post_init__(self) -> None:
        if not self.box:
            raise CertifyError("StableWithin(box={})", "the box is empty.", "Give StableWithin(box={'theta': 0.5}).")
        for name, size in self.box.items():
            if not (0 <= size < math.inf):
                raise CertifyError(f"the box of '{name}'", f"it is {size}, expected a finite number of at least 0.")


@dataclass(frozen=True, slots=True, kw_only=True)
class GloballyStable:
    """Every run converges to the equilibrium, wherever it starts, and stays near it where it starts near it.

    Examples:
        >>> law = ulna.state_feedback("duffing", [-1, -2])
        >>> ulna.prove(ulna.close_loop("duffing", law), ulna.GloballyStable()).holds
        True
    """


@dataclass(frozen=True, slots=True, kw_only=True)
class Over:
    """At every value of these parameters the loop rests within its limits and is exponentially stable there.

    Args:
        parameters: lowest and highest SI value of each by name. The plant must still have them as symbols, and its
            controller be designed with numbers; what is not named keeps its value.

    Examples:
        >>> law = ulna.state_feedback("duffing", [-1, -2])
        >>> ulna.prove(ulna.close_loop("duffing", law), ulna.Over(parameters={"d": (0.1, 0.5)})).holds
        True
    """

    parameters: Mapping[str, Any]

    def __post_init__(self) -> None:
        if not self.parameters:
            raise CertifyError("Over(parameters={})", "no parameter is named.", "Give Over(parameters={'m2': (4, 5)}).")
        for name, bounds in self.parameters.items():
            asked = f"the parameter '{name}' of the claim"
            try:
                low, high = (float(each) for each in bounds)
            except (TypeError, ValueError):
                raise CertifyError(
                    asked,
                    f"{bounds!r} is not a pair of a lower and an upper bound.",
                    f"Give both bounds: Over(parameters={{'{name}': (4, 5)}}).",
                ) from None
            if not (-math.inf < low <= high < math.inf):
                found = f"{low:g} to {high:g} is not a range of finite numbers."
                raise CertifyError(asked, found, "Give the lower bound first.")

    @property
    def bounds(self) -> dict[str, tuple[sp.Rational, sp.Rational]]:
        """The same in fractions."""
        return {name: (_fraction(low), _fraction(high)) for name, (low, high) in self.parameters.items()}


def _fraction(value: Any) -> sp.Rational:
    number = exact(value)
    return number if isinstance(number, sp.Rational) else sp.Rational(str(float(number)))


@dataclass(frozen=True, slots=True, kw_only=True)
class UltimateBound:
    """On its processor every run that starts in a box about rest ends up, and stays, in a smaller box.

    Args:
        box: SI distance from rest, either side, of each state by name; the others start at rest. Left out: the same
            multiple of the size of every state of the plant (its range, else 1), the largest that is found.

    Examples:
        >>> law = ulna.state_feedback("duffing", [-2, -3])
        >>> chip = ulna.Hardware(period=5e-3, sensors=ulna.Quantiser.encoder(bits=12))
        >>> loop = ulna.close_loop("duffing", law, hardware=chip)
        >>> found = ulna.prove(loop, ulna.UltimateBound(box={"x1": 0.1}))
        >>> found.holds, found.evidence["ends_within"]["x1"] < 0.01
        (True, True)
    """

    box: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, size in self.box.items():
            if not (0 <= size < math.inf):
                raise CertifyError(f"the box of '{name}'", f"it is {size}, expected a finite number of at least 0.")


Claim = Region | StableWithin | GloballyStable | Over | UltimateBound
