"""Kernels joined, and linear systems between outputs of a kernel solved: every step an instruction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ulna.program.factored import factored
from ulna.program.instructions import InstructionList, pruned
from ulna.program.kernel import Kernel, copied
from ulna.program.terms import Terms


def joined(name: str, parts: Sequence[Kernel], extra_inputs: Sequence[str] = ()) -> Kernel:
    """One kernel with the outputs of several over the same inputs; what they share appears once."""
    inputs = (*parts[0].inputs, *extra_inputs)
    out = InstructionList(len(inputs))
    results: list[int] = []
    for part in parts:
        values = copied(part, out)
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
    samples: np.ndarray,
) -> Kernel:
    """The kernel of x in A x = p − q.

    Args:
        name: of the new kernel.
        system: outputs the entries of A and q, has p among its inputs.
        matrix: (m, m) names of the outputs that are the entries of A.
        right: (m,) pairs (input p, output q).
        unknowns: (m,) names of the solution, the outputs of the new kernel.
        samples: (points, m, m) values of A at generic points; pivots are chosen by them once and for all.

    Raises:
        UlnaError: if A is singular at the first sample.
    """
    out = InstructionList(len(system.inputs))
    values = copied(system, out)
    terms = Terms(out=out)
    index = {label: values[k] for label, k in zip(system.outputs, system.results, strict=True)}
    place = {label: k for k, label in enumerate(system.inputs)}
    prepared = factored(terms, [[terms.value(index[label]) for label in row] for row in matrix], samples)
    sides = [terms.less(terms.value(place[p]), terms.value(index[q])) for p, q in right]
    solution = [terms.written(value) for value in prepared.solved(sides)]
    instructions, kept = pruned(len(system.inputs), out.instructions, solution)
    return Kernel(name=name, inputs=system.inputs, outputs=tuple(unknowns), instructions=instructions, results=kept)
