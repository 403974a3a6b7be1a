"""Taylor coefficients in time of states and outputs along a flow, order by order."""

from __future__ import annotations

from collections.abc import Sequence

from ulna.program.instructions import InstructionList, pruned
from ulna.program.kernel import Kernel
from ulna.program.series import SeriesRules


class FlowSeries:
    """The series x(t) = Σ xₖ tᵏ of the states and y(t) = Σ yₖ tᵏ of the outputs of x' = f(x), y = h(x).

    Args:
        field: outputs the rates of the states, in their order, and the functions h.
        states: (n,) names of the inputs that move; every other input stays constant.
        rates: (n,) names of the outputs that are their derivatives.

    Raises:
        UlnaError: for an operation without derivatives (abs, sign, min, floor, comparisons).
    """

    def __init__(self, field: Kernel, states: Sequence[str], rates: Sequence[str]) -> None:
        self._field = field
        results = dict(zip(field.outputs, field.results, strict=True))
        place = {name: k for k, name in enumerate(field.inputs)}
        speeds = {place[s]: results[r] for s, r in zip(states, rates, strict=True)}
        self._values = {name: place[name] for name in states}
        self._values |= {name: value for name, value in results.items() if name not in set(rates)}
        self._rules = SeriesRules(field, InstructionList(len(field.inputs)), speeds)
        self.order = -1

    @property
    def operations(self) -> int:
        """The number of instructions up to the present order."""
        return len(self._rules.out.instructions)

    def grow(self) -> None:
        """Find the coefficients of the next order."""
        self.order += 1
        for index in range(len(self._field.inputs)):
            self._rules.extend_input(index, self.order)
        for position in range(len(self._field.instructions)):
            self._rules.extend(position, self.order)

    def kernel(self, order: int) -> Kernel:
        """The kernel of the coefficients up to an order: outputs `name:k` for k = 0 … order, states first."""
        out = self._rules.out
        labels, results = [], []
        for name, value in self._values.items():
            for k, coefficient in enumerate(self._rules.series[value][: order + 1]):
                labels.append(f"{name}:{k}")
                results.append(out.constant(0.0) if coefficient is None else coefficient)
        instructions, kept = pruned(out.input_count, out.instructions, results)
        return Kernel(
            name=f"series of {self._field.name}",
            inputs=self._field.inputs,
            outputs=tuple(labels),
            instructions=instructions,
            results=kept,
        )
