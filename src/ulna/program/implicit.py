"""A program some of whose inputs are found from it: those at which outputs of it vanish, linear in them together.

Accelerations behind a mass matrix, M(q) a = r, are the common case. Their Taylor coefficients along a motion satisfy
M₀ a_k = r_k − Σ M_j a_{k−j}, j ≥ 1: the matrix is factored once, and every order costs two triangular passes more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ulna.base import UlnaError
from ulna.program.factored import AbstractFactored, Entry, factored
from ulna.program.instructions import Operation, pruned
from ulna.program.kernel import Kernel
from ulna.program.lowering.numpy import to_numpy
from ulna.program.series import SeriesRules
from ulna.program.terms import ONE, Term, Terms, negative

_SEED = 8713
_POINTS = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class ImplicitKernel:
    """A program with unknowns.

    Attributes:
        kernel: its last inputs are the unknowns, its last outputs what they make vanish.
        unknowns: (k,) names of inputs; residuals: (k,) names of outputs, affine in the unknowns.
    """

    kernel: Kernel
    unknowns: tuple[str, ...]
    residuals: tuple[str, ...]

    @property
    def given(self) -> tuple[str, ...]:
        """The inputs that are not unknowns."""
        return self.kernel.inputs[: len(self.kernel.inputs) - len(self.unknowns)]


class LinearBlock:
    """The part of a program between its unknowns and the residuals: affine, its slopes the same at every order.

    Attributes:
        dependent: positions of the instructions that depend on an unknown.
        positions: those of them that a residual needs, in order.
    """

    def __init__(self, program: ImplicitKernel) -> None:
        self.program = program
        whole = program.kernel
        first = len(whole.inputs)
        self.inputs = range(len(program.given), first)
        self.results = dict(zip(whole.outputs, whole.results, strict=True))
        moved = set(self.inputs)
        for position, instruction in enumerate(whole.instructions):
            if moved.intersection(instruction.operands):
                moved.add(first + position)
        needed = ancestors(whole, [self.results[label] for label in program.residuals])
        self.dependent = frozenset(k - first for k in moved if k >= first)
        self.positions = tuple(k for k in range(len(whole.instructions)) if k in self.dependent and first + k in needed)
        self.late = frozenset(moved)
        self._factored: AbstractFactored | None = None

    def solved(self, rules: SeriesRules, k: int) -> list[int | None]:
        """Coefficient k of the unknowns; that of the residuals has been grown with it zero.

        Raises:
            UlnaError: if a residual is not affine in the unknowns, or their matrix is singular at a random point.
        """
        if self._factored is None:
            self._factored = self._factors(rules)
        terms = Terms(out=rules.out)
        sides = [terms.value(rules.series[self.results[label]][k]) for label in self.program.residuals]
        found = self._factored.solved([None if side is None else negative(side) for side in sides])
        return [None if value is None else terms.written(value) for value in found]

    def _factors(self, rules: SeriesRules) -> AbstractFactored:
        rows: list[list[Entry]] = [[] for _ in self.program.residuals]
        terms = Terms(out=rules.out)
        for unknown in self.inputs:
            slopes = self._slopes(rules, terms, unknown)
            for row, label in zip(rows, self.program.residuals, strict=True):
                row.append(slopes.get(self.results[label]))
        return factored(terms, rows, _sampled(rules, rows))

    def _slopes(self, rules: SeriesRules, terms: Terms, unknown: int) -> dict[int, Term]:
        """∂value/∂unknown of the block's values at order zero."""
        first = len(self.program.kernel.inputs)
        slopes: dict[int, Term] = {unknown: ONE}
        for position in self.positions:
            instruction = self.program.kernel.instructions[position]
            operands = instruction.operands
            parts = [slopes.get(operand) for operand in operands]
            moving = [operand in self.late for operand in operands]
            known = [
                terms.value(None if moves else rules.series[k][0]) for k, moves in zip(operands, moving, strict=True)
            ]
            match instruction.operation:
                case Operation.ADD:
                    slope = terms.less(parts[0], None if parts[1] is None else negative(parts[1]))
                case Operation.SUB:
                    slope = terms.less(parts[0], parts[1])
                case Operation.NEG:
                    slope = terms.less(None, parts[0])
                case Operation.MUL if not all(moving):
                    slope = terms.times(parts[0], known[1]) if moving[0] else terms.times(known[0], parts[1])
                case Operation.DIV if known[1] is not None:
                    slope = terms.over(parts[0], known[1])
                case _:
                    raise UlnaError(
                        f"the unknowns {', '.join(self.program.unknowns)} of '{self.program.kernel.name}'",
                        f"'{instruction.operation}' of them: the equations are not written affinely in them.",
                        "Write each as coefficients times unknowns plus what is known.",
                    )
            if slope is not None:
                slopes[first + position] = slope
        return slopes


def ancestors(program: Kernel, values: Sequence[int]) -> set[int]:
    """The values that given values are computed from, themselves included."""
    first = len(program.inputs)
    needed = set(values)
    for position in range(len(program.instructions) - 1, -1, -1):
        if first + position in needed:
            needed.update(program.instructions[position].operands)
    return needed


def _sampled(rules: SeriesRules, rows: Sequence[Sequence[Entry]]) -> np.ndarray:
    """(points, k, k) values of the matrix at random points."""
    places = [(i, k, *entry) for i, row in enumerate(rows) for k, entry in enumerate(row) if entry is not None]
    varying = [index for _, _, index, _ in places if index is not None]
    count = rules.out.input_count
    instructions, results = pruned(count, rules.out.instructions, varying)
    labels = tuple(str(k) for k in range(len(varying)))
    inputs = tuple(f"x{k}" for k in range(count))
    entries = Kernel(name="matrix", inputs=inputs, outputs=labels, instructions=instructions, results=results)
    numbers = np.random.default_rng(_SEED).uniform(0.2, 1.2, (count, _POINTS))
    samples = np.zeros((_POINTS, len(rows), len(rows)))
    values = iter(to_numpy(entries)(*numbers))
    for i, k, index, factor in places:
        samples[:, i, k] = factor if index is None else factor * next(values)
    return samples
