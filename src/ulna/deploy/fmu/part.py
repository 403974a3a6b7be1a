"""`FmuPart`: what of a loop becomes an FMU, and the model that it is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from ulna.loop import Repeat
from ulna.program import Kernel
from ulna.system import Signal


class FmuPart(StrEnum):
    """What an FMU holds: the whole loop, its controller alone, or its plant alone."""

    LOOP = "loop"
    CONTROLLER = "controller"
    PLANT = "plant"


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """A number that an importer sees.

    Attributes:
        name: as it is shown. signal: unit and text. slot: of the model. start: SI, before the first sample.
        causality: "input", "output", "parameter" (set before the start) or "local" (a state, its start may be set).
        further: slots that begin with the same value. flag: whether 1 is shown where the slot is not 0.
    """

    name: str
    signal: Signal
    slot: str
    causality: str
    start: float = 0.0
    further: tuple[str, ...] = ()
    flag: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """Slots and the kernels that work on them.

    Attributes:
        name: of the FMU. identifier: in C. fingerprint: of the design. text: what it is.
        variables: what an importer sees, after the time.
        begin: once, from parameters. sample: at the beginning of a period. motion: over `span` from `time`.
        shown: outputs at the present state, between samples.
        numbers: values of names that hold for ever.
        period: s of the processor, or of the longest step of a plant alone. sampled: whether it is a processor's.
        dense: whether outputs between samples are those of the motion so far.
    """

    name: str
    identifier: str
    fingerprint: str
    text: str
    variables: tuple[Variable, ...]
    begin: Kernel | None
    sample: tuple[Kernel, ...]
    motion: tuple[Kernel | Repeat, ...]
    shown: tuple[Kernel, ...]
    numbers: Mapping[str, float]
    period: float
    sampled: bool
    dense: bool
