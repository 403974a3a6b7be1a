"""What is looked out for during a run with events, and what happens at it: one class for each kind."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ulna.base import SimulationError
from ulna.program import Branched, Moded
from ulna.sim.continuous.branch_watcher import WatchedBranch
from ulna.sim.continuous.course import REST, Course, Motion, Scheme
from ulna.sim.continuous.crossing import Crossing
from ulna.sim.continuous.jump_watcher import WatchedJumps
from ulna.sim.continuous.layout import Layout
from ulna.sim.continuous.rules import Limit, Rules, Wall
from ulna.sim.continuous.settling import Settling
from ulna.sim.continuous.watcher import Watcher
from ulna.sim.event import Event, EventKind
from ulna.sim.outcome import Outcome

ROUNDING = 1e-15
"""How far behind an end stop a position is met again that rested there, as part of the larger of 1 and the bound."""


LOW = 1e-14
"""A rebound that rises by less than this part of the bound rests."""


def scheme_of(branched: Branched, guards: int, layout: Layout, wanted: Rules | None) -> Scheme:
    """What is compiled for a kernel that shows the values of `Rules.watched`, the guards, then its branches."""
    count = 0 if wanted is None else len(wanted.watched)
    return Scheme(
        moded=Moded(kernel=branched.kernel, guards=guards),
        branches=branched.branches,
        layout=layout,
        walls=() if wanted is None else tuple((wall.position, wall.velocity) for wall in wanted.walls),
        functions=(
            *_places(wanted),
            *range(count, count + guards),
            *_places_of_branches(branched, count + guards),
        ),
    )


def _places_of_branches(branched: Branched, place: int) -> Iterator[int]:
    """For each branch the functions that change sign, then twice its distance from the edge: above and below it."""
    for branch in branched.branches:
        yield from range(place, place + branch.signs)
        yield from (place + branch.signs, place + branch.signs)
        place += branch.signs + 1


def _places(wanted: Rules | None) -> Iterator[int]:
    """For each event function but guards the place of its value among what is watched."""
    if wanted is None:
        return
    place = 0
    for _ in wanted.limits:
        yield from (place, place)
        place += 1
    for _ in wanted.walls:
        yield from (place, place, place + 1)
        place += 2
    for wish in wanted.reported:
        yield from ((place, place) if isinstance(wish, Settling) else (place,))
        place += 1


def new_course(
    motion: Motion, wanted: Rules | None, span: float, surfaces: Sequence[str], names: Sequence[str]
) -> Course:
    """The course of a run that has not begun; names of the surfaces of jumps, and of what happens at each branch."""
    scheme = motion.scheme
    functions = len(scheme.functions)
    free = functions - sum(branch.signs + 2 for branch in scheme.branches) - scheme.moded.guards
    guards = scheme.moded.guards
    surfaces = surfaces if len(surfaces) == guards else ["a jump of the right-hand side"] * guards
    jumps = WatchedJumps(range(free, free + guards), surfaces)
    branches: list[Watcher] = []
    free += scheme.moded.guards
    # Jumps that are decided may leave fewer roots.
    names = names if len(names) == len(scheme.branches) else ["a root reaches 0"] * len(scheme.branches)
    for k, (branch, name) in enumerate(zip(scheme.branches, names, strict=True)):
        branches.append(WatchedBranch(range(free, free + branch.signs + 2), branch, k, name))
        free += branch.signs + 2
    watchers: list[Watcher] = []
    free = 0

    def take(count: int) -> range:
        nonlocal free
        free += count
        return range(free - count, free)

    if wanted is not None:
        watchers += [WatchedLimit(take(2), limit, k) for k, limit in enumerate(wanted.limits)]
        # Commands may jump, and jumps may depend on what is limited.
        watchers = [jumps, *branches, *watchers, jumps]
        watchers += [WatchedWall(take(3), wall, k) for k, wall in enumerate(wanted.walls)]
        for wish in wanted.reported:
            settles = isinstance(wish, Settling)
            watchers.append(WatchedSettling(take(2), wish) if settles else WatchedCrossing(take(1), wish))
    return Course(
        motion=motion,
        span=span,
        state=np.zeros(len(scheme.layout.states)),
        modes=[0.0] * scheme.moded.guards,
        saturated=[0.0] * len(scheme.layout.saturated),
        contacts=[0.0] * len(scheme.walls),
        rests=[0.0] * len(scheme.branches),
        sides=np.zeros(functions),
        levels=np.zeros(functions),
        weights=np.ones(functions),
        watchers=watchers or [jumps, *branches],
    )


class WatchedLimit(Watcher):
    """A saturated input: upper limit, lower limit."""

    def __init__(self, functions: range, limit: Limit, place: int) -> None:
        super().__init__(functions)
        self.limit, self.place = limit, place

    def begin(self, at: Course) -> None:
        """See `Watcher`."""
        upper, lower = self.functions
        bounds = self.limit.bounds
        at.levels[upper], at.levels[lower] = _finite(bounds.upper), _finite(bounds.lower)
        at.sides[upper] = (at.side(upper) or -1.0) if math.isfinite(bounds.upper) else 0.0
        at.sides[lower] = (at.side(lower) or 1.0) if math.isfinite(bounds.lower) else 0.0
        self._decide(at)

    def crossed(self, at: Course, function: int) -> None:
        """See `Watcher`."""
        at.sides[function] = -at.sides[function]
        self._decide(at)

    def _decide(self, at: Course) -> None:
        upper, lower = self.functions
        found, before = float(at.sides[upper] > 0.0) - float(at.sides[lower] < 0.0), at.saturated[self.place]
        at.saturated[self.place] = found
        if before and found != before:
            at.tell(EventKind.SATURATION_LEFT, self.limit.name, before)
        if found and found != before:
            at.tell(EventKind.SATURATION_ENTERED, self.limit.name, found)


class WatchedWall(Watcher):
    """An end stop: upper and lower contact, release."""

    def __init__(self, functions: range, wall: Wall, place: int) -> None:
        super().__init__(functions)
        self.wall, self.place = wall, place

    def begin(self, at: Course) -> None:
        """See `Watcher`."""
        stop, position = self.wall.stop, float(at.state[self.wall.position])
        upper, lower, release = self.functions
        at.levels[upper], at.levels[lower], at.levels[release] = _finite(stop.upper), _finite(stop.lower), 0.0
        if not at.begun and not (stop.lower <= position <= stop.upper):
            raise SimulationError(
                f"initial state with the end stop of '{stop.position}'",
                f"{stop.position} = {position:g} does not lie between {stop.lower:g} and {stop.upper:g}.",
                "Start within the stops.",
            )
        side = at.contacts[self.place]
        if side:
            if side * at.shown(release) < 0.0:
                self._released(at, side)
            return
        self._free(at)
        for function, sign, bound in ((upper, 1.0, stop.upper), (lower, -1.0, stop.lower)):
            if position == bound:
                rate = float(at.motion(at, at.time, at.state)[0][self.wall.position])
                if sign * rate > 0.0 or (rate == 0.0 and sign * at.side(release) > 0.0):
                    self.crossed(at, function)

    def crossed(self, at: Course, function: int) -> None:
        """See `Watcher`."""
        upper, lower, release = self.functions
        if function == release:
            self._released(at, at.contacts[self.place])
            return
        side = 1.0 if function == upper else -1.0
        stop, velocity = self.wall.stop, self.wall.velocity
        at.levels[upper], at.levels[lower] = _finite(stop.upper), _finite(stop.lower)
        at.state[self.wall.position] = self._bound(side)
        at.state[velocity] *= -stop.restitution
        rate = abs(float(at.motion(at, at.time, at.state)[0][self.wall.position]))
        push = side * at.shown(release)
        # Into the wall: a flight takes 2 v / a and rises v² / 2 a, which rounding of the position must not swallow.
        short = 2.0 * rate <= push * REST * at.span
        if push >= 0.0 and (short or rate**2 <= 2.0 * push * LOW * abs(self._bound(side))):
            at.state[velocity] = 0.0
            at.contacts[self.place] = side
            at.sides[upper] = at.sides[lower] = 0.0
            at.sides[release] = side
            at.tell(EventKind.END_STOP_ENTERED, stop.position, side)
        else:
            at.tell(EventKind.BOUNCED, stop.position, side)

    def _bound(self, side: float) -> float:
        return self.wall.stop.upper if side > 0 else self.wall.stop.lower

    def _released(self, at: Course, side: float) -> None:
        at.contacts[self.place] = 0.0
        self._free(at)
        # It leaves with neither speed nor acceleration: rounding alone could put it behind the wall.
        upper, lower, _ = self.functions
        at.levels[upper if side > 0 else lower] += side * ROUNDING * max(1.0, abs(self._bound(side)))
        at.tell(EventKind.END_STOP_LEFT, self.wall.stop.position, side)

    def _free(self, at: Course) -> None:
        upper, lower, release = self.functions
        at.sides[upper] = -1.0 if math.isfinite(self.wall.stop.upper) else 0.0
        at.sides[lower] = 1.0 if math.isfinite(self.wall.stop.lower) else 0.0
        at.sides[release] = 0.0


class WatchedCrossing(Watcher):
    """An event of the user's own."""

    def __init__(self, functions: range, crossing: Crossing) -> None:
        super().__init__(functions)
        self.crossing = crossing

    def begin(self, at: Course) -> None:
        """See `Watcher`."""
        (function,) = self.functions
        before, found = float(at.sides[function]), at.side(function)
        if at.begun and before * found < 0.0:
            self.crossed(at, function)
        else:
            at.sides[function] = found or before

    def crossed(self, at: Course, function: int) -> None:
        """See `Watcher`."""
        side = -float(at.sides[function])
        at.sides[function] = side
        if self.crossing.counts(int(side)):
            at.tell(EventKind.CROSSED, self.crossing.name, side)
            if self.crossing.terminal:
                at.outcome = Outcome.STOPPED

    def decide(self, at: Course) -> None:
        """See `Watcher`."""
        (function,) = self.functions
        if not at.sides[function]:
            at.sides[function] = at.side(function)


