"""Linear systems inside kernels: A x = b solved by elimination, every step an instruction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ulna.base import UlnaError
from ulna.symbolic.program.instructions import InstructionList, Operation, pruned
from ulna.symbolic.program.kernel import Kernel

_ZERO = 0.0


def joined(name: str, parts: Sequence[Kernel], extra_inputs: Sequence[str] = ()) -> Kernel:
    """One kernel with the outputs of several over the same inputs; what they share appears once."""
    inputs = (*parts[0].inputs, *extra_inputs)
    out = InstructionList(len(inputs))
    results: list[int] = []
    for part in parts:
        values = list(range(len(part.inputs)))
        for instruction in part.instructions:
            if instruction.operation is Operation.CONSTANT:
                values.append(out.constant(instruction.value))
            else:
                values.append(out.emit(instruction.operation, *(values[k] for k in instruction.operands)))
        results += [values[k] for k in part.results]
    instructions, kept = pruned(len(inputs), out.instructions, results)
    outputs = tuple(label for part in parts for label in part.outputs)
    return Kernel(name=name, inputs=inputs, outputs=outputs, instructions=instructions, results=kept)


def solved(
    name: str,
    system: Kernel,
    matrix: Sequence[Sequence[str]],
    right: Sequence[tuple[str, str]],
    unknowns: Sequence[str],
    sample: np.ndarray,
) -> Kernel:
    """The kernel of x in A x = p − q.

    Args:
        name: of the new kernel.
        system: outputs the entries of A and q, has p among its inputs.
        matrix: (m, m) names of the outputs that are the entries of A.
        right: (m,) pairs (input p, output q).
        unknowns: (m,) names of the solution, the outputs of the new kernel.
        sample: (m, m) values of A at a generic point; pivots are chosen by it once and for all.

    Raises:
        UlnaError: if A is singular at the sample.
    """
    out = InstructionList(len(system.inputs))
    values = list(range(len(system.inputs)))
    for instruction in system.instructions:
        if instruction.operation is Operation.CONSTANT:
            values.append(out.constant(instruction.value))
        else:
            values.append(out.emit(instruction.operation, *(values[k] for k in instruction.operands)))
    index = {label: values[k] for label, k in zip(system.outputs, system.results, strict=True)}
    place = {label: k for k, label in enumerate(system.inputs)}
    rows: list[list[int | None]] = [
        [None if out.value_of(index[label]) == _ZERO else index[label] for label in row] for row in matrix
    ]
    sides: list[int | None] = [out.emit(Operation.SUB, place[p], index[q]) for p, q in right]
    solution = _eliminated(out, rows, sides, np.array(sample, dtype=float))
    instructions, kept = pruned(len(system.inputs), out.instructions, solution)
    return Kernel(name=name, inputs=system.inputs, outputs=tuple(unknowns), instructions=instructions, results=kept)


def _eliminated(
    out: InstructionList, rows: list[list[int | None]], sides: list[int | None], sample: np.ndarray
) -> list[int]:
    """Gauss with the largest sampled pivot of the sparsest rows; None stands for zero."""
    m = len(rows)
    free_rows, free_columns, order = set(range(m)), set(range(m)), []
    scale = np.abs(sample).max(initial=0.0) or 1.0
    while free_rows:
        r, c = _pivot(rows, sample, free_rows, free_columns, scale)
        free_rows.remove(r)
        free_columns.remove(c)
        order.append((r, c))
        for other in free_rows:
            if rows[other][c] is None:
                continue
            factor = _divide(out, rows[other][c], rows[r][c])
            ratio = sample[other, c] / sample[r, c]
            for column in free_columns:
                rows[other][column] = _less(out, rows[other][column], factor, rows[r][column])
                sample[other, column] -= ratio * sample[r, column]
            sides[other] = _less(out, sides[other], factor, sides[r])
    solution: dict[int, int | None] = {}
    for r, c in reversed(order):
        side = sides[r]
        for column, value in solution.items():
            side = _less(out, side, rows[r][column], value)
        solution[c] = _divide(out, side, rows[r][c])
    zero = out.constant(0.0)
    return [zero if (value := solution[k]) is None else value for k in range(m)]


def _pivot(
    rows: list[list[int | None]], sample: np.ndarray, free_rows: set[int], free_columns: set[int], scale: float
) -> tuple[int, int]:
    """The sparsest usable row, in it the largest sampled entry."""
    best: tuple[int, float, int, int] | None = None
    for r in free_rows:
        count = sum(rows[r][c] is not None for c in free_columns)
        for c in free_columns:
            size = abs(float(sample[r, c]))
            if rows[r][c] is not None and size > 1e-9 * scale and (best is None or (count, -size) < best[:2]):
                best = (count, -size, r, c)
    if best is None:
        raise UlnaError("a linear system in a kernel", "its matrix is singular at a random point.")
    return best[2], best[3]


def _divide(out: InstructionList, above: int | None, below: int | None) -> int | None:
    return None if above is None or below is None else out.emit(Operation.DIV, above, below)


def _less(out: InstructionList, value: int | None, factor: int | None, other: int | None) -> int | None:
    """Value − factor · other."""
    if factor is None or other is None:
        return value
    product = out.emit(Operation.MUL, factor, other)
    return out.emit(Operation.NEG, product) if value is None else out.emit(Operation.SUB, value, product)
