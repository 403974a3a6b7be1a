"""Kernels as functions of C99."""

from ulna.program.lowering.c.header import C_FLAGS, c_header
from ulna.program.lowering.c.integers import integer_header, integer_literal, integer_statements
from ulna.program.lowering.c.printer import c_literal, c_statements, to_c

__all__ = [
    "C_FLAGS",
    "c_header",
    "c_literal",
    "c_statements",
    "integer_header",
    "integer_literal",
    "integer_statements",
    "to_c",
]
