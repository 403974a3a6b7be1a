"""A kernel split at its costly functions of some inputs, whose values may be wanted again."""

from __future__ import annotations

from collections.abc import Collection

from ulna.program.hoist import Hoisted
from ulna.program.instructions import InstructionList, Operation, pruned
from ulna.program.kernel import Kernel

COSTLY = "costly_"

_CHEAP = frozenset(
    {
        Operation.CONSTANT,
        Operation.ADD,
        Operation.SUB,
        Operation.MUL,
        Operation.NEG,
        Operation.ABS,
        Operation.MIN,
        Operation.MAX,
        Operation.SELECT,
    }
)


def costly_first(kernel: Kernel, fixed: Collection[str]) -> Hoisted:
    """The kernel split at the costly functions of the inputs `fixed` and of constants.

    `before` takes the kernel's inputs, `main` these and then what `before` answers.
    """
    first = len(kernel.inputs)
    static = [name in fixed for name in kernel.inputs]
    static += [False] * len(kernel.instructions)
    for k, each in enumerate(kernel.instructions, first):
        static[k] = all(static[operand] for operand in each.operands)
    worth = [False] * len(static)
    for k in range(len(static) - 1, first - 1, -1):
        each = kernel.instructions[k - first]
        worth[k] = static[k] and (worth[k] or each.operation not in _CHEAP)
        if worth[k]:
            for operand in each.operands:
                worth[operand] = True
    used = set(kernel.results)
    for k, each in enumerate(kernel.instructions, first):
        if not worth[k]:
            used.update(each.operands)
    crossing = [
        k
        for k in range(first, len(static))
        if worth[k] and k in used and kernel.instructions[k - first].operation is not Operation.CONSTANT
    ]
    names = tuple(f"{COSTLY}{k}" for k in range(len(crossing)))
    instructions, results = pruned(first, kernel.instructions, tuple(crossing))
    before = Kernel(name=kernel.name, inputs=kernel.inputs, outputs=names, instructions=instructions, results=results)
    return Hoisted(before=before, main=_rest(kernel, crossing, names))


def _rest(kernel: Kernel, crossing: list[int], names: tuple[str, ...]) -> Kernel:
    first = len(kernel.inputs)
    listing = InstructionList(first + len(names))
    index = {k: k for k in range(first)} | {k: first + place for place, k in enumerate(crossing)}
    for k, each in enumerate(kernel.instructions, first):
        if k in index:
            continue
        if each.operation is Operation.CONSTANT:
            index[k] = listing.constant(each.value)
        else:
            index[k] = listing.emit(each.operation, *(index[operand] for operand in each.operands))
    instructions, results = pruned(
        first + len(names), listing.instructions, tuple(index[result] for result in kernel.results)
    )
    return Kernel(
        name=kernel.name,
        inputs=(*kernel.inputs, *names),
        outputs=kernel.outputs,
        instructions=instructions,
        results=results,
    )
