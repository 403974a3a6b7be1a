"""`Kernel`: the one bridge from symbols to numbers. What is simulated, swept and shipped is lowered from it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from ulna.base import FormulaError
from ulna.program.identifiers import is_plain_name
from ulna.program.instructions import Instruction, InstructionList, Operation, pruned


@dataclass(frozen=True, slots=True, kw_only=True, weakref_slot=True)
class Kernel:
    """A function from named scalars to named scalars as a flat list of instructions in static single assignment.

    Value k is input k for k < len(inputs), else instruction k − len(inputs); an instruction uses earlier values only.
    Common subexpressions appear once. Every lowering keeps the order of the list, so that the same double-precision
    numbers come out wherever the elementary functions are the same.

    Fields:
        inputs: names of the scalar inputs, in order.
        outputs: names of the scalar outputs, in order.
        instructions: the list.
        results: for each output the index of its value.
    """

    name: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    instructions: tuple[Instruction, ...]
    results: tuple[int, ...]

    @property
    def operations(self) -> Mapping[Operation, int]:
        """How often each operation occurs; constants are not counted."""
        counts = Counter(i.operation for i in self.instructions if i.operation is not Operation.CONSTANT)
        return MappingProxyType(dict(counts))

    @property
    def operation_count(self) -> int:
        """The number of operations, constants not counted."""
        return sum(self.operations.values())

    @property
    def identifiers(self) -> tuple[str, ...]:
        """For each input a name for Python, C and JavaScript source, equal to its own name where that can be."""
        taken: set[str] = set()
        names = []
        for position, name in enumerate(self.inputs):
            free = is_plain_name(name) and name not in taken
            choice = name if free else f"in_{position}"
            taken.add(choice)
            names.append(choice)
        return tuple(names)

    def __repr__(self) -> str:
        return (
            f"Kernel({self.name!r}: {len(self.inputs)} inputs -> {len(self.outputs)} outputs, "
            f"{self.operation_count} operations)"
        )


def restricted(original: Kernel, outputs: Iterable[str]) -> Kernel:
    """The kernel of some of the outputs only, in the order given; all inputs stay.

    Raises:
        FormulaError: a name that is not an output.
    """
    wanted = tuple(outputs)
    missing = [label for label in wanted if label not in original.outputs]
    if missing:
        raise FormulaError(
            f"outputs {', '.join(missing)} of kernel '{original.name}'",
            f"it has {', '.join(original.outputs)}.",
        )
    by_name = dict(zip(original.outputs, original.results, strict=True))
    instructions, results = pruned(
        len(original.inputs), original.instructions, tuple(by_name[label] for label in wanted)
    )
    return Kernel(
        name=original.name, inputs=original.inputs, outputs=wanted, instructions=instructions, results=results
    )


def copied(original: Kernel, out: InstructionList) -> list[int]:
    """The instructions emitted into a list over the same first inputs; for every value its index there."""
    values = list(range(len(original.inputs)))
    for instruction in original.instructions:
        if instruction.operation is Operation.CONSTANT:
            values.append(out.constant(instruction.value))
        else:
            values.append(out.emit(instruction.operation, *(values[k] for k in instruction.operands)))
    return values


def without_inputs(original: Kernel, idle: Collection[str]) -> Kernel:
    """The kernel without inputs that nothing uses.

    Raises:
        FormulaError: if one of them is used.
    """
    gone = {k for k, name in enumerate(original.inputs) if name in set(idle)}
    used = gone & {*original.results, *(k for i in original.instructions for k in i.operands)}
    if used:
        names = ", ".join(original.inputs[k] for k in sorted(used))
        raise FormulaError(f"kernel '{original.name}' without the inputs {', '.join(idle)}", f"it uses {names}.")
    kept = [k for k in range(len(original.inputs)) if k not in gone]
    place = {k: position for position, k in enumerate(kept)}
    place |= {k: k - len(gone) for k in range(len(original.inputs), len(original.inputs) + len(original.instructions))}
    return Kernel(
        name=original.name,
        inputs=tuple(original.inputs[k] for k in kept),
        outputs=original.outputs,
        instructions=tuple(replace(i, operands=tuple(place[k] for k in i.operands)) for i in original.instructions),
        results=tuple(place[k] for k in original.results),
    )


def check_names(name: str, inputs: Sequence[str], outputs: Iterable[str]) -> None:
    """Refuse a kernel with two inputs or two outputs of one name."""
    for kind, labels in (("input", tuple(inputs)), ("output", tuple(outputs))):
        twice = sorted(label for label, count in Counter(labels).items() if count > 1)
        if twice:
            raise FormulaError(f"kernel '{name}'", f"the {kind} {', '.join(twice)} appears more than once.")
