"""A kernel affine in some of its inputs, solved for them: given the outputs, which inputs?

The values that depend on the sought inputs are unknowns together with these, every instruction one sparse equation.
Elimination where it fills least (H. M. Markowitz, Management Science 3 (1957)) runs a program of chained solves
backwards at about the cost of one forward pass; no matrix of slopes is formed or inverted. A program cannot choose
pivots while it runs: numbers come first, then coefficients that are factors of the determinant; what small full block
is left divides by its determinant, and only a larger one takes pivots that were large at the samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ulna.base import UlnaError
from ulna.program.factored import SMALL, factored
from ulna.program.instructions import Instruction, InstructionList, Operation, pruned
from ulna.program.kernel import Kernel, without_inputs
from ulna.program.lowering.numpy import to_numpy
from ulna.program.terms import ONE, Term, Terms, negative

_SMALL = 1e-2
"""Size of a sampled coefficient beside the largest of its row below which it is no pivot: rounding errors grow by as
much as the pivots are small."""
_CANCELLED = 1e-13


def solved_for_inputs(
    name: str,
    program: Kernel,
    unknowns: Sequence[str],
    wanted: Sequence[tuple[str | None, str]],
    samples: Sequence[Sequence[float]],
) -> Kernel | None:
    """The kernel of the inputs `unknowns` for which each output has the value asked for.

    Args:
        name: of the new kernel.
        program: affine in the unknowns.
        unknowns: (m,) names of inputs, the outputs of the new kernel and no longer inputs of it.
        wanted: (m,) pairs (name of a new input, output that shall equal it); None for one that shall vanish.
        samples: (points, inputs) values of the program's inputs; pivots are chosen there once and for all. The first
            point is generic; at the others the solution shall exist too, where the equations are regular there.

    Returns:
        None if some instruction is not affine in the unknowns or an output does not depend on them.

    Raises:
        UlnaError: if the equations are singular at the first point.
    """
    equations = _equations(program, set(unknowns), wanted, np.array(samples, dtype=float))
    if equations is None:
        return None
    values = equations.solved()
    results = [values[program.inputs.index(u)] for u in unknowns]
    inputs = (*program.inputs, *(v for v, _ in wanted if v is not None))
    instructions, kept = pruned(len(inputs), equations.terms.out.instructions, results)
    found = Kernel(name=name, inputs=inputs, outputs=tuple(unknowns), instructions=instructions, results=kept)
    return without_inputs(found, unknowns)


def _equations(
    program: Kernel, unknowns: set[str], wanted: Sequence[tuple[str | None, str]], samples: np.ndarray
) -> _Equations | None:
    first = len(program.inputs)
    out = InstructionList(first + sum(name is not None for name, _ in wanted))
    everything = Kernel(
        name=program.name,
        inputs=program.inputs,
        outputs=tuple(str(k) for k in range(first + len(program.instructions))),
        instructions=program.instructions,
        results=tuple(range(first + len(program.instructions))),
    )
    numbers = np.stack(to_numpy(everything)(*samples.T))
    finite = [bool(np.isfinite(column).all()) for column in numbers.T]
    numbers = numbers[:, [0, *(k for k in range(1, len(samples)) if finite[k])]]
    one = np.ones(numbers.shape[1])
    system = _Equations(terms=Terms(out=out), one=one)
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
    sides = iter(range(first, out.input_count))
    for name, label in wanted:
        if known[by_name[label]] is not None:
            return None
        system.add({by_name[label]: (ONE, one)}, None if name is None else (next(sides), 1.0))
    return system


Coefficient = tuple[Term, np.ndarray]
"""Its value, its (points,) numbers at the samples."""


@dataclass(slots=True, kw_only=True)
class _Equations:
    """Sparse rows Σ coefficient · unknown = side, every coefficient and side a multiple of a program's value."""

    terms: Terms
    one: np.ndarray
    rows: dict[int, dict[int, Coefficient]] = field(default_factory=dict)
    sides: dict[int, Term | None] = field(default_factory=dict)
    columns: dict[int, set[int]] = field(default_factory=dict)
    _candidates: dict[int, tuple[int, ...]] = field(default_factory=dict)

    def add(self, row: dict[int, Coefficient], side: Term | None) -> None:
        """One more row; a side of None is zero."""
        label = len(self.sides)
        self.rows[label], self.sides[label] = row, side
        for unknown in row:
            self.columns.setdefault(unknown, set()).add(label)

    def add_instruction(
        self, own: int, instruction: Instruction, operands: list[int | None], numbers: np.ndarray
    ) -> bool:
        """The row of an instruction with unknown operands (None); False if it is not affine in them."""
        places = instruction.operands
        operation = instruction.operation
        if operation is Operation.NEG:
            self.add({own: (ONE, self.one), places[0]: (ONE, self.one)}, None)
            return True
        if operation in (Operation.ADD, Operation.SUB):
            return self._add_sum(own, places, operands, 1.0 if operation is Operation.ADD else -1.0)
        if operation is Operation.MUL and None in operands and operands != [None, None]:
            moving = operands.index(None)
            factor = self.terms.value(operands[1 - moving])
            if factor is None:
                return False
            self.add({own: (ONE, self.one), places[moving]: (negative(factor), -numbers[places[1 - moving]])}, None)
            return True
        if operation is Operation.DIV and operands[1] is not None:
            below = self.terms.value(operands[1])
            if below is None:
                return False
            self.add({own: (below, numbers[places[1]]), places[0]: (negative(ONE), -self.one)}, None)
            return True
        return False

    def _add_sum(self, own: int, places: tuple[int, ...], operands: list[int | None], second: float) -> bool:
        """own − a ∓ b = 0."""
        row: dict[int, Coefficient] = {own: (ONE, self.one)}
        side: Term | None = None
        for place, operand, sign in zip(places, operands, (1.0, second), strict=True):
            if operand is not None:
                value = self.terms.value(operand)
                side = value if sign > 0 or value is None else negative(value)
                continue
            size = sign - row[place][0][1] if place in row else sign
            if size == 0.0:
                return False
            row[place] = ((None, -size), -size * self.one)
        self.add(row, side)
        return True

    def solved(self) -> dict[int, int]:
        """The value of every unknown."""
        terms = self.terms
        values: dict[int, Term | None] = {}
        later: list[tuple[int, dict[int, Coefficient], Term | None]] = []
        while self.rows:
            safe = self._safe_pivot()
            if safe is None and len(self.rows) <= SMALL:
                values |= self._core()
                break
            label, pivot = safe or self._sampled_pivot()
            row, side = self.rows.pop(label), self.sides[label]
            for unknown in row:
                self.columns[unknown].discard(label)
            if len(row) == 1:
                value = terms.over(side, row[pivot][0])
                # A factor is written once where several rows would repeat it.
                values[pivot] = terms.settled(value) if len(self.columns[pivot]) > 1 else value
                self._put_in(pivot, values[pivot])
            else:
                self._eliminate(pivot, row, side)
                later.append((pivot, row, side))
        for pivot, row, side in reversed(later):
            left = side
            for unknown, (coefficient, _) in row.items():
                if unknown != pivot:
                    left = terms.less(left, terms.times(coefficient, values[unknown]))
            values[pivot] = terms.over(left, row[pivot][0])
        return {unknown: terms.written(value) for unknown, value in values.items()}

    def _safe_pivot(self) -> tuple[int, int] | None:
        """Row and unknown that fill least, of those whose coefficient is a number or divides the determinant."""
        best: tuple[tuple[int, int, int], int, int] | None = None
        for label, row in self.rows.items():
            for unknown in self._usable(label):
                (index, factor), _ = row[unknown]
                others = len(self.columns[unknown]) - 1
                if index is not None and others and len(row) > 1:
                    continue
                cost = ((len(row) - 1) * others, len(row), 0 if index is None and abs(factor) == 1.0 else 1)
                if best is None or cost < best[0]:
                    best = (cost, label, unknown)
            if best is not None and best[0][:2] == (0, 1):
                break
        return None if best is None else best[1:]

    def _sampled_pivot(self) -> tuple[int, int]:
        """Row and unknown that fill least, of those whose coefficient is large at all samples."""
        costs = [
            ((len(row) - 1) * (len(self.columns[unknown]) - 1), len(row), label, unknown)
            for label, row in self.rows.items()
            for unknown in self._usable(label)
        ]
        if costs:
            return min(costs)[2:]
        if len(self.one) == 1:
            raise UlnaError("inputs for given outputs", "the equations are singular at a random point.")
        # Singular at one of the further points: these decide no longer.
        self.one = self.one[:1]
        for row in self.rows.values():
            row.update({unknown: (term, numbers[:1]) for unknown, (term, numbers) in row.items()})
        self._candidates.clear()
        return self._sampled_pivot()

    def _core(self) -> dict[int, Term | None]:
        """The unknowns of the last rows, few and full: solved without a choice of pivots."""
        unknowns = sorted({unknown for row in self.rows.values() for unknown in row})
        if len(unknowns) != len(self.rows):
            raise UlnaError("inputs for given outputs", "the equations are singular at a random point.")
        rows = [[row[u][0] if u in row else None for u in unknowns] for row in self.rows.values()]
        zero = 0.0 * self.one
        numbers = np.array([[row[u][1] if u in row else zero for u in unknowns] for row in self.rows.values()])
        found = factored(self.terms, rows, numbers.transpose(2, 0, 1)).solved([self.sides[k] for k in self.rows])
        return dict(zip(unknowns, found, strict=True))

    def _usable(self, label: int) -> tuple[int, ...]:
        """The unknowns of a row whose coefficients are not small beside its largest, at any point."""
        known = self._candidates.get(label)
        if known is None:
            row = self.rows[label]
            sizes = np.abs([numbers for _, numbers in row.values()]).reshape(len(row), len(self.one))
            large = (sizes > _SMALL * sizes.max(axis=0, initial=0.0)).all(axis=1)
            known = self._candidates[label] = tuple(u for u, fits in zip(row, large, strict=True) if fits)
        return known

    def _put_in(self, unknown: int, value: Term | None) -> None:
        for label in self.columns.pop(unknown):
            coefficient, _ = self.rows[label].pop(unknown)
            self._candidates.pop(label, None)
            self.sides[label] = self.terms.less(self.sides[label], self.terms.times(coefficient, value))

    def _eliminate(self, pivot: int, row: dict[int, Coefficient], side: Term | None) -> None:
        terms = self.terms
        for label in tuple(self.columns.pop(pivot)):
            other = self.rows[label]
            self._candidates.pop(label, None)
            above, number = other.pop(pivot)
            factor = terms.over(above, row[pivot][0])
            ratio = number / row[pivot][1]
            for unknown, (coefficient, size) in row.items():
                if unknown == pivot:
                    continue
                before = other.get(unknown)
                left = (before[1] if before else 0.0 * self.one) - ratio * size
                changed = terms.less(before[0] if before else None, terms.times(factor, coefficient))
                if changed is None or (before and (abs(left) <= _CANCELLED * abs(before[1])).all()):
                    del other[unknown]
                    self.columns[unknown].discard(label)
                    continue
                other[unknown] = (changed, left)
                self.columns[unknown].add(label)
            self.sides[label] = terms.less(self.sides[label], terms.times(factor, side))
