"""The Taylor coefficients of every value of a program, order by order, as instructions.

The recurrences are those of automatic differentiation (Griewank and Walther, Evaluating Derivatives, 2nd ed., chapter
13). What is constant, an unmoved input say, has no higher coefficients and costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

from ulna.base import UlnaError
from ulna.program.arithmetic.rounding import refuse_rounded
from ulna.program.instructions import InstructionList, Operation
from ulna.program.kernel import Kernel

Series = list[int | None]
"""Indices of the coefficients of one value, lowest first; None where a coefficient is zero whatever the inputs."""

_AFFINE = frozenset({Operation.ADD, Operation.SUB, Operation.NEG, Operation.MUL, Operation.DIV})


class SeriesRules:
    """The series of every value of a kernel, grown order by order into one instruction list.

    Attributes:
        field: the program; out: what its coefficients are written into.
        series: for every input and instruction of the program its coefficients so far.
        speeds: for an input that moves, the value of the program that is its derivative.
        late: values whose newest coefficient is found after the others'; sums take it last, so that what is computed
            without it is not computed again with it.
    """

    def __init__(
        self, field: Kernel, out: InstructionList, speeds: Mapping[int, int], late: Collection[int] = ()
    ) -> None:
        self.field = field
        self.out = out
        self.series: list[Series] = [[] for _ in range(len(field.inputs) + len(field.instructions))]
        self.speeds = speeds
        self.late = frozenset(late)
        self._partners: dict[tuple[Operation, int], Series] = {}

    def extend_input(self, index: int, k: int) -> None:
        """Coefficient k of an input: of one that moves from its speed, of one that stays zero beyond the first."""
        if k == 0:
            self.series[index].append(index)
        elif index in self.speeds:
            self.series[index].append(self.scaled(self.series[self.speeds[index]][k - 1], 1.0 / k))
        else:
            self.series[index].append(None)

    def extend(self, position: int, k: int) -> None:
        """Coefficient k of an instruction."""
        instruction = self.field.instructions[position]
        refuse_rounded(self.field.name, instruction)
        operation, operands = instruction.operation, instruction.operands
        own = self.series[len(self.field.inputs) + position]
        if operation is Operation.CONSTANT:
            own.append(self.out.constant(instruction.value) if k == 0 else None)
        elif k == 0:
            own.append(self._lowest(operation, own, operands))
        elif all(coefficient is None for operand in operands for coefficient in self.series[operand][1 : k + 1]):
            own.append(None)
        else:
            own.append(self._rule(operation)(own, operands, k))

    def _lowest(self, operation: Operation, own: Series, operands: tuple[int, ...]) -> int | None:
        """The value itself, and with it the partner that its higher coefficients need."""
        if operation in _AFFINE and any(self.series[operand][0] is None for operand in operands):
            return self._rule(operation)(own, operands, 0)
        firsts = [self._first(self.series[operand]) for operand in operands]
        value = self.out.emit(operation, *firsts)
        if operation in _PARTNER:
            self._partners[operation, operands[0]] = [self.out.emit(_PARTNER[operation][0], *firsts)]
        elif operation in (Operation.TAN, Operation.TANH):
            self._partners[operation, operands[0]] = [self._one_and_square(operation, [value], 0)]
        elif operation in _INVERSE:
            self._partners[operation, operands[0]] = []
        return value

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

    def _squared(self, series: Series, k: int, first: int = 0) -> int | None:
        """Σ s_j s_{k−j}, first ≤ j ≤ k − first, every mixed product once."""
        total: int | None = None
        for j in range(first, (k + 1) // 2):
            total = self._plus(total, self._times(series[j], series[k - j]))
        total = self._plus(total, total)
        middle = series[k // 2] if k % 2 == 0 and k // 2 >= first else None
        return self._plus(total, self._times(middle, middle))

    def _weights(self, argument: int) -> Callable[[int], int | None]:
        """j ↦ j a_j for a value of the program; for an input that moves that is its speed's coefficient."""
        if argument in self.speeds:
            return lambda j: self.series[self.speeds[argument]][j - 1]
        return lambda j: self.scaled(self.series[argument][j], float(j))

    def _slope(
        self,
        weights: Callable[[int], int | None],
        other: Series,
        k: int,
        *,
        last: int | None = None,
        sign: float = 1.0,
    ) -> int | None:
        """± (1/k) Σ j a_j b_{k−j}, 1 ≤ j ≤ last: coefficient k of ± ∫ a' b."""
        total: int | None = None
        for j in range(1, (k if last is None else last) + 1):
            total = self._plus(total, self._times(weights(j), other[k - j]))
        return self.scaled(total, sign / k)

    # ------------------------------------------------------------------------------------------------ rules

    def _rule(self, operation: Operation) -> Callable[[Series, tuple[int, ...], int], int | None]:
        rules: dict[Operation, Callable[[Series, tuple[int, ...], int], int | None]] = {
            Operation.ADD: lambda _, p, k: self._plus(self.series[p[0]][k], self.series[p[1]][k]),
            Operation.SUB: lambda _, p, k: self._minus(self.series[p[0]][k], self.series[p[1]][k]),
            Operation.NEG: lambda _, p, k: self._minus(None, self.series[p[0]][k]),
            Operation.MUL: self._product,
            Operation.DIV: self._quotient,
            Operation.SQRT: self._root,
            Operation.EXP: lambda own, p, k: self._slope(self._weights(p[0]), own, k),
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

    def _product(self, _own: Series, operands: tuple[int, ...], k: int) -> int | None:
        left, right = (self.series[operand] for operand in operands)
        if operands[0] == operands[1]:
            return self._squared(left, k)
        if k == 0:
            return self._times(left[0], right[0])
        ends = [self._times(left[0], right[k]), self._times(left[k], right[0])]
        if operands[1] in self.late:
            ends.reverse()
        middle = self._convolved(left, right, k, first=1, last=k - 1)
        return self._plus(self._plus(middle, ends[0]), ends[1])

    def _quotient(self, own: Series, operands: tuple[int, ...], k: int) -> int | None:
        above, below = (self.series[operand] for operand in operands)
        return self._over(self._minus(above[k], self._convolved(below, own, k, first=1)), self._first(below))

    def _root(self, own: Series, operands: tuple[int, ...], k: int) -> int | None:
        inner = self._squared(own, k, first=1)
        return self._over(self.scaled(self._minus(self.series[operands[0]][k], inner), 0.5), self._first(own))

    def _logarithm(self, own: Series, operands: tuple[int, ...], k: int) -> int | None:
        argument = self.series[operands[0]]
        inner = self._slope(lambda j: self.scaled(own[j], float(j)), argument, k, last=k - 1)
        return self._over(self._minus(argument[k], inner), self._first(argument))

    def _power(self, own: Series, operands: tuple[int, ...], k: int) -> int | None:
        base, exponent = (self.series[operand] for operand in operands)
        if any(coefficient is not None for coefficient in exponent[1 : k + 1]):
            raise UlnaError(
                f"Lie derivatives of '{self.field.name}'", "an exponent varies.", "Write it with exp and log."
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
        weights, partner = self._weights(operand), self._partners[operation, operand]
        partner += [None] * (k - len(partner))
        _, own_sign, partner_sign = _PARTNER[operation]
        value = self._slope(weights, partner, k, sign=own_sign)
        partner.append(self._slope(weights, own, k, sign=partner_sign))
        return value

    def _tangent(self, operation: Operation, own: Series, operand: int, k: int) -> int | None:
        """Tan and tanh: y' = (1 ± y²) a'."""
        partner = self._partners[operation, operand]
        partner += [None] * (k - len(partner))
        value = self._slope(self._weights(operand), partner, k)
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
                inner = self._minus(square[j], self._squared(partner, j, first=1))
                partner.append(self._over(self.scaled(inner, 0.5), self._first(partner)))
        source = self._minus(None, argument[k]) if operation is Operation.ACOS else argument[k]
        inner = self._slope(lambda j: self.scaled(own[j], float(j)), partner, k, last=k - 1)
        return self._over(self._minus(source, inner), self._first(partner))

    def _one_and_square(self, operation: Operation, series: Series, k: int) -> int | None:
        """Coefficient k of 1 + s² (tan, atan) or 1 − s² (tanh, asin, acos)."""
        square = self._squared(series, k)
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
