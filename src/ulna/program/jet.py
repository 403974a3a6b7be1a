"""Lie derivatives as Taylor coefficients of the flow: no symbolic derivative, a handful of operations per order.

Along x' = f(x) the Taylor coefficients of y = h(x(t)) at t = 0 are L_fᵏ h / k!. They follow from the instructions of f
and h one order after the other (`series`), unknowns of an implicit program from their equations (`implicit`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import factorial

from ulna.program.implicit import ImplicitKernel, LinearBlock, ancestors
from ulna.program.instructions import InstructionList, pruned
from ulna.program.kernel import Kernel, without_inputs
from ulna.program.series import SeriesRules


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenDerivatives:
    """Lie derivatives in which unknowns that depend on chosen inputs are inputs still.

    Attributes:
        kernel: inputs those of the field, then the open coefficients; outputs `h:k` and what the coefficients make
            vanish.
        coefficients: (j,) names of inputs; residuals: (j,) names of outputs.
    """

    kernel: Kernel
    coefficients: tuple[str, ...]
    residuals: tuple[str, ...]


def explicit(program: ImplicitKernel) -> Kernel:
    """The program with its unknowns found: the other outputs over the other inputs.

    Raises:
        UlnaError: if a residual is not affine in the unknowns, or their matrix is singular at a random point.
    """
    growth = _Growth(program, (), ())
    wanted = [label for label in program.kernel.outputs if label not in program.residuals]
    growth.grow(0, wanted)
    return growth.kernel(program.kernel.name, [(label, label, 0) for label in wanted])


def lie_derivatives(field: Kernel | ImplicitKernel, states: Sequence[str], rates: Sequence[str], order: int) -> Kernel:
    """The kernel of L_fᵏ h for every further output h of `field` and k = 0 … order, named `h:k`.

    Args:
        field: outputs the rates of the states, in their order, and the functions h.
        states: (n,) names of the inputs that move; every other input stays constant.
        rates: (n,) names of the outputs that are their derivatives.
        order: the highest k.

    Raises:
        UlnaError: for an operation without derivatives (abs, sign, min, floor, comparisons).
    """
    program = _as_implicit(field)
    growth = _Growth(program, states, rates)
    functions = _functions(program, rates)
    for k in range(order):
        growth.grow(k, program.kernel.outputs)
    growth.grow(order, functions)
    wanted = [(f"{name}:{k}", name, k) for name in functions for k in range(order + 1)]
    return growth.kernel(f"Lie derivatives of {program.kernel.name}", wanted)


def open_derivatives(
    field: Kernel | ImplicitKernel,
    states: Sequence[str],
    rates: Sequence[str],
    wanted: Sequence[tuple[str, int]],
    along: Sequence[str],
) -> OpenDerivatives:
    """The kernel of some Lie derivatives, with the unknowns left open that depend on the inputs `along`.

    Whoever prescribes the derivatives and seeks those inputs need not solve for what is known then (computed torque).

    Args:
        field, states, rates: as in `lie_derivatives`.
        wanted: pairs (function, k).
        along: names of inputs.

    Raises:
        UlnaError: for an operation without derivatives.
    """
    program = _as_implicit(field)
    order = max(k for _, k in wanted)
    growth = _Growth(program, states, rates, order=order, along=along)
    for k in range(order):
        growth.grow(k, program.kernel.outputs)
    growth.grow(order, [function for function, k in wanted if k == order])
    outputs = [(f"{function}:{k}", function, k) for function, k in wanted]
    orders: set[int] = set()
    while True:
        zeros = [(f"{label}:{k}", label, k) for k in sorted(orders) for label in program.residuals]
        kernel = growth.kernel(f"Lie derivatives of {program.kernel.name}", [*outputs, *zeros])
        used = ancestors(kernel, kernel.results)
        found = {k for k in growth.opened if used.intersection(growth.coefficients(k))}
        if found <= orders:
            break
        orders |= found
    names = [kernel.inputs[index] for k in sorted(orders) for index in growth.coefficients(k)]
    idle = [name for name in kernel.inputs[len(program.given) :] if name not in names]
    return OpenDerivatives(
        kernel=without_inputs(kernel, idle), coefficients=tuple(names), residuals=tuple(label for label, _, _ in zeros)
    )


def _as_implicit(field: Kernel | ImplicitKernel) -> ImplicitKernel:
    return ImplicitKernel(kernel=field, unknowns=(), residuals=()) if isinstance(field, Kernel) else field


def _functions(program: ImplicitKernel, rates: Sequence[str]) -> list[str]:
    others = {*rates, *program.residuals}
    return [name for name in program.kernel.outputs if name not in others]


class _Growth:
    """The series of a program's values, the unknowns found order by order or left open."""

    def __init__(
        self,
        program: ImplicitKernel,
        states: Sequence[str],
        rates: Sequence[str],
        *,
        order: int = -1,
        along: Sequence[str] = (),
    ) -> None:
        """Nothing grown yet; with an `order`, unknowns that depend on `along` become inputs up to it."""
        whole = program.kernel
        self.program = program
        self.results = dict(zip(whole.outputs, whole.results, strict=True))
        place = {name: k for k, name in enumerate(whole.inputs)}
        speeds = {place[s]: self.results[r] for s, r in zip(states, rates, strict=True)}
        self.block = LinearBlock(program)
        open_names = [f"{name}:{k}" for k in range(order + 1) for name in program.unknowns]
        self.inputs = (*program.given, *open_names)
        self.rules = SeriesRules(whole, InstructionList(len(self.inputs)), speeds, self.block.late)
        self.opened: list[int] = []
        self._moved = [name in set(along) for name in program.given] + [True] * len(open_names)

    def coefficients(self, k: int) -> range:
        """The inputs that coefficient k of the unknowns becomes where it is left open."""
        count = len(self.program.unknowns)
        first = len(self.program.given) + k * count
        return range(first, first + count)

    def grow(self, k: int, outputs: Sequence[str]) -> None:
        """Coefficient k of everything the outputs need."""
        whole, rules, block = self.program.kernel, self.rules, self.block
        first = len(whole.inputs)
        values = [self.results[label] for label in outputs]
        needed = ancestors(whole, values)
        implicit = any(index in needed for index in block.inputs)
        if implicit:
            needed |= ancestors(whole, [self.results[label] for label in self.program.residuals])
        positions = [p for p in range(len(whole.instructions)) if first + p in needed]
        for index in range(len(self.program.given)):
            rules.extend_input(index, k)
        for position in positions:
            if position not in block.dependent:
                rules.extend(position, k)
        if not implicit:
            return
        for index in block.inputs:
            rules.series[index].append(None)
        for position in block.positions:
            rules.extend(position, k)
        for index, value in zip(block.inputs, self._found(k), strict=True):
            rules.series[index][k] = value
        for position in block.positions:
            rules.series[first + position].pop()
        for position in positions:
            if position in block.dependent:
                rules.extend(position, k)

    def _found(self, k: int) -> Sequence[int | None]:
        """Coefficient k of the unknowns: solved for, or open where it depends on the inputs chosen."""
        sides = [self.rules.series[self.results[label]][k] for label in self.program.residuals]
        if len(self.inputs) > len(self.program.given) and any(side is not None and self._moves(side) for side in sides):
            self.opened.append(k)
            return self.coefficients(k)
        return self.block.solved(self.rules, k)

    def _moves(self, value: int) -> bool:
        out = self.rules.out
        for instruction in out.instructions[len(self._moved) - out.input_count :]:
            self._moved.append(any(self._moved[operand] for operand in instruction.operands))
        return self._moved[value]

    def kernel(self, name: str, wanted: Sequence[tuple[str, str, int]]) -> Kernel:
        """The kernel of derivatives: (label, output of the program, order)."""
        out = self.rules.out
        results = []
        for _, output, k in wanted:
            whole = self.rules.scaled(self.rules.series[self.results[output]][k], float(factorial(k)))
            results.append(out.constant(0.0) if whole is None else whole)
        instructions, kept = pruned(out.input_count, out.instructions, results)
        labels = tuple(label for label, _, _ in wanted)
        return Kernel(name=name, inputs=self.inputs, outputs=labels, instructions=instructions, results=kept)
