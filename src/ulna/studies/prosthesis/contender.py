"""A controller on the bench: a `System` that runs once a period, and the numbers that fill it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ulna.system import System

CONTROL_INPUTS = ("y", "omega", "i", "y_ref", "y_ref_d1", "y_ref_d2", "y_ref_d3", "u_applied")
"""What a controller may read: the encoder's angle; speed and current, where it has sensors for them; the reference; the
voltage that the motor really gets during the coming period."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tuned:
    """A number that tuning may choose. start: where the search begins; lower, upper: its bounds."""

    name: str
    start: float
    lower: float
    upper: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Contender:
    """A controller and how it is tuned.

    Attributes:
        key, title: for files and people. note: what it is, in a sentence.
        system: inputs among `CONTROL_INPUTS`, output u; its parameters get numbers from `numbers`.
        tuned: what tuning chooses.
        proposed: whether it is one of the designs of this package or the paper, rather than common practice.
        measures_all: whether it reads speed and current sensors.
    """

    key: str
    title: str
    note: str
    system: System
    tuned: tuple[Tuned, ...]
    proposed: bool
    measures_all: bool = False

    def starting_values(self) -> dict[str, float]:
        """Where the search begins."""
        return {entry.name: entry.start for entry in self.tuned}


Numbers = Mapping[str, float]
"""Values by parameter name."""
