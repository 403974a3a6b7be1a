"""`Fused` and `Plain` arithmetic: which elementary steps a kernel may consist of.

A call of a mathematical library rounds otherwise in every language, and in its vector form otherwise than alone.
Written out, a function gives the same bits in any language that has the elementary steps, for one run and for many.
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from ulna.program.instructions import Operation
from ulna.program.precision import Precision
from ulna.program.scalar import Scalar


class AbstractArithmetic(ABC):
    """The steps a kernel may consist of."""

    fuses: ClassVar[bool]
    """Whether a product and the sum that it enters are rounded once."""
    precision: Precision

    def plus_product(self, a: Scalar, b: Scalar | float, c: Scalar | float) -> Scalar:
        """a·b + c."""
        return a.apply(Operation.FMA, b, c) if self.fuses else a * b + c

    def polynomial(self, x: Scalar, coefficients: Sequence[float]) -> Scalar:
        """Σ c_k x^k by Horner's rule, the constant term first."""
        value = x.like(coefficients[-1])
        for coefficient in reversed(coefficients[:-1]):
            value = self.plus_product(x, value, coefficient)
        return value


@dataclass(frozen=True, slots=True, kw_only=True)
class Fused(AbstractArithmetic):
    """+, −, ×, ÷, √, comparisons, and the fused multiply-add of processors: fast and accurate, not for JavaScript.

    A product that is added or subtracted is fused with the sum; of two products the second one.

    Fields:
        precision: that of the numbers in the lowering.

    Examples:
        >>> ulna.Hardware(period=1e-3, arithmetic=ulna.Fused()).arithmetic
        Fused(precision=<Precision.DOUBLE: 'double'>)
    """

    fuses = True
    precision: Precision = Precision.DOUBLE


@dataclass(frozen=True, slots=True, kw_only=True)
class Unwritten(AbstractArithmetic):
    """Functions stay functions: for derivatives, which are taken before an arithmetic is chosen."""

    fuses = True
    precision: Precision = Precision.DOUBLE


@dataclass(frozen=True, slots=True, kw_only=True)
class Plain(AbstractArithmetic):
    """+, −, ×, ÷, √ and comparisons, each rounded alone: the same bits in every language.

    Fields:
        precision: that of the numbers in the lowering.

    Examples:
        >>> ulna.Hardware(period=1e-3, arithmetic=ulna.Plain()).arithmetic
        Plain(precision=<Precision.DOUBLE: 'double'>)
    """

    fuses = False
    precision: Precision = Precision.DOUBLE
