"""`LaneWriter`: source of a loop over many runs, each slot of a block of them a row of numbers."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager

from ulna.program import Kernel, Operation, restricted
from ulna.program.lowering.numba import TEMPLATES, literal

_LOGIC = {
    Operation.LESS: "{0} < {1}",
    Operation.LESS_EQUAL: "{0} <= {1}",
    Operation.EQUAL: "{0} == {1}",
    Operation.AND: "{0} & {1}",
    Operation.OR: "{0} | {1}",
    Operation.NOT: "not {0}",
}
_OF_CONDITIONS = (Operation.AND, Operation.OR, Operation.NOT)


class LaneWriter:
    """Lines of source over slots.

    With `lanes` runs side by side a slot is a row of an array; a lone run (`lanes` is 1) keeps it in a variable.
    Within `runs()` the innermost loop goes over the runs, which the compiler makes vector code of.

    Args:
        lanes: runs of a block. same: of slots that hold one number, the one that stands for it.
        read: slots that somebody reads; others are not kept.
        numbers: names that hold for all runs and samples. shared: variables that are the same for all runs.
        paths: slots that are read from samples of each run's own.
    """

    def __init__(
        self,
        *,
        lanes: int,
        same: Mapping[str, str],
        read: Collection[str],
        numbers: Collection[str],
        shared: Collection[str],
        paths: Collection[str],
    ) -> None:
        self.lanes = lanes
        self.lines: list[str] = []
        self.depth = 0
        self.numbers: list[str] = []
        self._names = {name: f"paths[k, {row}, run]" for row, name in enumerate(paths)}
        self._names |= {name: f"v_{name}" for name in shared}
        self._same = dict(same)
        self._known_numbers = frozenset(numbers)
        self.read = frozenset(read)
        self._places: dict[str, int] = {}
        self._count = 0

    def line(self, text: str) -> None:
        """Add a line at the present depth."""
        self.lines.append("    " * self.depth + text)

    @contextmanager
    def block(self, head: str) -> Iterator[None]:
        """An indented block."""
        self.line(head)
        self.depth += 1
        yield
        self.depth -= 1

    @contextmanager
    def runs(self) -> Iterator[None]:
        """The loop over the runs of the block."""
        if self.lanes == 1:
            self._line_of_run()
            yield
            return
        with self.block(f"for l in range({self.lanes}):"):
            self._line_of_run()
            yield

    def _line_of_run(self) -> None:
        if any(name.startswith("paths") for name in self._names.values()):
            self.line("run = base + l if base + l < last else last - 1")

    def at(self, name: str) -> str:
        """Where the number of this name stands."""
        name = self._same.get(name, name)
        if name in self._known_numbers:
            if name not in self.numbers:
                self.numbers.append(name)
            return f"f_{name}"
        if name in self._names:
            return self._names[name]
        place = self._places.setdefault(name, len(self._places))
        return f"s[{place * self.lanes} + l]" if self.lanes > 1 else f"s_{name}"

    def new(self, text: str) -> str:
        """Add `name = text` and hand back the name."""
        name = f"a{self._count}"
        self._count += 1
        self.line(f"{name} = {text}")
        return name

    def work(self, kernel: Kernel, given: Mapping[str, str] | None = None, counted: str = "") -> None:
        """A kernel for all runs of the block: slots read, slots written that somebody reads.

        Args:
            kernel: what is computed. given: text that stands for some of its inputs.
            counted: an output of which the runs where it is not 0 are counted in the variable of this name.
        """
        kept = self.kept(kernel, counted)
        if kept:
            with self.runs():
                self.inline(restricted(kernel, kept), given, counted)

    def kept(self, kernel: Kernel, counted: str = "") -> list[str]:
        """The outputs that become slots, and the one that is counted."""
        return [n for n in kernel.outputs if n == counted or (n in self.read and n not in self._names)]

    def inline(self, kernel: Kernel, given: Mapping[str, str] | None = None, counted: str = "") -> None:
        """The kernel for the present run, results stored."""
        found = self.evaluated(kernel, given)
        if counted in found:
            self.line(f"{counted} += 1 if {found.pop(counted)} != 0.0 else 0")
        for place, value in {self.at(name): value for name, value in found.items()}.items():
            self.line(f"{place} = {value}")

    def evaluated(self, kernel: Kernel, given: Mapping[str, str] | None = None) -> dict[str, str]:
        """The kernel's instructions for the present run; the names of its results."""
        texts = given or {}
        values = [self.new(texts[name] if name in texts else self.at(name)) for name in kernel.inputs]
        conditions: dict[int, str] = {}

        def condition(k: int) -> str:
            return conditions[k] if k in conditions else f"({values[k]} != 0.0)"

        numeric = _numeric(kernel)
        for instruction in kernel.instructions:
            operation, operands, place = instruction.operation, instruction.operands, len(values)
            if operation is Operation.CONSTANT:
                values.append(literal(instruction))
                continue
            if operation in _LOGIC:
                of = [condition(k) if operation in _OF_CONDITIONS else values[k] for k in operands]
                conditions[place] = self.new(f"({_LOGIC[operation].format(*of)})")
                values.append(self.new(f"1.0 if {conditions[place]} else 0.0") if place in numeric else "")
            elif operation is Operation.SELECT:
                yes, no = values[operands[1]], values[operands[2]]
                values.append(self.new(f"{yes} if {condition(operands[0])} else {no}"))
            else:
                values.append(self.new(TEMPLATES[operation].format(*(values[k] for k in operands))))
        return {name: values[k] for name, k in zip(kernel.outputs, kernel.results, strict=True)}

    def random(self, slot: str, text: str) -> None:
        """A slot of random numbers, in a loop of its own: it calls the mathematical library."""
        with self.runs():
            self.line(f"{self.at(slot)} = {text}")

    def cleared(self) -> list[str]:
        """Lines that put every slot to 0."""
        return ["s[:] = 0.0"] if self.lanes > 1 else [f"s_{name} = 0.0" for name in self._places]

    def size(self) -> int:
        """Numbers in all slots of a block."""
        return max(1, len(self._places)) * self.lanes


def _numeric(kernel: Kernel) -> set[int]:
    """Values that are read as numbers, not only as conditions."""
    found = set(kernel.results)
    for each in kernel.instructions:
        if each.operation in _OF_CONDITIONS:
            continue
        found.update(each.operands[1:] if each.operation is Operation.SELECT else each.operands)
    return found
