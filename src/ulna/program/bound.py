"""`bound`: a kernel whose numbers are known, computed as far as they go."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from ulna.program.instructions import Instruction, InstructionList, Operation, pruned
from ulna.program.kernel import Kernel, check_names
from ulna.program.lowering.numpy import to_numpy
from ulna.program.precision import Precision


def bound(kernel: Kernel, numbers: Mapping[str, float], *, precision: Precision = Precision.DOUBLE) -> Kernel:
    """The kernel with some inputs held at numbers; what follows from constants alone is computed now.

    It is computed in the precision that the lowering will have, by the operations it will have, so that every bit of
    the results stays. What would not be finite is left to be computed there. A choice whose condition is known
    becomes what it chooses. Names in `numbers` that are not inputs are ignored.
    """
    kept = [name for name in kernel.inputs if name not in numbers]
    out = InstructionList(len(kept))
    place = {name: k for k, name in enumerate(kept)}
    values = [
        place[name] if name in place else out.constant(precision.rounded(numbers[name])) for name in kernel.inputs
    ]
    for each in kernel.instructions:
        if each.operation is Operation.CONSTANT:
            values.append(out.constant(precision.rounded(each.value)))
            continue
        operands = [values[k] for k in each.operands]
        known = [out.value_of(k) for k in operands]
        if each.operation is Operation.SELECT and known[0] is not None:
            values.append(operands[1] if known[0] != 0.0 else operands[2])
            continue
        found = _computed(each.operation, known, precision)
        values.append(out.emit(each.operation, *operands) if found is None else out.constant(found))
    instructions, results = pruned(len(kept), out.instructions, [values[k] for k in kernel.results])
    check_names(kernel.name, kept, kernel.outputs)
    return Kernel(
        name=kernel.name, inputs=tuple(kept), outputs=kernel.outputs, instructions=instructions, results=results
    )


def _computed(operation: Operation, known: list[float | None], precision: Precision) -> float | None:
    """The result on constants, None where one is not known or the result is not finite."""
    numbers = [value for value in known if value is not None]
    if len(numbers) < len(known):
        return None
    (value,) = _alone(operation, len(numbers), precision)(*numbers)
    return float(value) if math.isfinite(value) else None


@cache
def _alone(operation: Operation, count: int, precision: Precision) -> Callable[..., tuple[Any, ...]]:
    """The operation by itself, as NumPy does it."""
    operands = tuple(range(count))
    kernel = Kernel(
        name=operation.value,
        inputs=tuple(f"a{k}" for k in operands),
        outputs=("value",),
        instructions=(Instruction(operation=operation, operands=operands),),
        results=(count,),
    )
    return to_numpy(kernel, precision=precision)
