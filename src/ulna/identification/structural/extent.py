"""How far a parameter can be known, and with which motion of the inputs."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from ulna.base import Verdict
from ulna.identification.structural.experiment import Motion


class Extent(StrEnum):
    """How far a parameter can be known from perfect records of the outputs."""

    GLOBALLY = "globally"
    """Only one value gives these outputs."""
    LOCALLY = "locally"
    """Near this value no other gives these outputs; whether one far off does is not known."""
    NOT = "not"
    """Values as near as one likes give the same outputs."""
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterAnswer:
    """What can be known of one parameter.

    Attributes:
        extent: how far it can be known, for almost all values of parameters, starts and inputs.
        verdict: on that.
        without_input: whether it can be known, at least locally, with all inputs at zero.
        needs: the least motion of the inputs with which it can be known; None where it cannot be known.
    """

    extent: Extent
    verdict: Verdict
    without_input: bool
    needs: Motion | None
