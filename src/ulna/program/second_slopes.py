"""First and second derivatives of a kernel at a point along given directions, in ball arithmetic.

Every value is a + b ε + c δ + d εδ with ε² = δ² = 0: b and c are the slopes along two directions, d is the mixed second
slope (Griewank and Walther, Evaluating Derivatives, 2nd ed., section 13.1). Nothing symbolic is differentiated, so a
program of thousands of operations takes milliseconds. A rounded constant counts as any number that rounds to it: what
is certainly not zero here is certainly not zero for the exact constants.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import flint
from flint import arb

from ulna.base import UlnaError
from ulna.program.instructions import Operation
from ulna.program.kernel import Kernel

Jet = tuple[arb, arb, arb, arb]
"""(value, slope along the first direction, slope along the second, mixed second slope)."""

BITS = 200
"""Working precision of the balls."""
_ZERO = arb(0)


def second_slopes(
    program: Kernel,
    point: Mapping[str, arb],
    first: Mapping[str, arb],
    second: Mapping[str, arb] | None = None,
) -> dict[str, Jet]:
    """The jet of every output; NaN balls where it does not exist.

    Args:
        program: smooth in the inputs that move.
        point: a ball for every input.
        first, second: the directions by input; inputs left out do not move.

    Raises:
        UlnaError: for an operation without derivatives.
    """
    other = second or {}
    with flint.ctx.workprec(BITS):
        values: list[Jet] = [
            (point[name], first.get(name, _ZERO), other.get(name, _ZERO), _ZERO) for name in program.inputs
        ]
        for instruction in program.instructions:
            if instruction.operation is Operation.CONSTANT:
                values.append((_rounded(instruction.value), _ZERO, _ZERO, _ZERO))
                continue
            rule = _RULES.get(instruction.operation)
            if rule is None:
                found = f"'{instruction.operation}' has no second derivative here."
                raise UlnaError(f"slopes of '{program.name}'", found, "Write the plant with smooth functions.")
            values.append(rule([values[k] for k in instruction.operands]))
        return {label: values[k] for label, k in zip(program.outputs, program.results, strict=True)}


def _rounded(value: float) -> arb:
    """Every number that rounds to the double; small whole numbers stand for themselves."""
    if value == int(value) and abs(value) < 2**20:
        return arb(value)
    return arb(value, abs(value) * 2.0**-52)


def _plus(a: Jet, b: Jet) -> Jet:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3])


def _minus(a: Jet, b: Jet) -> Jet:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3])


def _times(a: Jet, b: Jet) -> Jet:
    return (
        a[0] * b[0],
        a[0] * b[1] + a[1] * b[0],
        a[0] * b[2] + a[2] * b[0],
        a[0] * b[3] + a[3] * b[0] + a[1] * b[2] + a[2] * b[1],
    )


def _chain(a: Jet, value: arb, slope: arb, curvature: arb) -> Jet:
    return (value, slope * a[1], slope * a[2], slope * a[3] + curvature * a[1] * a[2])


def _reciprocal(a: Jet) -> Jet:
    value = 1 / a[0]
    return _chain(a, value, -value * value, 2 * value**3)


def _sine(a: Jet) -> Jet:
    sine, cosine = a[0].sin(), a[0].cos()
    return _chain(a, sine, cosine, -sine)


def _cosine(a: Jet) -> Jet:
    sine, cosine = a[0].sin(), a[0].cos()
    return _chain(a, cosine, -sine, -cosine)


def _tangent(a: Jet) -> Jet:
    value = a[0].tan()
    slope = 1 + value * value
    return _chain(a, value, slope, 2 * value * slope)


def _exponential(a: Jet) -> Jet:
    value = a[0].exp()
    return _chain(a, value, value, value)


def _logarithm(a: Jet) -> Jet:
    inverse = 1 / a[0]
    return _chain(a, a[0].log(), inverse, -inverse * inverse)


def _root(a: Jet) -> Jet:
    value = a[0].sqrt()
    slope = 1 / (2 * value)
    return _chain(a, value, slope, -slope / (2 * a[0]))


def _power(a: Jet, b: Jet) -> Jet:
    if not (b[1] == 0 and b[2] == 0 and b[3] == 0):
        return _exponential(_times(b, _logarithm(a)))
    value = a[0] ** b[0]
    return _chain(a, value, b[0] * value / a[0], b[0] * (b[0] - 1) * value / (a[0] * a[0]))


def _arc_tangent(a: Jet) -> Jet:
    slope = 1 / (1 + a[0] * a[0])
    return _chain(a, a[0].atan(), slope, -2 * a[0] * slope * slope)


def _hyperbolic_sine(a: Jet) -> Jet:
    return _chain(a, a[0].sinh(), a[0].cosh(), a[0].sinh())


def _hyperbolic_cosine(a: Jet) -> Jet:
    return _chain(a, a[0].cosh(), a[0].sinh(), a[0].cosh())


def _hyperbolic_tangent(a: Jet) -> Jet:
    value = a[0].tanh()
    slope = 1 - value * value
    return _chain(a, value, slope, -2 * value * slope)


def _one(rule: Callable[[Jet], Jet]) -> Callable[[Sequence[Jet]], Jet]:
    return lambda operands: rule(operands[0])


def _two(rule: Callable[[Jet, Jet], Jet]) -> Callable[[Sequence[Jet]], Jet]:
    return lambda operands: rule(operands[0], operands[1])


_RULES: dict[Operation, Callable[[Sequence[Jet]], Jet]] = {
    Operation.ADD: _two(_plus),
    Operation.SUB: _two(_minus),
    Operation.MUL: _two(_times),
    Operation.DIV: _two(lambda a, b: _times(a, _reciprocal(b))),
    Operation.NEG: _one(lambda a: (-a[0], -a[1], -a[2], -a[3])),
    Operation.POW: _two(_power),
    Operation.SQRT: _one(_root),
    Operation.EXP: _one(_exponential),
    Operation.LOG: _one(_logarithm),
    Operation.SIN: _one(_sine),
    Operation.COS: _one(_cosine),
    Operation.TAN: _one(_tangent),
    Operation.ATAN: _one(_arc_tangent),
    Operation.SINH: _one(_hyperbolic_sine),
    Operation.COSH: _one(_hyperbolic_cosine),
    Operation.TANH: _one(_hyperbolic_tangent),
}
