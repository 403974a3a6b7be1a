"""A `Kernel` as one function of JavaScript."""

from __future__ import annotations

import math

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
        FormulaError: a function name that is no identifier; FMA and FLIP, which JavaScript does not have.
    """
    single = precision is Precision.SINGLE
    language = Language(
        name="JavaScript",
        templates=TEMPLATES,
        literal=lambda each: _literal(each, precision),
        choice="({0} ? {1} : {2})",
    )
    pairs, results = language.statements(kernel, kernel.identifiers)
    used = {k for each in kernel.instructions for k in each.operands} | set(kernel.results)
    rounded = "Math.fround({0})" if single else "{0}"
    lines = [f"function {checked_function_name(function_name)}(inputs, outputs) {{", '  "use strict";']
    lines += [
        f"  const {name} = {rounded.format(f'inputs[{k}]')};" for k, name in enumerate(kernel.identifiers) if k in used
    ]
    lines += [f"  const {name} = {rounded.format(text)};" for name, text in pairs]
    lines += [f"  outputs[{k}] = {text};" for k, text in enumerate(results)]
    return "\n".join([*lines, "}"]) + "\n"


def _literal(instruction: Instruction, precision: Precision) -> str:
    value = precision.rounded(instruction.value)
    if math.isnan(value):
        return "NaN"
    if math.isinf(value):
        return "Infinity" if value > 0 else "(-Infinity)"
    return f"({value!r})" if math.copysign(1.0, value) < 0 else repr(value)
