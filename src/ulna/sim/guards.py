"""Modes of a system with jumps: found at the start of a stretch, changed at the zeros of their guards."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ulna.symbolic.program.lowering.python_source import to_python
from ulna.symbolic.program.modes import Moded


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Where the inputs of a moded kernel come from; they stand in this order, the modes last.

    Attributes:
        states: (n,) names.
        ramps: inputs that are a + b·t on a stretch.
        time: the name of the time, or None.
        constants: inputs that keep their value on a stretch.
    """

    states: tuple[str, ...]
    ramps: tuple[str, ...] = ()
    time: str | None = None
    constants: tuple[str, ...] = ()

    @property
    def first_mode(self) -> int:
        """Place of the first mode in the vector of run-time values: constants, (a, b) for each ramp, modes."""
        return len(self.constants) + 2 * len(self.ramps)


MOMENT = 1e-7
"""Seconds over which the direction of a guard is looked at after a jump."""


class Guards:
    """The guards of a moded kernel as one function."""

    def __init__(self, moded: Moded, layout: Layout) -> None:
        self.count = moded.guards
        self.layout = layout
        self._evaluate = to_python(moded.kernel)

    def values(self, time: float, state: np.ndarray, values: list[float], modes: list[float]) -> tuple[float, ...]:
        """The guards at a time and state; `values` are constants and ramp coefficients in the layout's order."""
        return self._all(time, state, values, modes)[len(self.layout.states) :]

    def pushes_back(self, guard: int, time: float, state: np.ndarray, values: list[float], modes: list[float]) -> bool:
        """Whether a guard that just changed sign turns round at once: the state slides along the jump."""
        here = self._all(time, state, values, modes)
        count = len(self.layout.states)
        later = state + MOMENT * np.array(here[:count])
        change = self.values(time + MOMENT, later, values, modes)[guard] - here[count + guard]
        return change * modes[guard] < 0.0

    def _all(self, time: float, state: np.ndarray, values: list[float], modes: list[float]) -> tuple[float, ...]:
        layout = self.layout
        constants, pairs = values[: len(layout.constants)], values[len(layout.constants) : layout.first_mode]
        ramps = [pairs[k] + pairs[k + 1] * time for k in range(0, len(pairs), 2)]
        clock = [] if layout.time is None else [time]
        return self._evaluate(*state.tolist(), *ramps, *clock, *constants, *modes)

    def settled(
        self, time: float, state: np.ndarray, values: list[float], modes: list[float], changed: int | None = None
    ) -> list[float]:
        """The modes as the signs of their guards, which may themselves depend on modes.

        Where guard `changed` was just met, its own mode stays as given, and other guards at zero keep theirs.
        """
        for _ in modes:
            shown = self.values(time, state, values, modes)
            found = [
                mode if k == changed or (guard == 0.0 and changed is not None) else float(np.sign(guard))
                for k, (mode, guard) in enumerate(zip(modes, shown, strict=True))
            ]
            if found == modes:
                break
            modes = found
        return modes


class Flip:
    """What heyoka calls at the zero of a guard: its mode takes the sign the guard is about to have.

    The run goes on unless the other side pushes straight back.
    """

    def __init__(self, guards: Guards, index: int) -> None:
        self._guards = guards
        self._index = index

    def __deepcopy__(self, memory: dict[int, Any]) -> Flip:
        """Itself: heyoka copies callbacks, and nothing in this one changes."""
        return self

    def __call__(self, integrator: Any, direction: int) -> bool:
        """Whether the run goes on; `direction` is the sign of the guard's rate."""
        # A guard that only touches zero has no direction and changes nothing.
        if not direction:
            return True
        first = self._guards.layout.first_mode
        modes = integrator.pars[first:].tolist()
        # A mode that no rate uses has no place in the integrator's memory.
        modes += [0.0] * (self._guards.count - len(modes))
        modes[self._index] = float(direction)
        values = integrator.pars[:first].tolist()
        if self._guards.count > 1:
            modes = self._guards.settled(integrator.time, integrator.state, values, modes, self._index)
        integrator.pars[first:] = modes[: len(integrator.pars) - first]
        return not self._guards.pushes_back(self._index, integrator.time, integrator.state, values, modes)
