"""Arithmetic by name: kernels rewritten so that they round alike in every language."""

from ulna.program.arithmetic.arithmetic import AbstractArithmetic, Fused, Plain
from ulna.program.arithmetic.rewriting import in_arithmetic

__all__ = ["AbstractArithmetic", "Fused", "Plain", "in_arithmetic"]
