"""What a generated loop is made of: sizes, switches, and the names of its numbers."""

from __future__ import annotations

from dataclasses import dataclass

from ulna.sim.sampled.discretisation import Discretisation
from ulna.sim.sampled.wiring import Wiring


@dataclass(frozen=True, slots=True, kw_only=True)
class EndStopPlace:
    """Places of a wall's two states."""

    position: int
    velocity: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Everything that shapes the source; numbers that only fill it are in `values`.

    Attributes:
        wiring: kernels and names.
        discretisation: of the controller.
        plant_steps: per stretch of constant input. plant_order: of the steps. rippled: pulses are averaged to second
            order.
        whole_delay: periods. split: whether the input changes within the period.
        saturated, slewed: per driven input. quantised, noisy: per measured value. bridged: per driven input.
        switched: per driven input, the plant gets pulses.
        frozen: places in the memory of integrals under anti-windup.
        end_stops: walls. jittered, missing: of the clock. ramps: other inputs that change within a period.
    """

    wiring: Wiring
    discretisation: Discretisation
    plant_steps: int
    plant_order: int
    whole_delay: int
    split: bool
    saturated: tuple[bool, ...]
    slewed: tuple[bool, ...]
    quantised: tuple[bool, ...]
    noisy: tuple[bool, ...]
    bridged: tuple[bool, ...]
    switched: tuple[bool, ...]
    rippled: bool
    frozen: tuple[int, ...]
    end_stops: tuple[EndStopPlace, ...]
    jittered: bool
    missing: bool
    ramps: bool

    @property
    def states(self) -> int:
        """n of the plant."""
        return sum(label.startswith("x'") for label in self.wiring.plant.main.outputs)

    @property
    def pulsed(self) -> bool:
        """Whether the plant gets the pulses of an input."""
        return any(self.switched)

    @property
    def outputs(self) -> int:
        """p of the plant."""
        return sum(label.startswith("o") for label in self.wiring.plant.main.outputs)

    @property
    def memory(self) -> int:
        """States of estimator and controller."""
        return len(self.wiring.memory)

    @property
    def channels(self) -> int:
        """Random streams of a loop: two for each measured value, one for jitter, one for missed samples."""
        return 2 * len(self.wiring.measured) + 2

    def columns(self) -> dict[str, int]:
        """Place of each number that is recorded at a sample: slot name → row of the record; nothing twice."""
        wiring = self.wiring
        shown = {s.name for s in wiring.estimates}
        names = ["time", *(f"x{k}" for k in range(self.states))]
        names += [f"z{k}" for k, s in enumerate(wiring.memory) if s.name not in shown]
        names += [f"yn{k}" for k in range(len(wiring.measured))]
        names += [f"e{k}" for k in range(len(wiring.estimates))]
        for k in range(len(wiring.driven)):
            names += [f"c{k}", f"h{k}_0"]
            names += [f"ua{k}"] if self.split else []
            names += [f"ub{k}"] if self.whole_delay or self.split or self.bridged[k] else []
        names += [f"hit{k}" for k in range(len(self.end_stops))]
        return {name: row for row, name in enumerate(names)}

    def results(self) -> dict[str, int]:
        """Place of each number that is handed back at the end of a run: slot name → column."""
        names = ["code", "end", *(f"x{k}" for k in range(self.states))]
        for k in range(len(self.wiring.driven)):
            names += [f"peak{k}", f"square{k}"]
        for k in range(self.outputs):
            names += [f"last{k}", f"first{k}", f"least{k}", f"most{k}", f"outside{k}", f"settled{k}"]
        return {name: column for column, name in enumerate(names)}
