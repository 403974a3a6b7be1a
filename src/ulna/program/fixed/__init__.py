"""Kernels in fixed point: integers of 32 bits, scaled by intervals."""

from ulna.program.fixed.builder import UnboundedError
from ulna.program.fixed.integers import Doubt, Format, IntegerInstruction, IntegerProgram, Step
from ulna.program.fixed.scaled import format_of, to_fixed

__all__ = ["Doubt", "Format", "IntegerInstruction", "IntegerProgram", "Step", "UnboundedError", "format_of", "to_fixed"]
