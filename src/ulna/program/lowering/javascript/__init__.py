"""Kernels as functions of JavaScript."""

from ulna.program.lowering.javascript.printer import to_javascript

__all__ = ["to_javascript"]
