"""`Assembly`: a kernel put together out of other kernels and single operations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ulna.program.instructions import Instruction, InstructionList, Operation, pruned
from ulna.program.kernel import Kernel
from ulna.program.scalar import Scalar

_ROOM = 1 << 40
"""Inputs are numbered when the kernel is finished; until then every instruction has a number above all of them."""


class Assembly:
    """Scalars under construction over inputs that are named when they are first needed; equal values appear once."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._inputs: dict[str, int] = {}
        self._listing = InstructionList(_ROOM)

    def input(self, name: str) -> Scalar:
        """The input of this name."""
        return Scalar(self._listing, self._inputs.setdefault(name, len(self._inputs)))

    def inputs(self, stem: str, count: int) -> list[Scalar]:
        """The inputs stem0, stem1 and so on."""
        return [self.input(f"{stem}{k}") for k in range(count)]

    def constant(self, value: float) -> Scalar:
        """A number."""
        return Scalar(self._listing, self._listing.constant(float(value)))

    def call(self, kernel: Kernel, given: Mapping[str, Scalar] | None = None) -> dict[str, Scalar]:
        """The outputs of a kernel by name; inputs that are not given are inputs of this one."""
        known = given or {}
        values = [known[name].index if name in known else self.input(name).index for name in kernel.inputs]
        for instruction in kernel.instructions:
            if instruction.operation is Operation.CONSTANT:
                values.append(self._listing.constant(instruction.value))
            else:
                values.append(self._listing.emit(instruction.operation, *(values[k] for k in instruction.operands)))
        return {name: Scalar(self._listing, values[k]) for name, k in zip(kernel.outputs, kernel.results, strict=True)}

    def finished(self, outputs: Mapping[str, Scalar], inputs: Sequence[str] | None = None) -> Kernel:
        """The kernel of these outputs over the inputs given; without them inputs that none needs are left out."""
        needed = _needed(self._listing.instructions, [each.index for each in outputs.values()])
        if inputs is None:
            names = {name: index for name, index in self._inputs.items() if index in needed}
        else:
            names = {name: self.input(name).index for name in inputs}
        place = {index: position for position, index in enumerate(names.values())}

        def moved(index: int) -> int:
            return place[index] if index < _ROOM else index - _ROOM + len(place)

        # What is not needed may use inputs that are left out; it is dropped at once.
        listed = [
            Instruction(
                operation=each.operation,
                operands=tuple(moved(k) for k in each.operands) if k + _ROOM in needed else (),
                value=each.value,
            )
            for k, each in enumerate(self._listing.instructions)
        ]
        instructions, results = pruned(len(place), listed, [moved(each.index) for each in outputs.values()])
        return Kernel(
            name=self.name, inputs=tuple(names), outputs=tuple(outputs), instructions=instructions, results=results
        )


def chained(name: str, kernels: Sequence[Kernel]) -> Kernel:
    """One kernel after the other: an input of a later one that an earlier one answers is that answer.

    The outputs are those of all, the last of equal names.
    """
    whole = Assembly(name)
    known: dict[str, Scalar] = {}
    for each in kernels:
        known |= whole.call(each, known)
    return whole.finished(known)


def _needed(instructions: Sequence[Instruction], results: Sequence[int]) -> set[int]:
    needed = set(results)
    for position in range(len(instructions) - 1, -1, -1):
        if position + _ROOM in needed:
            needed.update(instructions[position].operands)
    return needed
