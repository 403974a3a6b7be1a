"""Expressions compiled into a `Kernel`."""

from ulna.symbolic.compiling.kernel import kernel
from ulna.symbolic.compiling.sympy_reader import rounded

__all__ = ["kernel", "rounded"]
