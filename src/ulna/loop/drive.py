"""What stands between a command and the plant's input: a bridge with pulses, an amplifier with limits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import sympy as sp

from ulna.base import SimulationError


@dataclass(frozen=True, slots=True, kw_only=True)
class Pwm:
    """A sign-magnitude H bridge: for duty d = min(|u| / supply, 1) the pulse has the sign of u.

    Its height is supply · (1 − sag · d), its length (d − dead_time · frequency) / frequency, not below zero. The plant
    sees its mean over a carrier period, or with `switched` the pulses themselves, on from the start of each period.
    `ripple` lies between: the mean of the plant's equations over a period of the carrier drives a state from which the
    ripple is taken at the start and to which it is put back at the end, at little more than the price of the mean.
    States at the samples are then right up to the square of the carrier's period against the plant's time constants.

    Args:
        frequency: carrier, Hz. supply: V at no load.
        dead_time: s lost of each pulse. sag: fraction of the supply lost at full duty.
        switched: integrate every pulse instead of the mean.
        ripple: second-order averaging instead of the mean.

    Reference:
        J. A. Sanders, F. Verhulst, J. Murdock, "Averaging Methods in Nonlinear Dynamical Systems", 2nd ed., 2007,
        section 2.9 (second-order averaging).

    Examples:
        >>> ulna.Hardware(period=1e-3, drive=ulna.Pwm(frequency=20e3, supply=24)).drive
        Pwm(frequency=20000.0, supply=24, dead_time=0.0, sag=0.0, switched=False, ripple=False)
    """

    frequency: float
    supply: float
    dead_time: float = 0.0
    sag: float = 0.0
    switched: bool = False
    ripple: bool = False

    def __post_init__(self) -> None:
        for name, value in (("frequency", self.frequency), ("supply", self.supply)):
            if not (0 < value < math.inf):
                raise SimulationError(f"Pwm({name}={value})", "it must be a positive number.")
        if not (0 <= self.dead_time * self.frequency < 1):
            raise SimulationError(
                f"Pwm(dead_time={self.dead_time})", f"it does not fit in a carrier period of {1 / self.frequency:g} s."
            )
        if not (0 <= self.sag < 1):
            raise SimulationError(f"Pwm(sag={self.sag})", "expected a number in [0, 1).")
        if self.switched and self.ripple:
            raise SimulationError("Pwm(switched=True, ripple=True)", "pulses are integrated or averaged, not both.")

    @property
    def pulsed(self) -> bool:
        """Whether the plant gets more than the mean."""
        return self.switched or self.ripple


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Amplifier:
    """A drive that gives what it can: at each sample the command is cut to bounds that depend on the plant's state.

    A battery behind its resistance and a current limit are such bounds:
    `upper = "min(V, cell - Rb*i, emf*omega + Ra*peak)"`. Where the bounds cross, the lower one wins.

    Args:
        lower, upper: SI, formulas (text or expressions) of the plant's states and parameters and of `numbers`.
        numbers: SI values of further names in the formulas.
        measured: the controller reads what is applied, as an amplifier that measures tells it; else it believes that
            its limited command is.

    Examples:
        >>> drive = ulna.Amplifier(lower="-24 + 0.1*omega", upper="24 + 0.1*omega")
        >>> ulna.Hardware(period=1e-3, drive=drive).period
        0.001
    """

    lower: str | sp.Expr
    upper: str | sp.Expr
    numbers: Mapping[str, float] = field(default_factory=dict)
    measured: bool = True
