"""What happens where the right-hand side jumps: the motion crosses the surface, stays on it or leaves it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ulna.sim.continuous.course import MOMENT, Course
from ulna.sim.continuous.filippov import ways
from ulna.sim.continuous.watcher import Watcher
from ulna.sim.event import EventKind
from ulna.sim.outcome import Outcome

STRAIGHT = 1e-6
"""A state that is left below this part of a correction is zero."""

SLACK = 4e-12
"""How far 1 − λ² may fall below 0 of a stay that begins there."""


class WatchedJumps(Watcher):
    """The guards of the jumps in the right-hand side.

    Their modes are their sides; of a guard that is held at zero 1 − λ² is watched in its place, see `sliding`.

    Args:
        functions: their event functions. names: of the surfaces at which they are zero.
    """

    def __init__(self, functions: range, names: Sequence[str]) -> None:
        super().__init__(functions)
        self.names = names

    def begin(self, at: Course) -> None:
        """See `Watcher`."""
        if not self.functions:
            return
        count, first = len(self.functions), self.functions.start
        before, at.held = at.held, ()
        at.levels[first : first + count] = 0.0
        at.modes[:] = [0.0] * count
        # A guard may itself depend on modes.
        for _ in self.functions:
            found = [float(np.sign(at.shown(k))) for k in self.functions]
            for k in before:
                found[k] = 0.0 if self._near(at, k) else found[k]
            if found == at.modes:
                break
            at.modes[:] = found
        at.sides[first : first + count] = at.modes
        self._decide(at, before, {})

    def crossed(self, at: Course, function: int) -> None:
        """See `Watcher`."""
        first = self.functions.start
        guard, before = function - first, at.held
        if guard in before:
            self._decide(at, before, {guard: 1 if at.level(guard) > 0.0 else -1})
            return
        at.levels[function], side = 0.0, -float(at.sides[function])
        if self._near(at, guard):
            at.sides[function] = 0.0
            self._decide(at, before, {}, {guard: side})
        else:
            # A bounce takes a velocity far from where its sign changes.
            at.sides[function] = at.modes[guard] = float(np.sign(at.shown(function)))

    def decide(self, at: Course) -> None:
        """See `Watcher`."""
        if any(not self._stays(at, guard) for guard in at.held):
            self.begin(at)
        elif not at.sides[self.functions.start : self.functions.stop].all():
            self._decide(at, at.held, {})

    def named(self, function: int) -> str:
        """See `Watcher`."""
        return self.names[function - self.functions.start]

    def jumped(self, at: Course) -> None:
        """See `Watcher`."""
        self.begin(at)

    def _decide(
        self,
        at: Course,
        before: tuple[int, ...],
        leaving: Mapping[int, int],
        towards: Mapping[int, float] | None = None,
    ) -> None:
        """Go on from where some guards are zero: those that were held, and those that have no side."""
        first = self.functions.start
        zero = [k for k in range(len(self.functions)) if k in at.held or not at.sides[first + k]]
        held: list[int] = []
        if zero:
            found = ways(at, zero, leaving)
            if len(found.found) != 1 and (found.found or len(found.neutral) < len(zero)):
                at.tell(EventKind.AMBIGUOUS, " and ".join(self.names[k] for k in zero), 0.0)
                at.outcome = Outcome.AMBIGUOUS
                return
            at.held = ()
            chosen = dict(found.found[0]) if found.found else {}
            held = sorted(k for k, side in chosen.items() if side == 0)
            for guard, side in chosen.items():
                function = first + guard
                at.modes[guard] = at.sides[function] = float(side)
                # Rounding must not have it on the other side.
                at.levels[function] = at.value(at.motion.scheme.functions[function]) if side else 0.0
            for guard in found.neutral:
                function = first + guard
                at.modes[guard] = at.sides[function] = 0.0
                side = (towards or {}).get(guard) or at.side(function)
                at.modes[guard] = at.sides[function] = side
        if held:
            self._put_on(at, held)
            at.held = tuple(held)
            for guard in held:
                function = first + guard
                at.sides[function] = at.weights[function] = 1.0
                # Where one side pushes neither way, rounding must not let go.
                at.levels[function] = -SLACK if at.shown(function) < SLACK else 0.0
        self._tell(at, before)

    def _tell(self, at: Course, before: tuple[int, ...]) -> None:
        for guard in before:
            if guard not in at.held:
                at.tell(EventKind.RELEASED, self.names[guard], at.modes[guard])
        for guard in at.held:
            if guard not in before:
                at.tell(EventKind.HELD, self.names[guard], 0.0)
        if before and before != at.held:
            at.weigh()

    def _stays(self, at: Course, guard: int) -> bool:
        """Whether nothing has taken a guard that is held away from zero."""
        return self._near(replace(at, held=()), guard)

    def _near(self, at: Course, guard: int) -> bool:
        """Whether a guard is zero but for rounding and what a moment changes."""
        function = self.functions.start + guard
        value = abs(at.value(at.motion.scheme.functions[function]))
        if value == 0.0:
            return True
        slopes, drift = at.motion.normals(at)
        largest = float(np.abs(slopes[guard] * at.state).sum())
        rates = np.zeros(len(at.state))
        for side in (-1.0, 1.0):
            there = replace(at, modes=[*at.modes[:guard], side, *at.modes[guard + 1 :]], held=())
            rates = np.maximum(rates, np.abs(at.motion(there, at.time, at.state)[0]))
        speed = float(np.abs(slopes[guard]) @ rates + abs(drift[guard]))
        return bool(value <= 10.0 * at.motion.near * largest + 4.0 * MOMENT * at.span * speed)

    def _put_on(self, at: Course, held: Sequence[int]) -> None:
        """Take away what rounding left of the distance from the surfaces."""
        places = [at.motion.scheme.functions[self.functions.start + k] for k in held]
        values = np.array([at.value(place) for place in places])
        slopes, _ = at.motion.normals(at)
        if values.any():
            change = -np.linalg.lstsq(slopes[list(held)], values, rcond=None)[0]
            if np.isfinite(change).all():
                state = at.state + change
                at.state = np.where(np.abs(state) <= STRAIGHT * np.abs(change), 0.0, state)
