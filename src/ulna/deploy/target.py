"""`Target`: the processor that C is written for. The text is the same for all; precision and flags are not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from ulna.program import Precision


@dataclass(frozen=True, slots=True, kw_only=True)
class Board:
    """A board that QEMU emulates: its `machine` and `core` there, its `flash` and `memory` as a linker writes them."""

    machine: str
    core: str
    flash: str
    memory: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """A processor.

    Attributes:
        name: as on the command line. text: what it is.
        precision: of the numbers that its floating-point unit computes, chosen unless the user says otherwise.
        compiler: that builds for it. flags: that choose it. board: that has it, where instructions can be counted.
    """

    name: str
    text: str
    precision: Precision
    compiler: str
    flags: tuple[str, ...] = ()
    board: Board | None = None


_ARM = ("-mthumb",)

TARGETS: Mapping[str, Target] = MappingProxyType(
    {
        each.name: each
        for each in (
            Target(name="generic", text="any processor with C99", precision=Precision.DOUBLE, compiler="cc"),
            Target(
                name="cortex-m0",
                text="Arm Cortex-M0, without a floating-point unit: every operation is a call",
                precision=Precision.SINGLE,
                compiler="arm-none-eabi-gcc",
                flags=("-mcpu=cortex-m0", *_ARM, "-mfloat-abi=soft"),
                board=Board(machine="microbit", core="cortex-m0", flash="256K", memory="16K"),
            ),
            Target(
                name="cortex-m4f",
                text="Arm Cortex-M4F, floating-point unit of single precision",
                precision=Precision.SINGLE,
                compiler="arm-none-eabi-gcc",
                flags=("-mcpu=cortex-m4", *_ARM, "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"),
                board=Board(machine="mps2-an386", core="cortex-m4", flash="4M", memory="4M"),
            ),
            Target(
                name="cortex-m7",
                text="Arm Cortex-M7, floating-point unit of double precision",
                precision=Precision.DOUBLE,
                compiler="arm-none-eabi-gcc",
                flags=("-mcpu=cortex-m7", *_ARM, "-mfloat-abi=hard", "-mfpu=fpv5-d16"),
                board=Board(machine="mps2-an500", core="cortex-m7", flash="4M", memory="4M"),
            ),
        )
    }
)
"""Targets by name."""
