"""A kernel as one function that Numba takes as it is, a line for each instruction of LLVM.

Numba looks at every operation of a Python function several times, seconds for a thousand of them. What an intrinsic
builds goes to LLVM at once: the same instructions, the same bits, a third of the time.
"""

from __future__ import annotations

from ulna.program.instructions import Operation
from ulna.program.kernel import Kernel
from ulna.program.lowering.python_source import literal

_ARITHMETIC = {
    Operation.ADD: "b.fadd({0}, {1})",
    Operation.SUB: "b.fsub({0}, {1})",
    Operation.MUL: "b.fmul({0}, {1})",
    Operation.DIV: "b.fdiv({0}, {1})",
    Operation.NEG: "b.fneg({0})",
    Operation.FMA: "b.fma({0}, {1}, {2})",
    Operation.FLIP: "flip(b, {0}, {1})",
    Operation.ABS: 'called(b, "llvm.fabs", {0})',
    Operation.SQRT: 'called(b, "llvm.sqrt", {0})',
    Operation.SIGN: 'b.select(b.fcmp_ordered(">", {0}, ZERO), ONE, '
    'b.select(b.fcmp_ordered("<", {0}, ZERO), b.fneg(ONE), {0}))',
    Operation.MIN: 'b.select(b.or_(b.fcmp_ordered("<", {0}, {1}), b.fcmp_unordered("!=", {0}, {0})), {0}, {1})',
    Operation.MAX: 'b.select(b.or_(b.fcmp_ordered(">", {0}, {1}), b.fcmp_unordered("!=", {0}, {0})), {0}, {1})',
}
_COMPARISONS = {
    Operation.LESS: 'b.fcmp_ordered("<", {0}, {1})',
    Operation.LESS_EQUAL: 'b.fcmp_ordered("<=", {0}, {1})',
    Operation.EQUAL: 'b.fcmp_ordered("==", {0}, {1})',
}
_LOGIC = {
    Operation.AND: "b.and_({0}, {1})",
    Operation.OR: "b.or_({0}, {1})",
    Operation.NOT: "b.not_({0})",
}
_BUILT = {Operation.CONSTANT, Operation.SELECT, *_ARITHMETIC, *_COMPARISONS, *_LOGIC}

INTRINSIC_HEADER = '''DOUBLE = ir.DoubleType()
ZERO, ONE = ir.Constant(DOUBLE, 0.0), ir.Constant(DOUBLE, 1.0)


def called(b, name, value):
    """A function of LLVM."""
    return b.call(b.module.declare_intrinsic(name, [DOUBLE]), [value])


def flip(b, value, turns):
    """The value with its sign changed where the last bit of the other number is set."""
    whole = ir.IntType(64)
    sign = b.shl(b.bitcast(turns, whole), whole(63))
    return b.bitcast(b.xor(b.bitcast(value, whole), sign), DOUBLE)


'''
"""What `intrinsic_source` needs besides `numba`, `intrinsic` and `ir` of llvmlite."""


def has_intrinsic(kernel: Kernel) -> bool:
    """Whether every instruction is one of LLVM: elementary functions have to be written out before."""
    return all(each.operation in _BUILT for each in kernel.instructions)


def intrinsic_source(kernel: Kernel, name: str) -> str:
    """The source of a function of the kernel's inputs that answers with its outputs, as a tuple if there are more."""
    first, results = len(kernel.inputs), kernel.results
    conditions: set[int] = set()

    def number(k: int) -> str:
        return f"b.select(a{k}, ONE, ZERO)" if k in conditions else f"a{k}"

    def condition(k: int) -> str:
        return f"a{k}" if k in conditions else f'b.fcmp_unordered("!=", a{k}, ZERO)'

    lines = [f"a{k} = arguments[{k}]" for k in range(first)]
    for place, each in enumerate(kernel.instructions, first):
        operation, operands = each.operation, each.operands
        if operation is Operation.CONSTANT:
            text = f"ir.Constant(DOUBLE, {literal(each)})"
        elif operation is Operation.SELECT:
            text = f"b.select({condition(operands[0])}, {number(operands[1])}, {number(operands[2])})"
        elif operation in _LOGIC:
            text = _LOGIC[operation].format(*map(condition, operands))
        else:
            text = (_ARITHMETIC | _COMPARISONS)[operation].format(*map(number, operands))
        if operation in _LOGIC or operation in _COMPARISONS:
            conditions.add(place)
        lines.append(f"a{place} = {text}")
    values = ", ".join(map(number, results))
    answer = values if len(results) == 1 else f"context.make_tuple(b, signature.return_type, [{values}])"
    kind = "numba.float64" if len(results) == 1 else f"numba.types.UniTuple(numba.float64, {len(results)})"
    head = ", ".join(["typing", *(f"x{k}" for k in range(first))])
    body = "\n        ".join([*lines, f"return {answer}"])
    return (
        f"@intrinsic\ndef {name}({head}):\n    def code(context, b, signature, arguments):\n        {body}\n\n"
        f"    return {kind}({', '.join(['numba.float64'] * first)}), code\n\n\n"
    )
