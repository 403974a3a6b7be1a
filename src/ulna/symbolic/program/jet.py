"""Lie derivatives as Taylor coefficients of the flow: no symbolic derivative, a handful of operations per order.

Along x' = f(x) the Taylor coefficients of y = h(x(t)) at t = 0 are L_fᵏ h / k!. They follow from the instructions of f
and h one order after the other by the recurrences of automatic differentiation (Griewank and Walther, Evaluating
Derivatives, 2nd ed., chapter 13). What is constant, an unmoved input say, has no higher coefficients and costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import factorial

from ulna.base import UlnaError
from ulna.symbolic.program.instructions import InstructionList, Operation, pruned
from ulna.symbolic.program.kernel import Kernel

Series = list[int | None]
"""Indices of the coefficients of one value, lowest first; None where a coefficient is zero whatever the inputs."""


def lie_derivatives(field: Kernel, states: Sequence[str], rates: Sequence[str], order: int) -> Kernel:
    """The kernel of L_fᵏ h for every further output h of `field` and k = 0 … order, named `h:k`.

    Args:
        field: outputs the rates of the states, in their order, and the functions h.
        states: (n,) names of the inputs that move; every other input stays constant.
        rates: (n,) names of the outputs that are their derivatives.
        order: the highest k.

    Raises:
        UlnaError: for an operation without derivatives (abs, sign, min, floor, comparisons).
    """
    flow = _Flow(field)
    by_name = dict(zip(field.outputs, field.results, strict=True))
    place = {name: k for k, name in enumerate(field.inputs)}
    functions = [name for name in field.outputs if name not in set(rates)]
    for name in states:
        flow.series[place[name]] = [place[name]]
    for k in range(order + 1):
        for index in range(len(field.inputs)):
            flow.extend_input(index, k, moving=field.inputs[index] in set(states))
        for position in range(len(field.instructions)):
            flow.extend(position, k)
        for state, rate in zip(states, rates, strict=True):
            flow.series[place[state]].append(flow.scaled(flow.series[by_name[rate]][k], 1.0 / (k + 1)))
    outputs, results = [], []
    for name in functions:
        for k, coefficient in enumerate(flow.series[by_name[name]][: order + 1]):
            outputs.append(f"{name}:{k}")
            whole = flow.scaled(coefficient, float(factorial(k)))
            results.append(flow.out.constant(0.0) if whole is None else whole)
    instructions, kept = pruned(len(field.inputs), flow.out.instructions, results)
    return Kernel(
        name=f"Lie derivatives of {field.name}",
        inputs=field.inputs,
        outputs=tuple(outputs),
        instructions=instructions,
        results=kept,
    )


class _Flow:
    """The series of every value of a kernel, grown order by order into one instruction list."""

    def __init__(self, field: Kernel) -> None:
        self.field = field
        self.out = InstructionList(len(field.inputs))
        self.series: list[Series] = [[] for _ in range(len(field.inputs) + len(field.instructions))]
        self._partners: dict[tuple[Operation, int], Series] = {}

    def extend_input(self, index: int, k: int, *, moving: bool) -> None:
        """Coefficient k of an input; those of moving ones come from their rates."""
        if not moving:
            self.series[index].append(index if k == 0 else None)

    def extend(self, position: int, k: int) -> None:
        """Coefficient k of an instruction."""
        instruction = self.field.instructions[position]
        operation, operands = instruction.operation, instruction.operands
        own = self.series[len(self.field.inputs) + position]
        if operation is Operation.CONSTANT:
            own.append(self.out.constant(instruction.value) if k == 0 else None)
        elif k == 0:
            firsts = [self._first(self.series[operand]) for operand in operands]
            own.append(self.out.emit(operation, *firsts))
            if operation in _PARTNER:
                self._partners[operation, operands[0]] = [self.out.emit(_PARTNER[operation][0], *firsts)]
            elif operation in (Operation.TAN, Operation.TANH):
                self._partners[operation, operands[0]] = [self._one_and_square(operation, own, 0)]
            elif operation in _INVERSE:
                self._partners[operation, operands[0]] = []
        elif all(coefficient is None for operand in operands for coefficient in self.series[operand][1 : k + 1]):
            own.append(None)
        else:
            own.append(self._rule(operation)(own, operands, k))

    # ------------------------------------------------------------------------------------------------ arithmetic

    def scaled(self, index: int | None, factor: float) -> int | None:
        """factor · value."""
        return None if index is None else self.out.emit(Operation.MUL, self.out.constant(factor), index)

    def _first(self, series: Series) -> int:
        return self.out.constant(0.0) if series[0] is None else series[0]

    def _plus(self, left: int | None, right: int | None) -> int | None:
        if left is None or right is None:
            return left if right is None else right
        return self.out.emit(Operation.ADD, left, right)

    def _minus(self, left: int | None, right: int | None) -> int | None:
        if right is None:
            return left
        return self.out.emit(Operation.NEG, right) if left is None else self.out.emit(Operation.SUB, left, right)

    def _times(self, left: int | None, right: int | None) -> int | None:
        return None if left is None or right is None else self.out.emit(Operation.MUL, left, right)

    def _over(self, above: int | None, below: int) -> int | None:
        return None if above is None else self.out.emit(Operation.DIV, above, below)

    def _convolved(self, left: Series, right: Series, k: int, first: int = 0, last: int | None = None) -> int | None:
        """Σ left_j right_{k−j}, first ≤ j ≤ last."""
        total: int | None = None
        for j in range(first, (k if last is None else last) + 1):
            total = self._plus(total, self._times(left[j], right[k - j]))
        return total

    def _slope(self, argument: Series, other: Series, k: int, last: int | None = None) -> int | None:
        """(1/k) Σ j a_j b_{k−j}, 1 ≤ j ≤ last: coefficient k of ∫ a' b."""
        total: int | None = None
        for j in range(1, (k if last is None else last) + 1):
            weighted = self.scaled(self._times(argument[j], other[k - j]), j / k)
            total = self._plus(total, weighted)
        return total

    # ------------------------------------------------------------------------------------------------ rules

    def _rule(self, operation: Operation) -> Callable[[Series, tuple[int, ...], int], int | None]:
        rules: dict[Operation, Callable[[Series, tuple[int, ...], int], int | None]] = {
            Operation.ADD: lambda _, p, k: self._plus(self.series[p[0]][k], self.series[p[1]][k]),
            Operation.SUB: lambda _, p, k: self._minus(self.series[p[0]][k], self.series[p[1]][k]),
            Operation.NEG: lambda _, p, k: self._minus(None, self.series[p[0]][k]),
            Operation.MUL: lambda _, p, k: self._convolved(self.series[p[0]], self.series[p[1]], k),
            Operation.DIV: self._quotient,
            Operation.SQRT: self._root,
            Operation.EXP: lambda own, p, k: self._slope(self.series[p[0]], own, k),
            Operation.LOG: self._logarithm,
            Operation.POW: self._power,
        }
        if operation in _PARTNER:
            return lambda own, p, k: self._paired(operation, own, p[0], k)
        if operation in (Operation.TAN, Operation.TANH):
            return lambda own, p, k: self._tangent(operation, own, p[0], k)
        if operation in _INVERSE:
            return lambda own, p, k: self._inverse(operation, own, p[0], k)
        if operation not in rules:
            raise UlnaError(
                f"Lie derivatives of '{self.field.name}'",
                f"'{operation}' has no Taylor series here.",
                "Write the plant with + - * / powers and smooth elementary functions.",
            )
        return rules[operation]

    def _quotient(self, own: Series, operands: tuple[int, ...], k: int) -> int | None:
        above, below = (self.series[operand] for operand in operands)
        return self._over(self._minus(above[k], self._convolved(below, own, k, first=1)), self._first(below))

    def _root(self, own: Series, operands: tuple[int, ...], k: int) -> int | None:
        inner = self._convolved(own, own, k, first=1, last=k - 1)
        return self._over(self.scaled(self._minus(self.series[operands[0]][k], inner), 0.5), self._first(own))

    def _logarithm(self, own: Series, operands: tuple[int, ...], k: int) -> int | None:
        argument = self.series[operands[0]]
        inner = self._slope(own, argument, k, last=k - 1)
        return self._over(self._minus(argument[k], inner), self._first(argument))

    def _power(self, own: Series, operands: tuple[int, ...], k: int) -> int | None:
        base, exponent = (self.series[operand] for operand in operands)
        if any(coefficient is not None for coefficient in exponent[1 : k + 1]):
            raise UlnaError(
                f"Lie derivatives of '{self.field.name}'", "an exponent moves.", "Write it with exp and log."
            )
        total: int | None = None
        for j in range(1, k + 1):
            term = self._times(base[j], own[k - j])
            if term is None:
                continue
            weight = self.out.emit(Operation.MUL, self._first(exponent), self.out.constant(j / k))
            weight = self.out.emit(Operation.SUB, weight, self.out.constant((k - j) / k))
            total = self._plus(total, self._times(weight, term))
        return self._over(total, self._first(base))

    def _paired(self, operation: Operation, own: Series, operand: int, k: int) -> int | None:
        """Coefficient k of sin, cos, sinh or cosh, whose slope is ± its partner; the partner's follows with it."""
        argument, partner = self.series[operand], self._partners[operation, operand]
        partner += [None] * (k - len(partner))
        _, own_sign, partner_sign = _PARTNER[operation]
        value, paired = self._slope(argument, partner, k), self._slope(argument, own, k)
        partner.append(paired if partner_sign > 0 else self._minus(None, paired))
        return value if own_sign > 0 else self._minus(None, value)

    def _tangent(self, operation: Operation, own: Series, operand: int, k: int) -> int | None:
        """Tan and tanh: y' = (1 ± y²) a'."""
        partner = self._partners[operation, operand]
        partner += [None] * (k - len(partner))
        value = self._slope(self.series[operand], partner, k)
        partner.append(self._one_and_square(operation, [*own, value], k))
        return value

    def _inverse(self, operation: Operation, own: Series, operand: int, k: int) -> int | None:
        """Atan, asin and acos: w y' = ± a' with w = 1 + a² or √(1 − a²)."""
        argument, partner = self.series[operand], self._partners[operation, operand]
        square = [self._one_and_square(operation, argument, j) for j in range(k + 1)]
        if operation is Operation.ATAN:
            partner[:] = square
        else:
            partner[:] = [self.out.emit(Operation.SQRT, self._first(square))]
            for j in range(1, k + 1):
                inner = self._minus(square[j], self._convolved(partner, partner, j, first=1, last=j - 1))
                partner.append(self._over(self.scaled(inner, 0.5), self._first(partner)))
        source = self._minus(None, argument[k]) if operation is Operation.ACOS else argument[k]
        return self._over(self._minus(source, self._slope(own, partner, k, last=k - 1)), self._first(partner))

    def _one_and_square(self, operation: Operation, series: Series, k: int) -> int | None:
        """Coefficient k of 1 + s² (tan, atan) or 1 − s² (tanh, asin, acos)."""
        square = self._convolved(series, series, k)
        one = self.out.constant(1.0) if k == 0 else None
        return self._plus(one, square) if operation in (Operation.TAN, Operation.ATAN) else self._minus(one, square)


_INVERSE = frozenset({Operation.ATAN, Operation.ASIN, Operation.ACOS})
_PARTNER = {
    # operation: (partner, sign in own' = ± partner a', sign in partner' = ± own a')
    Operation.SIN: (Operation.COS, 1, -1),
    Operation.COS: (Operation.SIN, -1, 1),
    Operation.SINH: (Operation.COSH, 1, 1),
    Operation.COSH: (Operation.SINH, 1, 1),
}
