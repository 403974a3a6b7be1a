"""Expressions compiled into a `Kernel`."""

from ulna.symbolic.compiling.batch import BatchFunction, batch_jacobian, batch_vector
from ulna.symbolic.compiling.from_expressions import kernel
from ulna.symbolic.compiling.sympy_reader import rounded

__all__ = [
    "BatchFunction",
    "batch_jacobian",
    "batch_vector",
    "kernel",
    "rounded",
]
