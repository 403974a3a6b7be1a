"""Where a kernel stops being defined: the arguments of its roots, logarithms, powers and quotients, and their names."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from ulna.program.instructions import InstructionList, Operation, pruned
from ulna.program.kernel import Kernel, copied

LONGEST = 60
"""Letters of a formula beyond which its middle is left out."""

_NAMED = {
    Operation.SQRT: "root",
    Operation.LOG: "logarithm",
    Operation.DIV: "denominator",
    Operation.POW: "power",
    Operation.ASIN: "arc sine",
    Operation.ACOS: "arc cosine",
    Operation.ACOSH: "inverse hyperbolic cosine",
    Operation.ATANH: "inverse hyperbolic tangent",
    Operation.TAN: "tangent",
}
_INSIDE_ONE = frozenset({Operation.ASIN, Operation.ACOS, Operation.ACOSH, Operation.ATANH})
_SIGNS = {Operation.ADD: "+", Operation.SUB: "-", Operation.MUL: "*", Operation.DIV: "/", Operation.POW: "^"}
_BINDING = {Operation.ADD: 1, Operation.SUB: 1, Operation.MUL: 2, Operation.DIV: 2, Operation.NEG: 2, Operation.POW: 3}


@dataclass(frozen=True, slots=True, kw_only=True)
class Edges:
    """The edges of a kernel's domain.

    Attributes:
        kernel: the same inputs → for each edge a value that is zero on it.
        names: "the root of h reaches 0", for each.
        places: of their instructions in the original kernel.
    """

    kernel: Kernel
    names: tuple[str, ...]
    places: tuple[int, ...]


def edges_of(kernel: Kernel, still: Collection[str]) -> Edges:
    """The edges that can be reached while the inputs named in `still` keep their values."""
    out = InstructionList(len(kernel.inputs))
    values, texts = copied(kernel, out), Texts(kernel)
    fixed = [name in still for name in kernel.inputs]
    results, names, places = [], [], []
    for place, instruction in enumerate(kernel.instructions):
        fixed.append(all(fixed[k] for k in instruction.operands))
        operation = instruction.operation
        if operation not in _NAMED:
            continue
        operand = instruction.operands[1 if operation is Operation.DIV else 0]
        if fixed[operand]:
            continue
        value, level = values[operand], "0"
        if operation in _INSIDE_ONE:
            square = out.emit(Operation.MUL, value, value)
            value, level = out.emit(Operation.SUB, out.constant(1.0), square), "±1"
        elif operation is Operation.TAN:
            value, level = out.emit(Operation.COS, value), "an odd multiple of π/2"
        of = " " if operation is Operation.DIV else " of "
        reached = f"reaches {level}" if operation not in _INSIDE_ONE | {Operation.TAN} else f"meets {level}"
        results.append(value)
        names.append(f"the {_NAMED[operation]}{of}{texts.shortened(operand)} {reached}")
        places.append(place)
    kept, renumbered = pruned(len(kernel.inputs), out.instructions, results)
    found = Kernel(
        name=f"edges of {kernel.name}",
        inputs=kernel.inputs,
        outputs=tuple(f"edge {k}" for k in range(len(results))),
        instructions=kept,
        results=renumbered,
    )
    return Edges(kernel=found, names=tuple(names), places=tuple(places))


class Texts:
    """The values of a kernel as formulas that people read."""

    def __init__(self, kernel: Kernel) -> None:
        self._kernel = kernel
        self._known: dict[int, tuple[str, int]] = {}

    def shortened(self, value: int) -> str:
        """One of them, its middle left out where it is long."""
        text = self._of(value)[0]
        return text if len(text) <= LONGEST else f"{text[: LONGEST // 2]} … {text[-LONGEST // 2 :]}"

    def _of(self, value: int) -> tuple[str, int]:
        """(text, how strongly it holds together); an inner formula that is too long is left out."""
        if value < len(self._kernel.inputs):
            return self._kernel.inputs[value], 4
        if value not in self._known:
            text, binding = self._written(value)
            self._known[value] = (text, binding) if len(text) <= 4 * LONGEST else ("(…)", 4)
        return self._known[value]

    def _written(self, value: int) -> tuple[str, int]:
        instruction = self._kernel.instructions[value - len(self._kernel.inputs)]
        operation = instruction.operation
        if operation is Operation.CONSTANT:
            number = instruction.value
            whole = math.isfinite(number) and number == int(number) and abs(number) < 1e6
            return (str(int(number)) if whole else f"{number:.6g}"), 4 if number >= 0 else 1
        parts = [self._of(operand) for operand in instruction.operands]
        own = _BINDING.get(operation, 4)
        if operation is Operation.MUL and instruction.operands[0] == instruction.operands[1]:
            return f"{_held(parts[0], 4)}^2", 3
        if operation is Operation.NEG:
            return f"-{_held(parts[0], own)}", 1
        if operation in _SIGNS:
            left, right = _held(parts[0], own), _held(parts[1], own + (operation in _RIGHT))
            space = " " if own == 1 else ""
            return f"{left}{space}{_SIGNS[operation]}{space}{right}", own
        return f"{operation.value}({', '.join(text for text, _ in parts)})", 4


_RIGHT: Mapping[Operation, bool] = {Operation.SUB: True, Operation.DIV: True, Operation.POW: True}


def _held(part: tuple[str, int], least: int) -> str:
    text, binding = part
    return text if binding >= least else f"({text})"
