"""`Layout`: where a compiled flow finds what its kernel asks for."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Where the inputs of a kernel come from; they stand in this order, the modes of its jumps last.

    Attributes:
        states: (n,) names.
        ramps: inputs that are a + b·t on a stretch.
        time: the name of the time, or None.
        saturated: names of what says whether an input stands at a limit (−1, 0 or 1).
        constants: inputs that keep their value on a stretch.
    """

    states: tuple[str, ...]
    ramps: tuple[str, ...] = ()
    time: str | None = None
    saturated: tuple[str, ...] = ()
    constants: tuple[str, ...] = ()

    @property
    def first_mode(self) -> int:
        """Place of the first mode in the vector of run-time values: constants, (a, b) for each ramp, modes."""
        return len(self.constants) + 2 * len(self.ramps)

    def slopes(self, values: list[float]) -> list[float]:
        """How fast each ramp grows."""
        return values[len(self.constants) + 1 : self.first_mode : 2]

    def arguments(
        self, time: float, state: list[float], values: list[float], saturated: list[float], modes: list[float]
    ) -> list[float]:
        """The kernel's inputs in its order at a time and a state; `values` are constants and ramp coefficients."""
        count = len(self.constants)
        pairs = values[count : self.first_mode]
        ramps = [pairs[k] + pairs[k + 1] * time for k in range(0, len(pairs), 2)]
        clock = [] if self.time is None else [time]
        return [*state, *ramps, *clock, *saturated, *values[:count], *modes]
