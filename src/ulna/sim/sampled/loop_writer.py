"""`LoopWriter`: source of a loop under construction, with its memory."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ulna.sim.sampled.layout import Layout
from ulna.sim.sampled.writing import Writer


class LoopWriter(Writer):
    """Source under construction with its memory: each slot holds one number for each run of the block."""

    def __init__(self, layout: Layout, lanes: int) -> None:
        super().__init__()
        self.layout = layout
        self.lanes = lanes
        self.slots: dict[str, int] = {}
        self.settings: list[str] = []

    def at(self, slot: str) -> str:
        """Where a slot's number of the present run stands."""
        place = self.slots.setdefault(slot, len(self.slots))
        return f"s[{place * self.lanes} + l]" if self.lanes > 1 else f"s[{place}]"

    def load(self, slot: str) -> str:
        """The name of a slot's present number."""
        return self.new(self.at(slot))

    def loads(self, stem: str, count: int) -> list[str]:
        """The names of the numbers in slots stem0, stem1 and so on."""
        return [self.load(f"{stem}{k}") for k in range(count)]

    def store(self, slot: str, text: str) -> None:
        """Put a number into a slot."""
        self.line(f"{self.at(slot)} = {text}")

    def setting(self, name: str) -> str:
        """A number that is the same for all runs."""
        if name not in self.settings:
            self.settings.append(name)
        return f"f_{name}"

    @contextmanager
    def block(self, head: str) -> Iterator[None]:
        """An indented block."""
        self.line(head)
        self.depth += 1
        yield
        self.depth -= 1

    @contextmanager
    def runs(self) -> Iterator[None]:
        """The loop over the runs of the block, the innermost one, which the compiler makes vector code of."""
        if self.lanes == 1:
            yield
            return
        with self.block(f"for l in range({self.lanes}):"):
            yield
