"""What bounds a loop: saturation and slew limit of the inputs, end stops of the plant, and anti-windup."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ulna.base import SimulationError


@dataclass(frozen=True, slots=True, kw_only=True)
class Saturation:
    """lower ≤ u ≤ upper, in SI.

    Examples:
        >>> ulna.Saturation(lower=-24.0, upper=24.0).upper
        24.0
    """

    lower: float
    upper: float

    def __post_init__(self) -> None:
        _check_order(f"Saturation(lower={self.lower}, upper={self.upper})", self.lower, self.upper)


@dataclass(frozen=True, slots=True, kw_only=True)
class SlewLimit:
    """|u_k − u_{k−1}| ≤ rate · period. rate: SI units of u a second.

    Examples:
        >>> ulna.Hardware(period=1e-3, slew=ulna.SlewLimit(rate=100.0)).period
        0.001
    """

    rate: float

    def __post_init__(self) -> None:
        if not (self.rate > 0):
            raise SimulationError(f"SlewLimit(rate={self.rate})", "the rate must be positive.")


@dataclass(frozen=True, slots=True, kw_only=True)
class ConditionalIntegration:
    """Anti-windup: an integral keeps its value where its step would push a saturated command farther out.

    Args:
        states: names of the controller's integrals, e.g. `("e1_int",)`.

    Reference:
        K. J. Åström, T. Hägglund, "Advanced PID Control", ISA 2006, section 3.5.

    Examples:
        >>> limits = ulna.Saturation(lower=-24, upper=24)
        >>> kept = ulna.ConditionalIntegration(states=("y_integral",))
        >>> ulna.Hardware(period=1e-3, saturation=limits, anti_windup=kept).anti_windup.states
        ('y_integral',)
    """

    states: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class EndStop:
    """A wall: where the position passes a limit it is put back on it and the velocity is reversed or stopped.

    In a continuous loop contact, rest and release are found at their exact instants; with a processor the wall
    acts at the end of each step of the plant.

    Args:
        position: name of the state that is limited. velocity: name of the state that is reset, its derivative.
        lower, upper: SI.
        restitution: v⁺ = −restitution · v⁻; 0 stops dead.

    Examples:
        >>> wall = ulna.EndStop(position="x", velocity="v", upper=0.2, restitution=0.4)
        >>> len(ulna.Hardware(end_stops=(wall,)).end_stops)
        1
    """

    position: str
    velocity: str
    lower: float = -math.inf
    upper: float = math.inf
    restitution: float = 0.0

    def __post_init__(self) -> None:
        _check_order(f"EndStop('{self.position}', {self.lower}, {self.upper})", self.lower, self.upper)
        if not (0.0 <= self.restitution <= 1.0):
            raise SimulationError(f"EndStop(restitution={self.restitution})", "expected a number between 0 and 1.")


def _check_order(asked: str, lower: float, upper: float) -> None:
    # Written so that a NaN is refused.
    if not (lower < upper):
        raise SimulationError(asked, f"the lower limit {lower} is not below the upper limit {upper}.", "Swap them.")
