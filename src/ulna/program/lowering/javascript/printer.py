"""A `Kernel` as one function of JavaScript."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ulna.program.instructions import Instruction
from ulna.program.kernel import Kernel
from ulna.program.lowering.javascript.templates import TEMPLATES
from ulna.program.lowering.statements import Language, checked_function_name
from ulna.program.precision import Precision


def to_javascript(kernel: Kernel, function_name: str, *, precision: Precision = Precision.DOUBLE) -> str:
    """The text of `function name(inputs, outputs)` of two arrays, values in the order of the kernel's names.

    Numbers are doubles; in single precision each operation is rounded by `Math.fround`, which is the same as rounding
    once. Under `Plain()` arithmetic of the same precision the results are those of every other lowering.

    Raises:
        FormulaError: a function name that is not an identifier; FMA and FLIP, which JavaScript does not have.
    """
    given = [f"inputs[{k}]" for k in range(len(kernel.inputs))]
    taken = [f"outputs[{k}]" for k in range(len(kernel.outputs))]
    return _function(kernel, f"{checked_function_name(function_name)}(inputs, outputs)", (given, taken), precision)


def to_javascript_in_place(
    kernel: Kernel, function_name: str, places: Mapping[str, int], *, precision: Precision = Precision.DOUBLE
) -> str:
    """The text of `function name(m)` of one array that holds inputs and outputs, each at its place there.

    An output may take the place of an input: everything is read before anything is written. Otherwise as
    `to_javascript`.

    Args:
        kernel, function_name, precision: see there. places: of every input that is used and of every output.

    Raises:
        FormulaError: see there.
    """
    given = [f"m[{places[name]}]" if name in places else "" for name in kernel.inputs]
    taken = [f"m[{places[name]}]" for name in kernel.outputs]
    return _function(kernel, f"{checked_function_name(function_name)}(m)", (given, taken), precision)


def _function(kernel: Kernel, head: str, ends: tuple[Sequence[str], Sequence[str]], precision: Precision) -> str:
    """The function that reads its inputs and leaves its outputs at these ends."""
    language = Language(
        name="JavaScript",
        templates=TEMPLATES,
        literal=lambda each: _literal(each, precision),
        choice="({0} ? {1} : {2})",
    )
    names = [f"a{k}" for k in range(len(kernel.inputs))]
    pairs, results = language.statements(kernel, names)
    used = {k for each in kernel.instructions for k in each.operands} | set(kernel.results)
    rounded = "Math.fround({0})" if precision is Precision.SINGLE else "{0}"
    lines = [f"function {head} {{", '  "use strict";']
    lines += [f"  const {name} = {rounded.format(ends[0][k])};" for k, name in enumerate(names) if k in used]
    lines += [f"  const {name} = {rounded.format(text)};" for name, text in pairs]
    lines += [f"  {place} = {text};" for place, text in zip(ends[1], results, strict=True)]
    return "\n".join([*lines, "}"]) + "\n"


def _literal(instruction: Instruction, precision: Precision) -> str:
    value = precision.rounded(instruction.value)
    if math.isnan(value):
        return "NaN"
    if math.isinf(value):
        return "Infinity" if value > 0 else "(-Infinity)"
    return f"({value!r})" if math.copysign(1.0, value) < 0 else repr(value)
