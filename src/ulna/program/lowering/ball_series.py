"""A smooth `Kernel` on power series with ball coefficients: enclosures of Taylor coefficients along a curve.

The number of coefficients and their precision are those of `flint.ctx` at the moment.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from operator import methodcaller
from typing import Any

from flint import arb, arb_series

from ulna.program.instructions import Operation
from ulna.program.kernel import Kernel
from ulna.program.lowering.balls import FUNCTIONS, evaluator

Series = Any
"""An `arb_series`, or an `arb` where nothing moves."""


def to_ball_series(kernel: Kernel) -> Callable[..., tuple[Series, ...]]:
    """A function from series (or balls, for what does not move) of the inputs, in order, to those of the outputs.

    Raises:
        UlnaError: for an operation that `tangents` refuses, too.
    """
    return evaluator(kernel, _SERIES)


def lowest(value: Series) -> arb:
    """The value at the start of the curve."""
    return value[0] if isinstance(value, arb_series) else value


def _over(above: Series, below: Series) -> Series:
    return arb("nan") if lowest(below).contains(0) else above / below


def _power(base: Series, exponent: Series) -> Series:
    known = exponent.unique_fmpz() if isinstance(exponent, arb) and exponent.is_exact() else None
    if known is not None:
        whole = int(known)
        return base**whole if whole >= 0 else _over(arb(1), base**-whole)
    return base**exponent


def _sinh(a: Series) -> Series:
    return (a.exp() - (-a).exp()) / 2


def _cosh(a: Series) -> Series:
    return (a.exp() + (-a).exp()) / 2


_AFFINE = (Operation.ADD, Operation.SUB, Operation.MUL, Operation.NEG, Operation.FMA)
_METHODS = ("sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan")
_SERIES: Mapping[Operation, Callable[..., Series]] = {
    **{operation: FUNCTIONS[operation] for operation in _AFFINE},
    **{Operation(name): methodcaller(name) for name in _METHODS},
    Operation.DIV: _over,
    Operation.POW: _power,
    Operation.SINH: _sinh,
    Operation.COSH: _cosh,
    Operation.TANH: lambda a: _sinh(a) / _cosh(a),
}
