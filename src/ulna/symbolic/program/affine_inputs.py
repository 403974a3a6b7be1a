"""A kernel affine in some of its inputs, solved for them: given the outputs, which inputs?

The values that depend on the sought inputs are unknowns together with these, every instruction one sparse equation.
Elimination where it fills least (H. M. Markowitz, Management Science 3 (1957)) runs a program of chained solves
backwards at about the cost of one forward pass; no matrix of slopes is formed or inverted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ulna.base import UlnaError
from ulna.symbolic.program.instructions import Instruction, InstructionList, Operation, pruned
from ulna.symbolic.program.kernel import Kernel
from ulna.symbolic.program.lowering.numpy import to_numpy

_SMALL = 1e-2
"""Size of a sampled coefficient beside the largest of its row below which it is no pivot: rounding errors grow by as
much as the pivots are small."""
_CANCELLED = 1e-13


def solved_for_inputs(
    name: str,
    program: Kernel,
    unknowns: Sequence[str],
    wanted: Sequence[tuple[str, str]],
    sample: Sequence[float],
) -> Kernel | None:
    """The kernel of the inputs `unknowns` for which each output has the value asked for.

    Args:
        name: of the new kernel.
        program: affine in the unknowns.
        unknowns: (m,) names of inputs, the outputs of the new kernel; they stay inputs, unused.
        wanted: (m,) pairs (name of a new input, output that shall equal it).
        sample: a generic value for every input of the program; pivots are chosen there once and for all.

    Returns:
        None if some instruction is not affine in the unknowns or an output does not depend on them.

    Raises:
        UlnaError: if the equations are singular at the sample.
    """
    equations = _equations(program, set(unknowns), wanted, sample)
    if equations is None:
        return None
    values = equations.solved()
    results = [values[program.inputs.index(u)] for u in unknowns]
    inputs = (*program.inputs, *(v for v, _ in wanted))
    instructions, kept = pruned(len(inputs), equations.out.instructions, results)
    return Kernel(name=name, inputs=inputs, outputs=tuple(unknowns), instructions=instructions, results=kept)


def _equations(
    program: Kernel, unknowns: set[str], wanted: Sequence[tuple[str, str]], sample: Sequence[float]
) -> _Equations | None:
    first = len(program.inputs)
    out = InstructionList(first + len(wanted))
    system = _Equations(out=out)
    everything = Kernel(
        name=program.name,
        inputs=program.inputs,
        outputs=tuple(str(k) for k in range(first + len(program.instructions))),
        instructions=program.instructions,
        results=tuple(range(first + len(program.instructions))),
    )
    numbers = np.array(to_numpy(everything)(*sample), dtype=float)
    known: list[int | None] = [None if n in unknowns else k for k, n in enumerate(program.inputs)]
    for position, instruction in enumerate(program.instructions):
        operands = [known[k] for k in instruction.operands]
        if instruction.operation is Operation.CONSTANT:
            known.append(out.constant(instruction.value))
        elif all(k is not None for k in operands):
            known.append(out.emit(instruction.operation, *(k for k in operands if k is not None)))
        elif system.add_instruction(first + position, instruction, operands, numbers):
            known.append(None)
        else:
            return None
    by_name = dict(zip(program.outputs, program.results, strict=True))
    for number, (_, label) in enumerate(wanted):
        if known[by_name[label]] is not None:
            return None
        system.add({by_name[label]: (out.constant(1.0), 1.0)}, first + number)
    return system


Coefficient = tuple[int, float]
"""Index of the value, its number at the sample."""


@dataclass(slots=True, kw_only=True)
class _Equations:
    """Sparse rows Σ coefficient · unknown = side, every coefficient and side a value of the instruction list."""

    out: InstructionList
    rows: dict[int, dict[int, Coefficient]] = field(default_factory=dict)
    sides: dict[int, int | None] = field(default_factory=dict)
    columns: dict[int, set[int]] = field(default_factory=dict)

    def add(self, row: dict[int, Coefficient], side: int | None) -> None:
        """One more row; a side of None is zero."""
        label = len(self.sides)
        self.rows[label], self.sides[label] = row, side
        for unknown in row:
            self.columns.setdefault(unknown, set()).add(label)

    def add_instruction(
        self, own: int, instruction: Instruction, operands: list[int | None], numbers: np.ndarray
    ) -> bool:
        """The row of an instruction with unknown operands (None); False if it is not affine in them."""
        one, less = (self.out.constant(1.0), 1.0), (self.out.constant(-1.0), -1.0)
        places = instruction.operands
        operation = instruction.operation
        if operation is Operation.NEG:
            self.add({own: one, places[0]: one}, None)
            return True
        if operation in (Operation.ADD, Operation.SUB):
            return self._add_sum(own, places, operands, less if operation is Operation.ADD else one)
        if operation is Operation.MUL and None in operands and operands != [None, None]:
            moving = operands.index(None)
            factor = operands[1 - moving]
            if factor is None:
                return False
            scaled = (_negated(self.out, factor), -float(numbers[places[1 - moving]]))
            self.add({own: one, places[moving]: scaled}, None)
            return True
        if operation is Operation.DIV and operands[1] is not None:
            self.add({own: (operands[1], float(numbers[places[1]])), places[0]: less}, None)
            return True
        return False

    def _add_sum(self, own: int, places: tuple[int, ...], operands: list[int | None], second: Coefficient) -> bool:
        """own − a − b = 0, or own − a + b = 0."""
        if places[0] == places[1]:
            return False
        row = {own: (self.out.constant(1.0), 1.0)}
        side: int | None = None
        for place, operand, coefficient in zip(
            places, operands, ((self.out.constant(-1.0), -1.0), second), strict=True
        ):
            if operand is None:
                row[place] = coefficient
            else:
                side = operand if coefficient[1] < 0 else _negated(self.out, operand)
        self.add(row, side)
        return True

    def solved(self) -> dict[int, int]:
        """The value of every unknown."""
        values: dict[int, int] = {}
        later: list[tuple[int, dict[int, Coefficient], int | None]] = []
        while self.rows:
            label, pivot = self._pivot()
            row, side = self.rows.pop(label), self.sides[label]
            for unknown in row:
                self.columns[unknown].discard(label)
            if len(row) == 1:
                values[pivot] = self._over(side, row[pivot][0])
                self._put_in(pivot, values[pivot])
            else:
                self._eliminate(pivot, row, side)
                later.append((pivot, row, side))
        for pivot, row, side in reversed(later):
            left = side
            for unknown, (coefficient, _) in row.items():
                if unknown != pivot:
                    left = self._less(left, coefficient, values[unknown])
            values[pivot] = self._over(left, row[pivot][0])
        return values

    def _pivot(self) -> tuple[int, int]:
        """Row and unknown that fill least; rows of one unknown first."""
        best: tuple[tuple[int, int, int], int, int] | None = None
        for label, row in self.rows.items():
            largest = max((abs(number) for _, number in row.values()), default=0.0)
            for unknown, (_, number) in row.items():
                if abs(number) <= _SMALL * largest:
                    continue
                fill = (len(row) - 1) * (len(self.columns[unknown]) - 1)
                cost = (fill, len(row), 0 if abs(number) == 1.0 else 1)
                if best is None or cost < best[0]:
                    best = (cost, label, unknown)
            if best is not None and best[0][:2] == (0, 1):
                break
        if best is None:
            raise UlnaError("inputs for given outputs", "the equations are singular at a random point.")
        return best[1], best[2]

    def _put_in(self, unknown: int, value: int) -> None:
        for label in self.columns.pop(unknown):
            coefficient, _ = self.rows[label].pop(unknown)
            self.sides[label] = self._less(self.sides[label], coefficient, value)

    def _eliminate(self, pivot: int, row: dict[int, Coefficient], side: int | None) -> None:
        for label in tuple(self.columns.pop(pivot)):
            other = self.rows[label]
            above, number = other.pop(pivot)
            factor = self._over(above, row[pivot][0])
            ratio = number / row[pivot][1]
            for unknown, (coefficient, size) in row.items():
                if unknown == pivot:
                    continue
                before = other.get(unknown)
                left = (before[1] if before else 0.0) - ratio * size
                if before and abs(left) <= _CANCELLED * abs(before[1]):
                    del other[unknown]
                    self.columns[unknown].discard(label)
                    continue
                other[unknown] = (self._less(before[0] if before else None, factor, coefficient), left)
                self.columns[unknown].add(label)
            if side is not None:
                self.sides[label] = self._less(self.sides[label], factor, side)

    def _over(self, above: int | None, below: int) -> int:
        if above is None:
            return self.out.constant(0.0)
        if self.out.value_of(below) == -1.0:
            return _negated(self.out, above)
        return self.out.emit(Operation.DIV, above, below)

    def _less(self, value: int | None, factor: int, other: int) -> int:
        """Value − factor · other, no negation left over where the factor is one."""
        sign = self.out.value_of(factor)
        if value is None:
            product = self.out.emit(Operation.MUL, factor, other)
            return _negated(self.out, product)
        if sign == -1.0:
            return self.out.emit(Operation.ADD, value, other)
        negative = _inner(self.out, factor)
        if negative is not None:
            return self.out.emit(Operation.ADD, value, self.out.emit(Operation.MUL, negative, other))
        return self.out.emit(Operation.SUB, value, self.out.emit(Operation.MUL, factor, other))


def _negated(out: InstructionList, index: int) -> int:
    return out.emit(Operation.NEG, index)


def _inner(out: InstructionList, index: int) -> int | None:
    """A where the value is −a."""
    if index < out.input_count:
        return None
    instruction = out.instructions[index - out.input_count]
    return instruction.operands[0] if instruction.operation is Operation.NEG else None
