"""`Moving`: a ball with its slopes, and kernels with limits computed in such pairs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from flint import arb, arb_mat, fmpq

from ulna.certify.errors import CertifyError
from ulna.program import Kernel, Operation


@dataclass(frozen=True, slots=True)
class Moving:
    """A value and its derivatives by some coordinates (one row), in balls; None where nothing moves it."""

    value: arb
    slope: arb_mat | None = None


_ONE = arb(1)
_UNARY: Mapping[Operation, Callable[[arb], tuple[arb, arb]]] = {
    Operation.NEG: lambda x: (-x, -_ONE),
    Operation.SQRT: lambda x: (x.sqrt(), 1 / (2 * x.sqrt())),
    Operation.EXP: lambda x: (x.exp(), x.exp()),
    Operation.LOG: lambda x: (x.log(), 1 / x),
    Operation.SIN: lambda x: (x.sin(), x.cos()),
    Operation.COS: lambda x: (x.cos(), -x.sin()),
    Operation.TAN: lambda x: (x.tan(), 1 + x.tan() ** 2),
    Operation.ASIN: lambda x: (x.asin(), 1 / (1 - x * x).sqrt()),
    Operation.ACOS: lambda x: (x.acos(), -1 / (1 - x * x).sqrt()),
    Operation.ATAN: lambda x: (x.atan(), 1 / (1 + x * x)),
    Operation.SINH: lambda x: (x.sinh(), x.cosh()),
    Operation.COSH: lambda x: (x.cosh(), x.sinh()),
    Operation.TANH: lambda x: (x.tanh(), 1 - x.tanh() ** 2),
    Operation.ASINH: lambda x: (x.asinh(), 1 / (1 + x * x).sqrt()),
    Operation.ACOSH: lambda x: (x.acosh(), 1 / (x * x - 1).sqrt()),
    Operation.ATANH: lambda x: (x.atanh(), 1 / (1 - x * x)),
    Operation.ABS: lambda x: (abs(x), x.sgn()),
}
"""Value and derivative of functions of one argument; at a kink anything between both sides."""
_TESTS: Mapping[Operation, Callable[[arb, arb], tuple[bool, bool]]] = {
    Operation.LESS: lambda a, b: (a < b, a >= b),
    Operation.LESS_EQUAL: lambda a, b: (a <= b, a > b),
    Operation.EQUAL: lambda a, b: (a == b, a != b),
}
"""Whether a comparison certainly holds, and whether it certainly does not."""


def moved_by(kernel: Kernel, known: Mapping[str, Moving]) -> dict[str, Moving]:
    """The outputs of a kernel by name, with their slopes. A constant is the number of the processor, exactly.

    A choice between two values by comparing them is the smaller or larger one: where it is open, its slope is anything
    between both.

    Raises:
        CertifyError: for an operation that jumps where the balls leave open on which side they are.
    """
    first = len(kernel.inputs)
    values = [known[name] for name in kernel.inputs]
    for each in kernel.instructions:
        values.append(_computed(kernel, first, each.operation, each.operands, values, each.value))
    return {name: values[k] for name, k in zip(kernel.outputs, kernel.results, strict=True)}


def _computed(
    kernel: Kernel, first: int, operation: Operation, operands: Sequence[int], values: Sequence[Moving], number: float
) -> Moving:
    given = [values[k] for k in operands]
    if operation is Operation.CONSTANT:
        return Moving(arb(number))
    if operation in _SUMS:
        return _SUMS[operation](*given)
    if operation in _UNARY:
        value, slope = _UNARY[operation](given[0].value)
        return Moving(value, _times(given[0].slope, slope))
    if operation in _TESTS:
        yes, no = _TESTS[operation](given[0].value, given[1].value)
        return Moving(_ONE if yes else arb(0) if no else arb("nan"))
    if operation is Operation.SELECT:
        return _chosen(kernel, first, operands, values)
    if operation in _FLAT:
        return Moving(_flat(operation, [each.value for each in given]))
    raise CertifyError(
        f"a proof for '{kernel.name}'", f"'{operation}' has no derivative here.", "Write the controller without it."
    )


_FLAT = (Operation.AND, Operation.OR, Operation.NOT, Operation.FLOOR, Operation.SIGN)


def _flat(operation: Operation, given: Sequence[arb]) -> arb:
    """What does not move where it is certain; NaN where it is not."""
    if operation in (Operation.FLOOR, Operation.SIGN):
        value = given[0].floor() if operation is Operation.FLOOR else given[0].sgn()
        return value if value.is_exact() else arb("nan")
    if operation is Operation.NOT:
        return 1 - given[0]
    zero, certain = [v == 0 for v in given], all(v.is_finite() for v in given)
    if operation is Operation.AND:
        return arb(0) if any(zero) else _ONE if certain else arb("nan")
    return _ONE if any(v == 1 for v in given) else arb(0) if all(zero) else arb("nan")


def _chosen(kernel: Kernel, first: int, operands: Sequence[int], values: Sequence[Moving]) -> Moving:
    condition, yes, no = operands
    test = kernel.instructions[condition - first] if condition >= first else None
    if test is not None and test.operation in (Operation.LESS, Operation.LESS_EQUAL):
        if test.operands == (yes, no):
            return limited(values[yes], values[no], smaller=True)
        if test.operands == (no, yes):
            return limited(values[yes], values[no], smaller=False)
    truth = values[condition].value
    if truth == 0:
        return values[no]
    if truth.is_finite() and not truth.contains(0):
        return values[yes]
    # What is chosen is not known, so nothing is known of it.
    return Moving(arb("nan"))


def limited(a: Moving, b: Moving, *, smaller: bool) -> Moving:
    """The smaller or the larger of two; where it is open which, its slope is anything between both."""
    if a.value < b.value or b.value < a.value:
        return a if (a.value < b.value) == smaller else b
    value = a.value.min(b.value) if smaller else a.value.max(b.value)
    both = _sum(a.slope, b.slope)
    if both is None:
        return Moving(value)
    difference = _sum(a.slope, _times(b.slope, -_ONE))
    return Moving(value, _sum(both * arb(0.5), _times(difference, arb(0, 0.5))))


def _quotient(a: Moving, b: Moving) -> Moving:
    value = a.value / b.value
    return Moving(value, _times(_sum(a.slope, _times(b.slope, -value)), 1 / b.value))


def _power(base: Moving, to: Moving) -> Moving:
    """A power of a fixed exponent; what moves in it is not followed."""
    exponent = to.value
    if to.slope is not None or not exponent.is_exact():
        return Moving(arb("nan"))
    whole = exponent.unique_fmpz() if exponent.is_integer() else None
    power = exponent if whole is None else whole
    slope = fmpq(0) if whole == 0 else power * base.value ** (power - 1)
    return Moving(base.value**power, _times(base.slope, arb(slope)))


def _product(a: Moving, b: Moving) -> Moving:
    return Moving(a.value * b.value, _sum(_times(a.slope, b.value), _times(b.slope, a.value)))


def _sum(a: arb_mat | None, b: arb_mat | None) -> arb_mat | None:
    return b if a is None else a if b is None else a + b


def _times(a: arb_mat | None, factor: arb) -> arb_mat | None:
    return None if a is None else a * factor


_SUMS: Mapping[Operation, Callable[..., Moving]] = {
    Operation.ADD: lambda a, b: Moving(a.value + b.value, _sum(a.slope, b.slope)),
    Operation.SUB: lambda a, b: Moving(a.value - b.value, _sum(a.slope, _times(b.slope, -_ONE))),
    Operation.MUL: _product,
    Operation.FMA: lambda a, b, c: _SUMS[Operation.ADD](_product(a, b), c),
    Operation.DIV: _quotient,
    Operation.POW: _power,
    Operation.MIN: lambda a, b: limited(a, b, smaller=True),
    Operation.MAX: lambda a, b: limited(a, b, smaller=False),
}
