"""Jumps made explicit: a kernel whose comparisons are decided by modes, and the guards at whose zeros modes change."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

from ulna.program.edges import Texts
from ulna.program.instructions import Instruction, InstructionList, Operation, pruned
from ulna.program.kernel import Kernel

GUARD = "guard_"
MODE = "mode_"
ZERO = -1
"""Stands for the number 0 where the index of a compared value is due."""

_COMPARISONS = frozenset({Operation.LESS, Operation.LESS_EQUAL, Operation.EQUAL, Operation.MIN, Operation.MAX})
_SIGNED = frozenset({Operation.ABS, Operation.SIGN})


@dataclass(frozen=True, slots=True, kw_only=True)
class Moded:
    """A kernel without jumps, and its guards.

    Attributes:
        kernel: inputs, then `mode_0`, `mode_1`, … → the outputs, then `guard_0`, `guard_1`, …
            Mode k is the sign (−1, 0 or 1) of guard k, held between two zeros of that guard.
        guards: how many guards there are.
    """

    kernel: Kernel
    guards: int


def with_modes(kernel: Kernel) -> Moded:
    """The kernel with every comparison, minimum, maximum, absolute value, sign and cut of an angle decided by a mode.

    A high-order step must not run across a jump: its series knows one side only. An integrator stops at the zero of
    a guard, changes the mode there and goes on.
    """
    pairs = list(dict.fromkeys(_pair(kernel, each)[0] for each in kernel.instructions if _jumps(each)))
    first = len(kernel.inputs)
    listing = InstructionList(first + len(pairs))
    modes = {pair: first + k for k, pair in enumerate(pairs)}
    index = {k: k for k in range(first)}
    for position, instruction in enumerate(kernel.instructions):
        operands = tuple(index[operand] for operand in instruction.operands)
        if _jumps(instruction):
            pair, turned = _pair(kernel, instruction)
            index[first + position] = _decided(listing, instruction.operation, operands, modes[pair], turned)
        elif instruction.operation is Operation.CONSTANT:
            index[first + position] = listing.constant(instruction.value)
        else:
            index[first + position] = listing.emit(instruction.operation, *operands)
    guards = [index[a] if b == ZERO else listing.emit(Operation.SUB, index[a], index[b]) for a, b in pairs]
    inputs = (*kernel.inputs, *(f"{MODE}{k}" for k in range(len(pairs))))
    outputs = (*kernel.outputs, *(f"{GUARD}{k}" for k in range(len(pairs))))
    results = [*(index[result] for result in kernel.results), *guards]
    kept, renumbered = pruned(len(inputs), listing.instructions, results)
    moded = Kernel(name=kernel.name, inputs=inputs, outputs=outputs, instructions=kept, results=renumbered)
    return Moded(kernel=moded, guards=len(pairs))


def surfaces_of(kernel: Kernel, still: Collection[str]) -> tuple[str, ...]:
    """The surfaces at which guards are zero, "v = 0", while the inputs named in `still` keep their values."""
    texts, fixed, pairs = Texts(kernel), [name in still for name in kernel.inputs], {}
    for instruction in kernel.instructions:
        fixed.append(all(fixed[k] for k in instruction.operands))
        if _jumps(instruction) and not fixed[-1]:
            pairs[_pair(kernel, instruction)[0]] = None
    return tuple(f"{texts.shortened(a)} = {0 if b == ZERO else texts.shortened(b)}" for a, b in pairs)


def _jumps(instruction: Instruction) -> bool:
    return instruction.operation in _COMPARISONS or instruction.operation in _SIGNED | {Operation.ATAN2}


def _pair(kernel: Kernel, instruction: Instruction) -> tuple[tuple[int, int], bool]:
    """The two compared values in the one order used for them, and whether the instruction has the other order."""
    if instruction.operation in _SIGNED | {Operation.ATAN2}:
        return (instruction.operands[0], ZERO), False
    a, b = (ZERO if _is_zero(kernel, operand) else operand for operand in instruction.operands)
    turned = a == ZERO or (b != ZERO and b < a)
    if turned:
        a, b = b, a
    if b == ZERO:  # −x and x reach 0 together
        position = a - len(kernel.inputs)
        if position >= 0 and kernel.instructions[position].operation is Operation.NEG:
            a, turned = kernel.instructions[position].operands[0], not turned
    return (a, b), turned


def _is_zero(kernel: Kernel, index: int) -> bool:
    position = index - len(kernel.inputs)
    if position < 0:
        return False
    instruction = kernel.instructions[position]
    return instruction.operation is Operation.CONSTANT and instruction.value == 0.0


def _turned(listing: InstructionList, operands: tuple[int, ...], mode: int) -> int:
    """atan2(y, x) on one side of y = 0, past which it goes on without a jump: the angle from ±π/2."""
    y, x = operands
    side, other = listing.emit(Operation.MUL, mode, y), listing.emit(Operation.MUL, mode, x)
    angle = listing.emit(Operation.ATAN2, listing.emit(Operation.NEG, other), side)
    quarter = listing.emit(Operation.MUL, listing.constant(math.pi / 2), mode)
    turned = listing.emit(Operation.ADD, quarter, angle)
    return listing.emit(Operation.SELECT, mode, turned, listing.emit(Operation.ATAN2, y, x))


def _decided(listing: InstructionList, operation: Operation, operands: tuple[int, ...], mode: int, turned: bool) -> int:
    """The value of a comparing instruction, given the sign of its guard."""
    if operation is Operation.SIGN:
        return mode
    zero = listing.constant(0.0)
    below = (mode, zero) if not turned else (zero, mode)
    match operation:
        case Operation.LESS | Operation.LESS_EQUAL | Operation.EQUAL:
            return listing.emit(operation, *below)
        case Operation.ATAN2:
            return _turned(listing, operands, mode)
        case Operation.MIN:
            return listing.emit(Operation.SELECT, listing.emit(Operation.LESS, *below), *operands)
        case Operation.MAX:
            return listing.emit(Operation.SELECT, listing.emit(Operation.LESS, *below[::-1]), *operands)
        case _:
            negated = listing.emit(Operation.NEG, operands[0])
            return listing.emit(Operation.SELECT, listing.emit(Operation.LESS, *below), negated, operands[0])
