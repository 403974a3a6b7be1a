"""Rounding to whole numbers by additions."""

from __future__ import annotations

from ulna.base import UlnaError
from ulna.program.instructions import Instruction, Operation
from ulna.program.scalar import Scalar

ROUNDING = 6755399441055744.0
"""1.5 · 2^52: adding and subtracting it rounds to the nearest whole number, whose last bit ends the sum."""


def floor(value: Scalar) -> Scalar:
    """The largest whole number not above it; numbers from 2^51 on are whole for this purpose."""
    near = (value + ROUNDING) - ROUNDING
    whole = near.more(value).where(near - 1.0, near)
    return abs(value).less(2251799813685248.0).where(whole, value)


def refuse_rounded(name: str, instruction: Instruction) -> None:
    """Stop before a derivative of what has been written out: the slope of a rounding sum is 0, its rule says 1.

    Raises:
        UlnaError: for the constant that rounds.
    """
    if instruction.operation is Operation.CONSTANT and instruction.value == ROUNDING:
        raise UlnaError(
            f"derivatives of '{name}'",
            "it rounds to whole numbers, by a sum with 1.5 · 2^52: its functions are written out.",
            "Take derivatives first and choose the arithmetic last (`in_arithmetic`).",
        )
