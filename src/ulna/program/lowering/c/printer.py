"""A `Kernel` as one function of C99."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ulna.program.kernel import Kernel
from ulna.program.lowering.c.templates import templates
from ulna.program.lowering.statements import Language, checked_function_name
from ulna.program.precision import Precision


def to_c(kernel: Kernel, function_name: str, *, precision: Precision = Precision.DOUBLE) -> str:
    """The text of `void name(const real *inputs, real *outputs)`, values in the order of the kernel's names.

    It needs `c_header` above it and the flags `C_FLAGS`. Every number is written so that it reads back exactly. Under
    `Plain()` arithmetic of the same precision the results are those of every other lowering, to the last bit. The
    arrays must not overlap.

    Raises:
        FormulaError: a function name that is not an identifier.
    """
    real = precision.value
    pairs, results = c_statements(kernel, kernel.identifiers, precision=precision)
    used = {k for each in kernel.instructions for k in each.operands} | set(kernel.results)
    lines = [f"void {checked_function_name(function_name)}(const {real} *inputs, {real} *outputs)", "{"]
    lines += [f"    const {real} {name} = inputs[{k}];" for k, name in enumerate(kernel.identifiers) if k in used]
    if not used & set(range(len(kernel.inputs))):
        lines.append("    (void)inputs;")
    lines += [f"    const {real} {name} = {text};" for name, text in pairs]
    lines += [f"    outputs[{k}] = {text};" for k, text in enumerate(results)]
    return "\n".join([*lines, "}"]) + "\n"


def c_statements(
    kernel: Kernel, inputs: Sequence[str], *, precision: Precision
) -> tuple[list[tuple[str, str]], list[str]]:
    """Pairs (name, expression) of the constants v0, v1, … in order, and the expressions of the outputs.

    Args:
        kernel: what to write out. inputs: for each input the text that stands for it. precision: of every number.
    """
    language = Language(
        name="C",
        templates=templates(precision),
        literal=lambda each: c_literal(each.value, precision),
        choice="(({0}) ? {1} : {2})",
    )
    return language.statements(kernel, inputs)


def c_literal(value: float, precision: Precision) -> str:
    """The shortest decimal number that reads back as the number rounded to the precision."""
    value = precision.rounded(value)
    if math.isnan(value):
        return f"(({precision.value})NAN)"
    if math.isinf(value):
        return f"(({precision.value}){'-' if value < 0 else ''}INFINITY)"
    text = f"{np.float32(value)!s}f" if precision is Precision.SINGLE else repr(value)
    return f"({text})" if math.copysign(1.0, value) < 0 else text
