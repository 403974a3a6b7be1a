"""Polynomials by Horner's rule."""

from __future__ import annotations

from collections.abc import Sequence

from ulna.program.instructions import Operation
from ulna.program.scalar import Scalar


def fused(a: Scalar, b: Scalar | float, c: Scalar | float) -> Scalar:
    """a·b + c rounded once."""
    return a.apply(Operation.FMA, b, c)


def polynomial(x: Scalar, coefficients: Sequence[float]) -> Scalar:
    """Σ c_k x^k, the constant term first."""
    value = x.like(coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        value = fused(x, value, coefficient)
    return value
