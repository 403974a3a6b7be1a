"""Branch points made explicit: a kernel whose roots may rest at zero, and the functions that pass through zero there.

The motion may be an analytic curve across the edge of a root's domain: h' = −√h has h = (1 − t/2)², which a series
follows to the far side, where the root has another sign. The argument touches zero there, while the root's own series
passes through it.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from fractions import Fraction

from ulna.program.instructions import Instruction, InstructionList, Operation, pruned
from ulna.program.kernel import Kernel

REST = "rest_"
BRANCH = "branch_"

LARGEST = 1000
"""Denominators of exponents that are told from others."""

_ENDLESS = frozenset({Operation.LOG, Operation.ATANH})
"""What has no value at its edge."""

_INVERSE = frozenset({Operation.ASIN, Operation.ACOS, Operation.ACOSH})


@dataclass(frozen=True, slots=True, kw_only=True)
class Branch:
    """A root, a power or an inverse function that ends at the edge of its domain.

    Attributes:
        place: of its instruction in the kernel.
        signs: how many functions change sign where a motion passes its branch point; they and its distance from the
            edge are its outputs.
    """

    place: int
    signs: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Branched:
    """A kernel with its branches.

    Attributes:
        kernel: inputs, then `rest_0`, `rest_1`, … → the outputs, then the outputs of each branch.
            Branch k has its value at the edge while rest k is not zero.
        branches: in the order of their instructions.
    """

    kernel: Kernel
    branches: tuple[Branch, ...]


def branches_of(kernel: Kernel, still: Collection[str]) -> tuple[Branch, ...]:
    """The instructions of a kernel that a motion may leave at a branch point without a trace in its series.

    Args:
        kernel: the program. still: names of the inputs that keep their values.
    """
    found = []
    fixed = [name in still for name in kernel.inputs]
    for place, instruction in enumerate(kernel.instructions):
        fixed.append(all(fixed[k] for k in instruction.operands))
        if instruction.operands and fixed[instruction.operands[0]]:
            continue
        if instruction.operation is Operation.SQRT or instruction.operation in _INVERSE | _ENDLESS:
            found.append(Branch(place=place))
        elif instruction.operation is Operation.POW:
            exponent = _constant(kernel, instruction.operands[1])
            if exponent is None:
                found.append(Branch(place=place, signs=2))
            elif exponent > 0.0 and exponent != math.floor(exponent):
                found.append(Branch(place=place))
    return tuple(found)


def with_branches(kernel: Kernel, still: Collection[str]) -> Branched:
    """The kernel with every branch watched and able to rest at its edge; see `branches_of`."""
    branches = branches_of(kernel, still)
    first = len(kernel.inputs)
    listing = InstructionList(first + len(branches))
    own = {branch.place: k for k, branch in enumerate(branches)}
    index, shown = {k: k for k in range(first)}, []
    for position, instruction in enumerate(kernel.instructions):
        operands = tuple(index[operand] for operand in instruction.operands)
        if instruction.operation is Operation.CONSTANT:
            value = listing.constant(instruction.value)
        else:
            value = listing.emit(instruction.operation, *operands)
        if position in own:
            shown += _functions(listing, instruction, operands, value)
            edge = _at_the_edge(listing, instruction.operation, operands)
            value = listing.emit(Operation.SELECT, first + own[position], edge, value)
        index[first + position] = value
    inputs = (*kernel.inputs, *(f"{REST}{k}" for k in range(len(branches))))
    outputs = (*kernel.outputs, *(f"{BRANCH}{k}" for k in range(len(shown))))
    results = [*(index[result] for result in kernel.results), *shown]
    kept, renumbered = pruned(len(inputs), listing.instructions, results)
    return Branched(
        kernel=Kernel(name=kernel.name, inputs=inputs, outputs=outputs, instructions=kept, results=renumbered),
        branches=branches,
    )


def _functions(listing: InstructionList, instruction: Instruction, operands: tuple[int, ...], value: int) -> list[int]:
    """What changes sign at the branch point, and the distance from the edge."""
    argument = operands[0]
    if instruction.operation is Operation.SQRT:
        return [value, argument]
    if instruction.operation is Operation.LOG:
        return [argument, argument]
    one = listing.constant(1.0)
    if instruction.operation in _INVERSE | {Operation.ATANH}:
        square = listing.emit(Operation.MUL, argument, argument)
        outside = instruction.operation is Operation.ACOSH
        edge = listing.emit(Operation.SUB, *((square, one) if outside else (one, square)))
        if instruction.operation is Operation.ATANH:
            return [edge, edge]
        return [listing.emit(Operation.SQRT, edge), edge]
    # A power a/b of a distance τᵇ is τᵃ; where a is even, the distance over the power, τᵇ⁻ᵃ, changes sign.
    exponent = operands[1]
    known = listing.value_of(exponent)
    if known is not None and Fraction(known).limit_denominator(LARGEST).numerator % 2:
        return [value, argument]
    pair = (exponent, one) if known is not None and known > 1.0 else (one, exponent)
    other = listing.emit(Operation.POW, argument, listing.emit(Operation.SUB, *pair))
    return [value, other, argument] if known is None else [other, argument]


def _at_the_edge(listing: InstructionList, operation: Operation, operands: tuple[int, ...]) -> int:
    if operation in _ENDLESS:
        return listing.constant(math.nan)
    zero = listing.constant(0.0)
    if operation not in (Operation.ASIN, Operation.ACOS):
        return zero
    left, right = (-math.pi / 2, math.pi / 2) if operation is Operation.ASIN else (math.pi, 0.0)
    below = listing.emit(Operation.LESS, operands[0], zero)
    return listing.emit(Operation.SELECT, below, listing.constant(left), listing.constant(right))


def _constant(kernel: Kernel, value: int) -> float | None:
    place = value - len(kernel.inputs)
    if place < 0 or kernel.instructions[place].operation is not Operation.CONSTANT:
        return None
    return kernel.instructions[place].value
