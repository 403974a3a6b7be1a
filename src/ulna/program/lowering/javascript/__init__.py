"""Kernels as functions of JavaScript."""

from ulna.program.lowering.javascript.printer import to_javascript, to_javascript_in_place

__all__ = ["to_javascript", "to_javascript_in_place"]
