"""Kernels as functions of C99."""

from ulna.program.lowering.c.header import C_FLAGS, c_header
from ulna.program.lowering.c.printer import to_c

__all__ = ["C_FLAGS", "c_header", "to_c"]
