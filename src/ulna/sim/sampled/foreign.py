"""`ForeignStep`: the processor's sample as a function of machine code, in place of the kernels of the step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ulna.base import OptionalDependencyError
from ulna.loop import Fitted, Loop
from ulna.program import Assembly, Kernel


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ForeignStep:
    """A function `void symbol(const double *given, double *told)` that computes one sample of a loop.

    Attributes:
        symbol: a name that no other code has. address: of the function.
        inputs, outputs: slots of the step, in the order of the numbers given and told; the fault is told as 0 or NaN.
        initial: what states of the controller and driven inputs begin with where a run names none of them, by name.
        library: what keeps the code in memory.
    """

    symbol: str
    address: int
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    initial: Mapping[str, float]
    library: Any

    @property
    def results(self) -> range:
        """Every output is a number of its own, as of a kernel."""
        return range(len(self.outputs))

    def link(self) -> None:
        """Make the symbol known to the compiler.

        Raises:
            OptionalDependencyError: without Numba.
        """
        try:
            from llvmlite import binding
        except ImportError:
            raise OptionalDependencyError("a sampled loop", "campaign") from None
        binding.add_symbol(self.symbol, self.address)

    @property
    def declaration(self) -> str:
        """The function in the text of a module."""
        pointer = "numba.types.CPointer(numba.float64)"
        return f'{self.symbol} = numba.types.ExternalFunction("{self.symbol}", numba.void({pointer}, {pointer}))\n\n\n'


class AbstractProcessor(ABC):
    """What computes the processor's samples in place of the simulator; `FixedSteps(processor=...)`."""

    @abstractmethod
    def step_of(self, loop: Loop) -> ForeignStep:
        """The step of a loop.

        Raises:
            UlnaError: where it is of another loop.
        """


def to_the_drive(loop: Fitted) -> Kernel:
    """What the drive gets, of the commands as they stand in the delay line."""
    w, m = Assembly("to the drive"), loop.whole_delay
    outputs = {}
    for k in range(len(loop.wiring.driven)):
        outputs |= {f"late{k}": w.input(f"h{k}_{m}"), f"early{k}": w.input(f"h{k}_{m + loop.split}")}
    return w.finished(outputs)
