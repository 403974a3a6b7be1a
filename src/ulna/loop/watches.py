"""What a processor watches besides numbers that are not finite: its clock, its references, its estimator."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from ulna.base import SimulationError
from ulna.loop.reaction import Hold, Reaction


@dataclass(frozen=True, slots=True, kw_only=True)
class Deadline:
    """Calls that come late, and samples missed in a row, are faults.

    The step is told the time since its last call (`elapsed`). A call more than `lateness` after its period sets the bit
    `Fault.LATE` and reacts for this one sample; estimator and integrals advance by one period, as always. More than
    `missed` samples missed in a row set `Fault.MISSED` and react until the next sample comes; up to that number the
    command is held and no fault is told.

    Args:
        lateness: s beyond the period; None asks for no time.
        missed: samples in a row that may be missed; None for any number.
        reaction: to either.

    Examples:
        >>> late = ulna.Deadline(missed=3, reaction=ulna.SafeOutput(0.0))
        >>> ulna.Hardware(period=1e-3, deadline=late).deadline.missed
        3
    """

    lateness: float | None = None
    missed: int | None = None
    reaction: Reaction = field(default_factory=Hold)

    def __post_init__(self) -> None:
        if self.lateness is None and self.missed is None:
            raise SimulationError("Deadline()", "it watches nothing.", "Give lateness=1e-4, say, or missed=3.")
        if self.lateness is not None and not (0 <= self.lateness < math.inf):
            raise SimulationError(f"Deadline(lateness={self.lateness})", "expected a time of 0 s or more.")
        if self.missed is not None and not (0 <= self.missed <= MOST_SAMPLES):
            raise SimulationError(f"Deadline(missed={self.missed})", f"expected a number between 0 and {MOST_SAMPLES}.")


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceRange:
    """A reference out of its range sets `Fault.REFERENCE`, and the controller sees the nearest end of the range.

    One that is no number counts as out of range; the last one seen takes its place.

    Args:
        lower, upper: SI; None for the end that the signal itself declares.
        held: the last reference seen takes the place of any that is out of range.

    Examples:
        >>> ulna.ReferenceRange(lower=-1.0, upper=1.0, held=True)
        ReferenceRange(lower=-1.0, upper=1.0, held=True)
    """

    lower: float | None = None
    upper: float | None = None
    held: bool = False

    def __post_init__(self) -> None:
        low, high = (-math.inf if self.lower is None else self.lower), (math.inf if self.upper is None else self.upper)
        if not (low < high):
            raise SimulationError(
                f"ReferenceRange(lower={self.lower}, upper={self.upper})", "the lower end is not below the upper one."
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class InnovationLimit:
    """An estimator whose innovation is too large for too long has lost the plant: `Fault.LOST`.

    The innovation is the measured value less what the estimates say of it: those of this sample, of a Kalman filter
    those that it predicted. Samples that are missed or not finite do not count. The estimator goes on.

    Args:
        size: SI, of all measured signals that are estimated, or by name.
        samples: in a row with a larger innovation after which the plant is lost.
        resume: samples in a row within the size after which the controller takes over again; None for a fault that
            stays until the memory is initialised anew.
        reaction: while the plant is lost.

    Reference:
        R. Isermann, "Fault-Diagnosis Systems", Springer 2006, chapter 7 (limit checking).

    Examples:
        >>> ulna.InnovationLimit(size=0.1, samples=20, reaction=ulna.SafeOutput(0.0))
        InnovationLimit(size=0.1, samples=20, resume=None, reaction=SafeOutput(output=0.0))
    """

    size: float | Mapping[str, float]
    samples: int
    resume: int | None = None
    reaction: Reaction = field(default_factory=Hold)

    def __post_init__(self) -> None:
        sizes = self.size.values() if isinstance(self.size, Mapping) else (self.size,)
        if not all(0 < each < math.inf for each in sizes):
            raise SimulationError(f"InnovationLimit(size={self.size})", "it must be a positive number.")
        for name, value in (("samples", self.samples), ("resume", self.resume)):
            if value is not None and not (1 <= value <= MOST_SAMPLES):
                raise SimulationError(
                    f"InnovationLimit({name}={value})", f"expected a whole number from 1 to {MOST_SAMPLES}."
                )


MOST_SAMPLES = 1_000_000
"""In a row: they are counted exactly in single precision, too."""
