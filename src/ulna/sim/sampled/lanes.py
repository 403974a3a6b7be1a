"""`LaneWriter`: source of a loop over many runs, each slot of a block of them a row of numbers."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager

from ulna.program import TEMPLATES, Assembly, Kernel, Operation, literal, restricted
from ulna.program.lowering.intrinsic import has_intrinsic, intrinsic_source
from ulna.sim.sampled.foreign import ForeignStep


class LaneWriter:
    """Lines of source over slots.

    With `lanes` runs side by side a slot is a row of an array; a lone run (`lanes` is 1) keeps it in a variable.
    Within `runs()` the innermost loop goes over the runs, which the compiler makes vector code of.

    Args:
        lanes: runs of a block. same: of slots that hold one number, the one that stands for it.
        read: slots that somebody reads; others are not kept.
        numbers: names that hold for all runs and samples. shared: variables that are the same for all runs.
        paths: slots that are read from samples of each run's own. gpu: for the compiler of a GPU.
        alike: slots that are the same for all runs, 0 at first; each is written by kernels of its like alone.
    """

    def __init__(
        self,
        *,
        lanes: int,
        gpu: bool,
        same: Mapping[str, str],
        read: Collection[str],
        numbers: Collection[str],
        shared: Collection[str],
        paths: Collection[str],
        alike: Collection[str],
    ) -> None:
        self.lanes, self.gpu, self.alike = lanes, gpu, frozenset(alike)
        self.functions: list[str] = []
        self.lines: list[str] = []
        self.depth = 0
        self.numbers: list[str] = []
        self._names = {name: f"paths[k, {row}, run]" for row, name in enumerate(paths)}
        self._names |= {name: f"v_{name}" for name in (*shared, *alike)}
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
        # After the runs, which read what the sample before left here.
        alike = [name for name in kernel.outputs if name in self.alike and name in self.read]
        if alike:
            whole = Assembly(kernel.name)
            values = whole.call(kernel)
            self.inline(whole.finished({name: values[name] for name in alike}), given)

    def foreign(self, step: ForeignStep) -> None:
        """A step in machine code for all runs of the block, one after the other."""
        self.functions.append(step.declaration)
        with self.runs():
            for k, slot in enumerate(step.inputs):
                self.line(f"given[{k}] = {self.at(slot)}")
            self.line(f"{step.symbol}(given.ctypes, told.ctypes)")
            for k, slot in enumerate(step.outputs):
                self.line(f"{self.at(slot)} = told[{k}]")

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
        """The kernel for the present run; the names of its results."""
        texts = given or {}
        values = [texts[name] if name in texts else self.at(name) for name in kernel.inputs]
        if self.gpu or not has_intrinsic(kernel):
            return self._spelled(kernel, values)
        name = f"kernel{len(self.functions)}"
        self.functions.append(intrinsic_source(kernel, name))
        results = [f"a{self._count + k}" for k in range(len(kernel.outputs))]
        self._count += len(results)
        self.line(f"{', '.join(results)} = {name}({', '.join(values)})")
        return dict(zip(kernel.outputs, results, strict=True))

    def _spelled(self, kernel: Kernel, inputs: Sequence[str]) -> dict[str, str]:
        """The kernel's instructions line by line, as GPUs and the functions of the mathematical library want them."""
        values = [self.new(text) for text in inputs]
        for each in kernel.instructions:
            if each.operation is Operation.CONSTANT:
                values.append(literal(each))
            else:
                values.append(self.new(TEMPLATES[each.operation].format(*(values[k] for k in each.operands))))
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