class WatchedSettling(Watcher):
    """Both edges of an output's band."""

    def __init__(self, functions: range, settling: Settling) -> None:
        super().__init__(functions)
        self.settling = settling
        self._entered: Event | None = None

    def begin(self, at: Course) -> None:
        """See `Watcher`."""
        high, low = self.functions
        if not at.begun:
            at.levels[high] = at.levels[low] = self.settling.target
            away = at.shown(high)
            at.levels[high] += self.settling.fraction * abs(away)
            at.levels[low] -= self.settling.fraction * abs(away)
            if away == 0.0:
                at.sides[high] = at.sides[low] = 0.0
                return
        elif not at.sides[high]:
            return
        at.sides[high], at.sides[low] = at.side(high) or 1.0, at.side(low) or -1.0
        self._look(at)

    def crossed(self, at: Course, function: int) -> None:
        """See `Watcher`."""
        at.sides[function] = -at.sides[function]
        self._look(at)

    def _look(self, at: Course) -> None:
        high, low = self.functions
        if not (at.sides[high] < 0.0 < at.sides[low]):
            self._entered = None
        elif self._entered is None and at.begun:
            # It came from above or from below.
            away = at.distances()
            direction = -1 if abs(away[high]) < abs(away[low]) else 1
            self._entered = Event(
                time=at.time,
                kind=EventKind.SETTLED,
                signal=self.settling.output,
                direction=direction,
                state=tuple(at.state.tolist()),
            )

    def last(self) -> tuple[Event, ...]:
        """See `Watcher`."""
        return () if self._entered is None else (self._entered,)


def _finite(bound: float) -> float:
    return bound if math.isfinite(bound) else 0.0
