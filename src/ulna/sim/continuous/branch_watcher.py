"""What happens where the argument of a root reaches the edge of its domain."""

from __future__ import annotations

import numpy as np

from ulna.program import Branch
from ulna.sim.continuous.course import MOMENT, Course
from ulna.sim.continuous.watcher import Watcher
from ulna.sim.event import EventKind
from ulna.sim.outcome import Outcome

STRAIGHT = 1e-6
"""Changes below this part of a value show its slope."""

AHEAD = 1e-5
"""Part of a run over which the motion along the edge shows whether it stays there."""


class WatchedBranch(Watcher):
    """A root or the like: functions that change sign at its edge, then its distance from the edge, above and below.

    At the edge the field has the root's value there. Where it leads back inside, the motion goes on with the root;
    where it leads along the edge, the root rests until something lifts it off; where it leads outside, the run ends.
    """

    def __init__(self, functions: range, branch: Branch, place: int, name: str) -> None:
        super().__init__(functions)
        self.branch, self.place, self.name = branch, place, name
        self.size = 0.0

    def begin(self, at: Course) -> None:
        """See `Watcher`."""
        at.rests[self.place] = 0.0
        distance = self._distance(at)
        self.size = max(self.size, abs(distance))
        if distance > at.motion.near * self.size:
            self._leave(at)
        elif distance < -at.motion.near * self.size:
            self._end(at, f"{self.name.partition(' reaches')[0].partition(' meets')[0]} is not defined")
        else:
            self._meet(at)

    def at_edge(self, at: Course, function: int) -> bool:
        """See `Watcher`."""
        if at.rests[self.place] or not at.sides[self.functions.start]:
            return function in self.functions and bool(at.rests[self.place])
        distance = self._distance(at)
        self.size = max(self.size, abs(distance))
        return function in self.functions or not distance > at.motion.near * self.size

    def crossed(self, at: Course, function: int) -> None:
        """See `Watcher`."""
        below = self.functions.stop - 1
        if at.rests[self.place] and function == below:
            self._end(at)
            return
        if function not in self.functions:
            at.time += self._left(at)
        self._meet(at)

    def _meet(self, at: Course) -> None:
        """Go on from the edge: inside, along it, or not at all."""
        was, at.rests[self.place] = at.rests[self.place], 1.0
        later = at.moved_on(min(AHEAD * at.span, at.until - at.time))
        distance = self._distance(later)
        if not np.isfinite(later.state).all() or distance < -at.motion.near * self.size:
            self._end(at)
        elif distance > at.motion.near * self.size:
            # The field at the edge leads the first moment; then the root is a number again whose slope is finite.
            moment = at.moment()
            later = at.moved_on(moment)
            at.time, at.state, at.modes[:] = at.time + moment, later.state, later.modes
            at.sides[:] = np.where(np.isin(np.arange(len(at.sides)), _jumps(at)), later.sides, at.sides)
            self._leave(at)
        else:
            *signs, above, below = self.functions
            for function in signs:
                at.sides[function] = 0.0
            at.levels[above], at.levels[below] = at.motion.near * self.size, -at.motion.near * self.size
            at.sides[above], at.sides[below] = -1.0, 1.0
            if not was:
                self._put_on_edge(at)
                at.tell(EventKind.AT_EDGE, self.name, 0.0)

    def _left(self, at: Course) -> float:
        """s until the edge, where rounding had another event happen just before it."""
        function = self.functions.start
        there = at.copied()
        there.rests[self.place] = 0.0
        root, span = there.shown(function), MOMENT * at.span
        if not root > 0.0:
            return 0.0
        rates = there.motion(there, at.time, at.state)[0]
        for _ in range(60):
            there.state = at.state + span * rates
            slope = (there.shown(function) - root) / span
            if abs(slope) * span < STRAIGHT * root:
                return min(-root / slope, at.until - at.time) if slope < 0.0 else 0.0
            span /= 4.0
        return 0.0

    def _put_on_edge(self, at: Course) -> None:
        """Take away what rounding left of the distance from the edge, which a root would not tolerate."""
        distance, there = self._distance(at), at.copied()
        slopes = np.zeros(len(at.state))
        for k, value in enumerate(at.state.tolist()):
            there.state = at.state.copy()
            there.state[k] += STRAIGHT * max(abs(value), self.size)
            slopes[k] = (self._distance(there) - distance) / (there.state[k] - value)
        square = float(slopes @ slopes)
        if square > 0.0 and np.isfinite(square):
            change = -distance * slopes / square
            state = at.state + change
            at.state = np.where(np.abs(state) <= STRAIGHT * np.abs(change), 0.0, state)

    def _leave(self, at: Course) -> None:
        """The root is inside its domain and watched."""
        *signs, above, below = self.functions
        at.rests[self.place] = at.sides[above] = at.sides[below] = 0.0
        for function in signs:
            at.sides[function] = 1.0

    def _end(self, at: Course, name: str = "") -> None:
        at.tell(EventKind.AT_EDGE, name or self.name, 0.0)
        at.outcome = Outcome.EDGE

    def _distance(self, at: Course) -> float:
        return at.value(at.motion.scheme.functions[self.functions.stop - 1])


def _jumps(at: Course) -> list[int]:
    """The event functions of the jumps."""
    branches = sum(branch.signs + 2 for branch in at.motion.scheme.branches)
    last = len(at.sides) - branches
    return list(range(last - at.motion.scheme.moded.guards, last))
