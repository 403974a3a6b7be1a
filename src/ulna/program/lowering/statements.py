"""A kernel as statements of a language: one for each operation, constants written where they are used."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from ulna.base import FormulaError
from ulna.program.identifiers import is_plain_name
from ulna.program.instructions import Instruction, Operation
from ulna.program.kernel import Kernel


def statements(
    kernel: Kernel,
    names: Sequence[str],
    templates: Mapping[Operation, str],
    literal: Callable[[Instruction], str],
    *,
    language: str,
) -> tuple[list[tuple[str, str]], list[str]]:
    """Pairs (name, expression) in the order of the list, and the names of the results.

    Args:
        kernel: what to write out.
        names: for each input the text that stands for it.
        templates: how the language writes an operation on {0}, {1} and {2}.
        literal: how it writes a constant.
        language: for messages.

    Raises:
        FormulaError: an operation that the language does not have.
    """
    known = list(names)
    pairs = []
    for position, instruction in enumerate(kernel.instructions):
        if instruction.operation is Operation.CONSTANT:
            known.append(literal(instruction))
            continue
        template = templates.get(instruction.operation)
        if template is None:
            raise FormulaError(
                f"kernel '{kernel.name}' in {language}",
                f"{language} has no operation '{instruction.operation}'.",
                "Write the kernel in other arithmetic first: `in_arithmetic(kernel, Plain())`.",
            )
        pairs.append((f"v{position}", template.format(*(known[k] for k in instruction.operands))))
        known.append(f"v{position}")
    return pairs, [known[result] for result in kernel.results]


def checked_function_name(name: str) -> str:
    """The name, if it can be that of a function in every language.

    Raises:
        FormulaError: if not.
    """
    if not is_plain_name(name):
        raise FormulaError(
            f"a function of the name {name!r}",
            "it is no identifier, or a word of C, JavaScript or Python.",
            "Choose letters, digits and underscores, a small letter first.",
        )
    return name
