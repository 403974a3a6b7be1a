"""`Language`: a kernel as statements, one for each operation; constants are written where they are used."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ulna.base import FormulaError
from ulna.program.identifiers import is_plain_name
from ulna.program.instructions import Instruction, Operation
from ulna.program.kernel import Kernel

_COMPARISONS = {Operation.LESS: "{0} < {1}", Operation.LESS_EQUAL: "{0} <= {1}", Operation.EQUAL: "{0} == {1}"}
"""Written alike in all languages here."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Language:
    """How a language writes a kernel.

    Attributes:
        name: for messages.
        templates: an operation on {0}, {1} and {2}.
        literal: a constant.
        choice: {1} where the comparison {0} holds, else {2}.
    """

    name: str
    templates: Mapping[Operation, str]
    literal: Callable[[Instruction], str]
    choice: str

    def statements(
        self, kernel: Kernel, names: Sequence[str], *, stem: str = "v"
    ) -> tuple[list[tuple[str, str]], list[str]]:
        """Pairs (name, expression) in the order of the list, and the names of the results.

        A comparison that only chooses has no statement of its own.

        Args:
            kernel: what to write out.
            names: for each input the text that stands for it.
            stem: the names are stem0, stem1 and so on.

        Raises:
            FormulaError: an operation that the language does not have.
        """
        known = list(names)
        comparisons: dict[int, str] = {}
        inlined = _only_choosing(kernel)
        pairs = []
        for position, instruction in enumerate(kernel.instructions):
            index, operation = len(names) + position, instruction.operation
            operands = [known[k] for k in instruction.operands]
            if operation is Operation.CONSTANT:
                known.append(self.literal(instruction))
                continue
            if operation in _COMPARISONS:
                comparisons[index] = _COMPARISONS[operation].format(*operands)
            if operation is Operation.SELECT and instruction.operands[0] in comparisons:
                text = self.choice.format(comparisons[instruction.operands[0]], *operands[1:])
            else:
                text = self._template(kernel, operation).format(*operands)
            known.append(f"{stem}{position}")
            if index not in inlined:
                pairs.append((known[-1], text))
        return pairs, [known[result] for result in kernel.results]

    def _template(self, kernel: Kernel, operation: Operation) -> str:
        if operation not in self.templates:
            raise FormulaError(
                f"kernel '{kernel.name}' in {self.name}",
                f"{self.name} has no operation '{operation}'.",
                "Write the kernel in other arithmetic first: `in_arithmetic(kernel, Plain())`.",
            )
        return self.templates[operation]


def _only_choosing(kernel: Kernel) -> set[int]:
    """Comparisons that are nothing but the first operand of SELECT."""
    first = len(kernel.inputs)
    found = {first + k for k, each in enumerate(kernel.instructions) if each.operation in _COMPARISONS}
    for each in kernel.instructions:
        found -= set(each.operands[1:] if each.operation is Operation.SELECT else each.operands)
    return found - set(kernel.results)


def checked_function_name(name: str) -> str:
    """The name, if it can be that of a function in every language.

    Raises:
        FormulaError: if not.
    """
    if not is_plain_name(name):
        raise FormulaError(
            f"a function of the name {name!r}",
            "it is not an identifier, or it is a word of C, JavaScript or Python.",
            "Choose letters, digits and underscores, a lower-case letter first.",
        )
    return name
