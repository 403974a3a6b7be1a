"""`Program`: kernels as JavaScript over one row of numbers, each slot at a place of its own."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ulna.loop import Program as Motion
from ulna.loop import Repeat
from ulna.program import Kernel, Precision, to_javascript_in_place

_SPACES = re.compile(r" ([*/+=<>?:&|!-]+) (?![-+])")
"""Around an operator; before a sign they keep two of them apart."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Program:
    """Functions of JavaScript that read and write one row of numbers.

    It is written slot by slot and holds no text of a user: names, units and descriptions travel beside it as data.

    Attributes:
        places: of each slot in the row. begin: numbers that slots begin with, where not 0.
        functions: texts. constants: what the text tells its reader besides, by name.
    """

    places: dict[str, int] = field(default_factory=dict)
    begin: dict[str, float] = field(default_factory=dict)
    functions: dict[str, str] = field(default_factory=dict)
    constants: dict[str, object] = field(default_factory=dict)

    def slot(self, name: str) -> int:
        """The place of a slot, given to it when first asked for."""
        return self.places.setdefault(name, len(self.places))

    def row(self, stem: str, count: int) -> list[int]:
        """Places of stem0, stem1 and so on."""
        return [self.slot(f"{stem}{k}") for k in range(count)]

    def add(
        self,
        name: str,
        kernel: Kernel,
        *,
        renamed: Mapping[str, str] | None = None,
        precision: Precision = Precision.DOUBLE,
    ) -> None:
        """A kernel as a function. renamed: slots of its inputs and outputs where they are called otherwise."""
        called = renamed or {}
        used = {k for each in kernel.instructions for k in each.operands} | set(kernel.results)
        names = [*(label for k, label in enumerate(kernel.inputs) if k in used), *kernel.outputs]
        places = {label: self.slot(called.get(label, label)) for label in names}
        self.functions[name] = _compact(to_javascript_in_place(kernel, name, places, precision=precision))

    def add_motion(self, name: str, motion: Motion) -> None:
        """Kernels and repetitions one after the other as a function; a stretch of no length is left out."""
        lines = self._lines(name, motion, depth=1)
        self.functions[name] = "\n".join([f"function {name}(m) {{", '  "use strict";', *lines, "}"]) + "\n"

    def _lines(self, stem: str, motion: Motion, depth: int) -> list[str]:
        lines, indent = [], "  " * depth
        for k, each in enumerate(motion):
            inner = f"{stem}{k}"
            if isinstance(each, Repeat):
                index = f"i{depth}"
                head = f"for (let {index} = 0; {index} < m[{self.slot(each.times)}]; {index}++) {{"
                if _early(each):
                    head = f"if (m[{self.slot('fraction')}] !== 0) {head}"
                lines += [indent + head, *self._lines(inner, each.body, depth + 1), indent + "}"]
            else:
                self.add(inner, each)
                lines.append(f"{indent}{inner}(m);")
        return lines

    @property
    def text(self) -> str:
        """The program as an expression of JavaScript: an object of functions, places and numbers."""
        told = {
            "size": len(self.places),
            "places": self.places,
            "begin": {name: value for name, value in self.begin.items() if name in self.places},
            **self.constants,
        }
        body = "".join(self.functions.values())
        names = ", ".join(self.functions)
        return f"(() => {{\n{body}return {{ ...{_json(told)}, {names} }};\n}})()"


def _compact(text: str) -> str:
    """The same function without spaces that nobody reads, one declaration for a row of constants: half as long."""
    rows: list[str] = []
    for line in text.splitlines():
        row = _SPACES.sub(r"\1", line.strip())
        if row.startswith("const ") and rows and rows[-1].startswith("const "):
            rows[-1] = f"{rows[-1][:-1]},{row[6:]}"
        else:
            rows.append(row)
    return "\n".join(rows) + "\n"


def _early(repeat: Repeat) -> bool:
    return any(isinstance(each, Kernel) and "early_length" in each.inputs for each in repeat.body)


def _json(value: object) -> str:
    """JSON, with numbers that JSON lacks as JavaScript has them."""
    if isinstance(value, Mapping):
        return "{" + ",".join(f"{json.dumps(name)}:{_json(each)}" for name, each in value.items()) + "}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return "[" + ",".join(map(_json, value)) + "]"
    return json.dumps(value)
