"""`LoopWriter`: source of a loop under construction, with its memory."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from ulna.sim.sampled.layout import Layout
from ulna.sim.sampled.writing import Writer

_NAME = re.compile(r"\ba\d+\b")
_ASSIGNED = re.compile(r"\s*(a\d+) = ")


class LoopWriter(Writer):
    """Source under construction with its memory: each slot holds one number for each run of the block.

    With `lanes` runs side by side a slot is a row of an array; a lone run (`lanes` is 1) keeps it in a variable.
    Within `runs()` a slot's number is read once and written once; what nobody reads later is not written at all.
    """

    def __init__(self, layout: Layout, lanes: int) -> None:
        super().__init__()
        self.layout = layout
        self.lanes = lanes
        self.seed = "g[l]" if lanes > 1 else "g"
        self.settings: list[str] = []
        self.constants: set[int] = set()
        self._places: dict[str, int] = {}
        self._read: set[str] = set()
        self._stores: dict[int, str] = {}
        self._resets: set[int] = set()
        self._known: dict[str, str] = {}
        self._pending: set[str] = set()
        self._said: dict[str, str] = {}

    def new(self, text: str) -> str:
        """Add `name = text` and hand back the name; the same text once in a block."""
        if text not in self._said:
            self._said[text] = super().new(text)
        return self._said[text]

    def at(self, slot: str) -> str:
        """Where a slot's number of the present run stands; it counts as read."""
        self._read.add(slot)
        return self._place(slot)

    def load(self, slot: str) -> str:
        """The name of a slot's present number."""
        if slot not in self._known:
            self._known[slot] = self.new(self.at(slot))
        return self._known[slot]

    def loads(self, stem: str, count: int) -> list[str]:
        """The names of the numbers in slots stem0, stem1 and so on."""
        return [self.load(f"{stem}{k}") for k in range(count)]

    def store(self, slot: str, text: str) -> None:
        """Put a number into a slot at the end of the block of runs."""
        self._known[slot] = text if _NAME.fullmatch(text) else self.new(text)
        self._pending.add(slot)

    def setting(self, name: str) -> str:
        """A number that is the same for all runs."""
        if name not in self.settings:
            self.settings.append(name)
        return f"f_{name}"

    def constant(self, place: int) -> str:
        """A number of the controller that is the same for all runs."""
        self.constants.add(place)
        return f"b{place}"

    @contextmanager
    def block(self, head: str) -> Iterator[None]:
        """An indented block."""
        self.line(head)
        self.depth += 1
        yield
        self.depth -= 1

    @contextmanager
    def each(self) -> Iterator[None]:
        """One run after the other, for what happens seldom; `at` stands for slots."""
        if self.lanes == 1:
            yield
            return
        with self.block(f"for l in range({self.lanes}):"):
            yield

    @contextmanager
    def runs(self) -> Iterator[None]:
        """The loop over the runs of the block, the innermost one, which the compiler makes vector code of."""
        self._known, self._said, self._pending = {}, {}, set()
        with self.each():
            yield
            for slot in sorted(self._pending):
                self._stores[len(self.lines)] = slot
                self.line(f"{self._place(slot)} = {self._known[slot]}")
        self._known, self._said, self._pending = {}, {}, set()

    def finished(self) -> list[str]:
        """The lines without numbers that nobody uses."""
        kept: list[str] = []
        used: set[str] = set()
        for number in range(len(self.lines) - 1, -1, -1):
            text = self.lines[number]
            if number in self._resets:
                kept += [text + each for each in self._cleared()]
                continue
            assigned = _ASSIGNED.match(text)
            empty = text.endswith(":") and not (kept and _depth(kept[-1]) > _depth(text))
            unread = number in self._stores and self._stores[number] not in self._read
            if empty or unread or (assigned and assigned[1] not in used):
                continue
            used.update(_NAME.findall(text[assigned.end() :] if assigned else text))
            kept.append(text)
        return kept[::-1]

    def reset(self) -> None:
        """All slots to 0."""
        self._resets.add(len(self.lines))
        self.line("")

    def size(self) -> int:
        """Numbers in all slots of a block."""
        return max(1, len(self._places)) * self.lanes

    def _cleared(self) -> list[str]:
        return ["s[:] = 0.0"] if self.lanes > 1 else [f"{self._place(slot)} = 0.0" for slot in sorted(self._read)]

    def _place(self, slot: str) -> str:
        place = self._places.setdefault(slot, len(self._places))
        return f"s[{place * self.lanes} + l]" if self.lanes > 1 else f"s_{slot}"


def _depth(text: str) -> int:
    return len(text) - len(text.lstrip())
