"""Reactions to a fault: what a processor commands while it lasts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ulna.base import SimulationError


@dataclass(frozen=True, slots=True, kw_only=True)
class Hold:
    """The last command stays.

    Examples:
        >>> ulna.Guard(reaction=ulna.Hold())
        Guard(reaction=Hold(), largest=inf)
    """


@dataclass(frozen=True, slots=True)
class SafeOutput:
    """A stated command takes its place; slew limit and saturation act on it as on any other.

    Args:
        output: SI, of all driven inputs, or by name; inputs that a mapping leaves out hold their last command.

    Examples:
        >>> ulna.Guard(reaction=ulna.SafeOutput({"u": 0.0}))
        Guard(reaction=SafeOutput(output={'u': 0.0}), largest=inf)
    """

    output: float | Mapping[str, float]

    def __post_init__(self) -> None:
        values = self.output.values() if isinstance(self.output, Mapping) else (self.output,)
        if not all(map(math.isfinite, values)):
            raise SimulationError(f"SafeOutput({self.output})", "the safe output must be a finite number.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """The controller goes on; only the fault code tells.

    Examples:
        >>> ulna.InnovationLimit(size=0.1, samples=20, reaction=ulna.Report())
        InnovationLimit(size=0.1, samples=20, resume=None, reaction=Report())
    """


Reaction = Hold | SafeOutput | Report
"""What a processor commands while a fault lasts."""


def commanded(reaction: Reaction, name: str) -> float | None:
    """The safe output of a driven input, None where its last command is held."""
    if not isinstance(reaction, SafeOutput):
        return None
    return reaction.output.get(name) if isinstance(reaction.output, Mapping) else reaction.output
