"""A controller on the bench, and the numbers that fill it."""

from __future__ import annotations

from dataclasses import dataclass

from ulna.design import Compensator
from ulna.loop import parts_of
from ulna.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class Tuned:
    """A number that tuning may choose. start: where the search begins; lower, upper: its bounds."""

    name: str
    start: float
    lower: float
    upper: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Contender:
    """A controller and how it is tuned.

    Attributes:
        key, title: for files and people. note: what it is, in a sentence.
        controller: a system or a compensator; it reads the encoder's angle y, the reference y_ref with its derivatives,
            and speed and current where it has sensors for them. Its parameters have no values.
        tuned: what tuning chooses.
        proposed: whether it is one of the designs of this package or the paper, rather than common practice.
        measures_all: whether it reads speed and current sensors.
    """

    key: str
    title: str
    note: str
    controller: System | Compensator
    tuned: tuple[Tuned, ...]
    proposed: bool
    measures_all: bool = False

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the numbers that its formulas want."""
        return tuple(p.name for p in parts_of(self.controller).system.parameters)
