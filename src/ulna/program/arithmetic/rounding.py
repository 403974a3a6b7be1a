"""Rounding to whole numbers by additions."""

from __future__ import annotations

from ulna.base import UlnaError
from ulna.program.arithmetic.arithmetic import AbstractArithmetic
from ulna.program.instructions import Instruction, Operation
from ulna.program.precision import Precision
from ulna.program.scalar import Scalar

ROUNDING = 6755399441055744.0
"""1.5 · 2^52: adding and subtracting it rounds to the nearest whole number, whose last bit ends the sum."""


def rounding(precision: Precision) -> float:
    """1.5 · 2^52 or, in single precision, 1.5 · 2^23."""
    return 1.5 * 2.0 ** (precision.bits - 1)


def floor(arithmetic: AbstractArithmetic, value: Scalar) -> Scalar:
    """The largest whole number not above it; numbers from 2^51 (single: 2^22) on are whole for this purpose."""
    shift = rounding(arithmetic.precision)
    near = (value + shift) - shift
    whole = near.more(value).where(near - 1.0, near)
    return abs(value).less(2.0 ** (arithmetic.precision.bits - 2)).where(whole, value)


_SHIFTS = frozenset(rounding(precision) for precision in Precision)


def refuse_rounded(name: str, instruction: Instruction) -> None:
    """Stop before a derivative of what has been written out: the slope of a rounding sum is 0, its rule says 1.

    Raises:
        UlnaError: for the constant that rounds.
    """
    if instruction.operation is Operation.CONSTANT and instruction.value in _SHIFTS:
        raise UlnaError(
            f"derivatives of '{name}'",
            f"it rounds to whole numbers, by a sum with {instruction.value:.0f}: its functions are written out.",
            "Take derivatives first and choose the arithmetic last (`in_arithmetic`).",
        )
