"""A kernel split into what is known before a run and what changes during it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ulna.program.instructions import Instruction, InstructionList, Operation, pruned
from ulna.program.kernel import Kernel

HOISTED = "hoisted_"


@dataclass(frozen=True, slots=True, kw_only=True)
class Hoisted:
    """A kernel in two parts.

    Attributes:
        before: the constant inputs → `hoisted_0`, `hoisted_1`, …; all that can be known before the others are.
        main: the other inputs, then the hoisted values → the outputs of the kernel.
    """

    before: Kernel
    main: Kernel


def hoist(kernel: Kernel, constant: Iterable[str]) -> Hoisted:
    """The kernel split into what depends on the named inputs alone and the rest.

    A Taylor integrator would else carry a power series for every product of parameters.
    """
    fixed = set(constant)
    first = len(kernel.inputs)
    static = [name in fixed for name in kernel.inputs]
    for instruction in kernel.instructions:
        static.append(all(static[operand] for operand in instruction.operands))
    crossing = _crossing(kernel, static)
    names = tuple(f"{HOISTED}{k}" for k in range(len(crossing)))
    kept = [k for k in range(first) if not static[k]]
    inputs = (*(kernel.inputs[k] for k in kept), *names)
    index = {old: new for new, old in enumerate((*kept, *crossing))}
    listing = InstructionList(len(inputs))
    for position, instruction in enumerate(kernel.instructions):
        if first + position not in index and (
            instruction.operation is Operation.CONSTANT or not static[first + position]
        ):
            index[first + position] = _copied(listing, instruction, index)
    instructions, results = pruned(len(inputs), listing.instructions, (index[result] for result in kernel.results))
    main = Kernel(name=kernel.name, inputs=inputs, outputs=kernel.outputs, instructions=instructions, results=results)
    return Hoisted(before=_before(kernel, static, crossing, names), main=main)


def _crossing(kernel: Kernel, static: list[bool]) -> list[int]:
    """Static values, constants left out, that a changing instruction or a result needs."""
    first = len(kernel.inputs)
    needed = {
        operand for k, each in enumerate(kernel.instructions) if not static[first + k] for operand in each.operands
    }
    needed.update(kernel.results)
    return sorted(
        k
        for k in needed
        if static[k] and (k < first or kernel.instructions[k - first].operation is not Operation.CONSTANT)
    )


def _before(kernel: Kernel, static: list[bool], crossing: list[int], names: tuple[str, ...]) -> Kernel:
    first = len(kernel.inputs)
    kept = [k for k in range(first) if static[k]]
    index = {old: new for new, old in enumerate(kept)}
    listing = InstructionList(len(kept))
    for position, instruction in enumerate(kernel.instructions):
        if static[first + position]:
            index[first + position] = _copied(listing, instruction, index)
    instructions, results = pruned(len(kept), listing.instructions, (index[k] for k in crossing))
    return Kernel(
        name=f"{kernel.name}, constant part",
        inputs=tuple(kernel.inputs[k] for k in kept),
        outputs=names,
        instructions=instructions,
        results=results,
    )


def _copied(listing: InstructionList, instruction: Instruction, index: dict[int, int]) -> int:
    if instruction.operation is Operation.CONSTANT:
        return listing.constant(instruction.value)
    return listing.emit(instruction.operation, *(index[operand] for operand in instruction.operands))
