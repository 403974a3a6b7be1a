"""Derivatives of a kernel along some of its inputs, and a kernel with inputs held at zero: kernels in, kernels out."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

from ulna.base import UlnaError
from ulna.program.arithmetic.rounding import refuse_rounded
from ulna.program.instructions import Instruction, InstructionList, Operation, pruned
from ulna.program.kernel import Kernel, check_names, copied


def tangents(original: Kernel, along: Sequence[str], *, piecewise: bool = False) -> Kernel:
    """The kernel of ∂output/∂input for every output and every input in `along`, named `output/input`.

    Forward mode, one sweep for each input; what does not depend on the input costs nothing.

    Args:
        original: what is differentiated. along: its inputs.
        piecewise: whether it may have kinks and jumps; the slopes are those of the branch taken, on a kink of one side.

    Raises:
        UlnaError: for an operation without a derivative.
    """
    out = InstructionList(len(original.inputs))
    values = copied(original, out)
    outputs, results = [], []
    for name in along:
        start = {original.inputs.index(name): out.constant(1.0)}
        slopes = _sweep(original, out, values, start, piecewise=piecewise)
        for output, result in zip(original.outputs, original.results, strict=True):
            slope = slopes[result]
            outputs.append(f"{output}/{name}")
            results.append(out.constant(0.0) if slope is None else slope)
    instructions, kept = pruned(len(original.inputs), out.instructions, results)
    return Kernel(
        name=f"slopes of {original.name}",
        inputs=original.inputs,
        outputs=tuple(outputs),
        instructions=instructions,
        results=kept,
    )


def slopes_along(original: Kernel, speeds: Mapping[str, str], *, piecewise: bool = False) -> Kernel:
    """The kernel of Σ ∂output/∂input · speed for every output, under its own name.

    Applied twice it gives mixed second slopes (Griewank and Walther, Evaluating Derivatives, 2nd ed., section 13.1).

    Args:
        original: smooth in the inputs that move. piecewise: see `tangents`.
        speeds: for each of those the name of its speed, which becomes an input after those of the original.

    Raises:
        UlnaError: for an operation without a derivative.
    """
    inputs = (*original.inputs, *speeds.values())
    check_names(original.name, inputs, original.outputs)
    place = {name: k for k, name in enumerate(inputs)}
    out = InstructionList(len(inputs))
    values = copied(original, out)
    moving = {place[name]: place[speed] for name, speed in speeds.items()}
    slopes = _sweep(original, out, values, moving, piecewise=piecewise)
    found = [slopes[k] for k in original.results]
    results = [out.constant(0.0) if slope is None else slope for slope in found]
    instructions, kept = pruned(len(inputs), out.instructions, results)
    return Kernel(name=original.name, inputs=inputs, outputs=original.outputs, instructions=instructions, results=kept)


def at_zero(original: Kernel, zeros: Collection[str]) -> Kernel:
    """The kernel with some inputs zero: what they multiply disappears. The inputs stay, unused."""
    out = InstructionList(len(original.inputs))
    values: list[int | None] = [None if name in set(zeros) else k for k, name in enumerate(original.inputs)]
    for instruction in original.instructions:
        values.append(_folded(out, instruction, [values[k] for k in instruction.operands]))
    results = [out.constant(0.0) if values[k] is None else values[k] for k in original.results]
    instructions, kept = pruned(len(original.inputs), out.instructions, [k for k in results if k is not None])
    return Kernel(
        name=original.name,
        inputs=original.inputs,
        outputs=original.outputs,
        instructions=instructions,
        results=kept,
    )


def _folded(out: InstructionList, instruction: Instruction, operands: list[int | None]) -> int | None:
    """The instruction on operands some of which are zero (None)."""
    operation = instruction.operation
    if operation is Operation.CONSTANT:
        return None if instruction.value == 0.0 else out.constant(instruction.value)
    if all(k is not None for k in operands):
        return out.emit(operation, *(k for k in operands if k is not None))
    if operation in (Operation.ADD, Operation.SUB):
        left, right = operands
        if right is None:
            return left
        return out.emit(Operation.NEG, right) if operation is Operation.SUB else right
    if operation is Operation.MUL or (operation is Operation.DIV and operands[0] is None):
        return None
    if operation in (Operation.NEG, Operation.SIN, Operation.TAN, Operation.SINH, Operation.TANH):
        return None
    return out.emit(operation, *(out.constant(0.0) if k is None else k for k in operands))


def _sweep(
    original: Kernel, out: InstructionList, values: list[int], speeds: Mapping[int, int], *, piecewise: bool = False
) -> list[int | None]:
    """The slope of every value for inputs that move with given speeds, None where it is zero."""
    first = len(original.inputs)
    slopes: list[int | None] = [speeds.get(k) for k in range(first)]
    for position, instruction in enumerate(original.instructions):
        refuse_rounded(original.name, instruction)
        parts = [slopes[k] for k in instruction.operands]
        if all(part is None for part in parts):
            slopes.append(None)
            continue
        arguments = [values[k] for k in instruction.operands]
        if piecewise and instruction.operation in _BRANCHES:
            slopes.append(_branch(out, instruction.operation, arguments, parts))
            continue
        rule = _RULES.get(instruction.operation)
        if rule is None:
            raise UlnaError(
                f"slopes of '{original.name}'",
                f"'{instruction.operation}' has no derivative here.",
                "Write the plant with smooth functions.",
            )
        total: int | None = None
        for which, part in enumerate(parts):
            if part is None:
                continue
            term = rule(out, values[first + position], arguments, which, part)
            total = term if total is None else out.emit(Operation.ADD, total, term)
        slopes.append(total)
    return slopes


_FLAT = frozenset(
    {
        Operation.SIGN,
        Operation.FLOOR,
        Operation.LESS,
        Operation.LESS_EQUAL,
        Operation.EQUAL,
        Operation.AND,
        Operation.OR,
        Operation.NOT,
    }
)
_BRANCHES = _FLAT | {Operation.SELECT, Operation.MIN, Operation.MAX, Operation.ABS}


def _branch(out: InstructionList, operation: Operation, arguments: list[int], parts: list[int | None]) -> int | None:
    """The slope of the branch taken; None where it is flat."""
    if operation in _FLAT or (operation is Operation.SELECT and parts[1] is None and parts[2] is None):
        return None
    zero = out.constant(0.0)
    filled = [zero if part is None else part for part in parts]
    if operation is Operation.SELECT:
        return out.emit(Operation.SELECT, arguments[0], filled[1], filled[2])
    if operation is Operation.ABS:
        below = out.emit(Operation.LESS, arguments[0], zero)
        return out.emit(Operation.SELECT, below, out.emit(Operation.NEG, filled[0]), filled[0])
    order = arguments if operation is Operation.MIN else arguments[::-1]
    return out.emit(Operation.SELECT, out.emit(Operation.LESS, *order), *filled)


_Rule = Callable[[InstructionList, int, list[int], int, int], int]


def _linear(sign: float) -> _Rule:
    def rule(out: InstructionList, _own: int, _arguments: list[int], which: int, part: int) -> int:
        return out.emit(Operation.NEG, part) if which == 1 and sign < 0 else part

    return rule


def _negated(out: InstructionList, _own: int, _arguments: list[int], _which: int, part: int) -> int:
    return out.emit(Operation.NEG, part)


def _product(out: InstructionList, _own: int, arguments: list[int], which: int, part: int) -> int:
    return out.emit(Operation.MUL, part, arguments[1 - which])


def _fused(out: InstructionList, _own: int, arguments: list[int], which: int, part: int) -> int:
    return part if which == 2 else out.emit(Operation.MUL, part, arguments[1 - which])


def _quotient(out: InstructionList, own: int, arguments: list[int], which: int, part: int) -> int:
    if which == 0:
        return out.emit(Operation.DIV, part, arguments[1])
    return out.emit(Operation.NEG, out.emit(Operation.DIV, out.emit(Operation.MUL, own, part), arguments[1]))


def _power(out: InstructionList, own: int, arguments: list[int], which: int, part: int) -> int:
    if which == 1:
        return out.emit(Operation.MUL, out.emit(Operation.MUL, own, out.emit(Operation.LOG, arguments[0])), part)
    scaled = out.emit(Operation.MUL, arguments[1], part)
    lowered = out.emit(Operation.SUB, arguments[1], out.constant(1.0))
    return out.emit(Operation.MUL, scaled, out.emit(Operation.POW, arguments[0], lowered))


def _outer(slope: Callable[[InstructionList, int, int], int]) -> _Rule:
    """The chain rule for a function of one argument: slope(out, own value, argument) times the inner slope."""

    def rule(out: InstructionList, own: int, arguments: list[int], _which: int, part: int) -> int:
        return out.emit(Operation.MUL, slope(out, own, arguments[0]), part)

    return rule


def _over(above: float, below: Callable[[InstructionList, int, int], int]) -> _Rule:
    def rule(out: InstructionList, own: int, arguments: list[int], _which: int, part: int) -> int:
        scaled = out.emit(Operation.MUL, out.constant(above), part)
        return out.emit(Operation.DIV, scaled, below(out, own, arguments[0]))

    return rule


def _square_plus(out: InstructionList, index: int, constant: float, sign: float) -> int:
    square = out.emit(Operation.MUL, index, index)
    operation = Operation.ADD if sign > 0 else Operation.SUB
    return out.emit(operation, out.constant(constant), square)


def _angle(out: InstructionList, _own: int, arguments: list[int], which: int, part: int) -> int:
    squares = [out.emit(Operation.MUL, a, a) for a in arguments]
    above = out.emit(Operation.MUL, part, arguments[1 - which])
    slope = out.emit(Operation.DIV, above, out.emit(Operation.ADD, *squares))
    return out.emit(Operation.NEG, slope) if which == 1 else slope


_RULES: dict[Operation, _Rule] = {
    Operation.ADD: _linear(1.0),
    Operation.SUB: _linear(-1.0),
    Operation.NEG: _negated,
    Operation.MUL: _product,
    Operation.DIV: _quotient,
    Operation.FMA: _fused,
    Operation.POW: _power,
    Operation.SQRT: _over(1.0, lambda out, own, _a: out.emit(Operation.ADD, own, own)),
    Operation.EXP: _outer(lambda _out, own, _a: own),
    Operation.LOG: _over(1.0, lambda _out, _own, a: a),
    Operation.SIN: _outer(lambda out, _own, a: out.emit(Operation.COS, a)),
    Operation.COS: _outer(lambda out, _own, a: out.emit(Operation.NEG, out.emit(Operation.SIN, a))),
    Operation.TAN: _outer(lambda out, own, _a: _square_plus(out, own, 1.0, 1.0)),
    Operation.SINH: _outer(lambda out, _own, a: out.emit(Operation.COSH, a)),
    Operation.COSH: _outer(lambda out, _own, a: out.emit(Operation.SINH, a)),
    Operation.TANH: _outer(lambda out, own, _a: _square_plus(out, own, 1.0, -1.0)),
    Operation.ATAN2: _angle,
    Operation.ASINH: _over(1.0, lambda out, _own, a: out.emit(Operation.SQRT, _square_plus(out, a, 1.0, 1.0))),
    Operation.ACOSH: _over(1.0, lambda out, _own, a: out.emit(Operation.SQRT, _square_plus(out, a, -1.0, 1.0))),
    Operation.ATANH: _over(1.0, lambda out, _own, a: _square_plus(out, a, 1.0, -1.0)),
    Operation.ATAN: _over(1.0, lambda out, _own, a: _square_plus(out, a, 1.0, 1.0)),
    Operation.ASIN: _over(1.0, lambda out, _own, a: out.emit(Operation.SQRT, _square_plus(out, a, 1.0, -1.0))),
    Operation.ACOS: _over(-1.0, lambda out, _own, a: out.emit(Operation.SQRT, _square_plus(out, a, 1.0, -1.0))),
}
