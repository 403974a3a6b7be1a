"""From activations to intent: the co-contraction switch, then a speed or a position in proportion."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ulna.base import DesignError
from ulna.sim.references import MotionLimits


@dataclass(frozen=True, slots=True, kw_only=True)
class CoContractionSwitch:
    """Both activations at `level` or above for `hold` seconds turn the hand's function to the next of two.

    It arms again when both have fallen below the level, so that one long effort switches once.
    """

    level: float = 0.4
    hold: float = 0.15

    def __post_init__(self) -> None:
        if not (0 < self.level <= 1 and 0 <= self.hold < math.inf):
            raise DesignError(
                f"a co-contraction switch ({self.level}, {self.hold} s)",
                "expected a level in (0, 1] and a hold of at least 0 s.",
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class IntentMemory:
    """What the switch and the speed remember: samples of co-contraction, armed, the selected function, the position."""

    together: int = 0
    armed: bool = True
    selected: int = 0
    position: float = 0.0


class AbstractProportion(ABC):
    """How the difference of two activations drives the joint."""

    @abstractmethod
    def position(self, difference: np.ndarray, start: float, rate: float, limits: MotionLimits) -> np.ndarray:
        """(N,) positions, rad, from (N,) flexor − extensor in [−1, 1]; `start` is the position before the first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProportionalSpeed(AbstractProportion):
    """Flexion lifts: the angle, down-positive, falls at `speed` rad/s for a full flexor; stops at the range's ends."""

    speed: float

    def position(self, difference: np.ndarray, start: float, rate: float, limits: MotionLimits) -> np.ndarray:
        """The integral of the speed, held inside the range sample by sample."""
        step = -min(self.speed, limits.speed) / rate
        result = np.empty(len(difference))
        here = start
        for k, value in enumerate(difference):
            here = min(max(here + step * float(value), limits.lower), limits.upper)
            result[k] = here
        return result


@dataclass(frozen=True, slots=True, kw_only=True)
class ProportionalPosition(AbstractProportion):
    """The angle is `rest` − `span` · difference; it moves there no faster than the limit of speed."""

    rest: float
    span: float

    def position(self, difference: np.ndarray, start: float, rate: float, limits: MotionLimits) -> np.ndarray:
        """The wanted position, rate-limited, inside the range."""
        step = limits.speed / rate
        result = np.empty(len(difference))
        here = start
        for k, value in enumerate(difference):
            wanted = min(max(self.rest - self.span * float(value), limits.lower), limits.upper)
            here += min(max(wanted - here, -step), step)
            result[k] = here
        return result


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Intent:
    """What the user wants: (N,) position in rad, (N,) function selected (0: elbow, 1: the other one)."""

    position: np.ndarray
    selected: np.ndarray


def read_intent(
    proportion: AbstractProportion,
    activation: np.ndarray,
    memory: IntentMemory,
    *,
    rate: float,
    limits: MotionLimits,
    switch: CoContractionSwitch | None = None,
) -> tuple[Intent, IntentMemory]:
    """Intent of (N, 2) activations (flexor, extensor); the elbow keeps its place while the other function is selected.

    Chunks of any length, with the memory handed on, give the same as the whole.

    Raises:
        DesignError: limits without a finite speed where the position needs one.
    """
    if not math.isfinite(limits.speed):
        raise DesignError("intent", "the limits give no finite speed.")
    selected, after = _switched(activation, memory, switch or CoContractionSwitch(), rate)
    difference = activation[:, 0] - activation[:, 1]
    position = np.empty(len(activation))
    here = memory.position
    for first, last in _stretches(selected):
        if selected[first] == 0:
            position[first:last] = proportion.position(difference[first:last], here, rate, limits)
        else:
            position[first:last] = here
        here = float(position[last - 1])
    return Intent(position=position, selected=selected), replace(after, position=here)


def followable(position: np.ndarray, start: float, rate: float, *, pole: float = 15.0) -> np.ndarray:
    """(4, N) a reference and three derivatives that follow (N,) positions without overshoot: three lags, 1/pole s each.

    Causal; within the range of the positions.
    """
    grow, feed = following_matrices(rate, pole)
    state = np.array([start, 0.0, 0.0])
    rows = np.empty((4, len(position)))
    for k, wanted in enumerate(position):
        rows[:3, k] = state
        rows[3, k] = wanted - state[0] - 3 * state[1] - 3 * state[2]
        state = grow @ state + feed * wanted
    return rows * pole ** np.arange(4.0)[:, None]


def following_matrices(rate: float, pole: float) -> tuple[np.ndarray, np.ndarray]:
    """(3, 3) and (3,) of the three lags from one sample to the next, the k-th derivative over pole^k."""
    from scipy.signal import cont2discrete

    # With time in units of 1/pole the third derivative is p - r - 3 r' - 3 r".
    a, b = pole * np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, -3.0, -3.0]]), np.array([[0.0], [0.0], [pole]])
    grow, feed, *_ = cont2discrete((a, b, np.eye(3), np.zeros((3, 1))), 1 / rate)
    return grow, feed[:, 0]


def _switched(
    activation: np.ndarray, memory: IntentMemory, switch: CoContractionSwitch, rate: float
) -> tuple[np.ndarray, IntentMemory]:
    needed = max(1, math.ceil(switch.hold * rate))
    together, armed, selected = memory.together, memory.armed, memory.selected
    result = np.empty(len(activation), dtype=np.int64)
    for k, (flexor, extensor) in enumerate(activation):
        if flexor >= switch.level and extensor >= switch.level:
            together += 1
        else:
            together = 0
            armed = armed or bool(flexor < switch.level and extensor < switch.level)
        if armed and together >= needed:
            armed, selected = False, 1 - selected
        result[k] = selected
    return result, replace(memory, together=together, armed=armed, selected=selected)


def _stretches(selected: np.ndarray) -> list[tuple[int, int]]:
    """(first, last + 1) of every stretch of equal values."""
    if not len(selected):
        return []
    edges = [0, *(np.flatnonzero(np.diff(selected)) + 1).tolist(), len(selected)]
    return list(pairwise(edges))
