"""`Course`: where a run with events stands: state, modes, contacts, and on which side of zero each watched value is."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ulna.program import GUARD, Branch, Kernel, Moded, Moving, add_up, restricted, sliding, tangents, to_python
from ulna.sim.continuous.layout import Layout
from ulna.sim.continuous.stiffness import Stiffness
from ulna.sim.event import Event, EventKind
from ulna.sim.outcome import Outcome

MOMENT = 1e-10
"""Part of a run that passes by hand after an event, so that no watched value is at zero when integration goes on."""

PROBES = (1e-10, 1e-6, 1e-4)
"""Parts of a run over which a value that starts at zero shows where it goes, one after the other until it does."""

REST = 1e-9
"""Part of a run: a rebound that would fly for less than this rests."""

SMALLEST = 1e-290
"""Event functions below this are not scaled."""

BEND, FINE_BEND = 1e-6, 1e-10
"""By how much a short way may bend, as part of the state, where it is gone by Heun and where by Euler."""

NEAR, ROUGHLY_NEAR = 1e-13, 1e-6
"""Distances from the edge of a function's domain below this part of the largest one are at it, of an engine exact to
rounding and of one to its tolerance."""

CHATTER = 100
"""Changes at one instant after which nothing moves any more."""

PILE, PILE_TIME = 12, 1e-8
"""So many events within so small a part of a run pile up without end."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scheme:
    """What a flow with events is compiled from.

    Attributes:
        moded: inputs → rates, watched values, guards. layout: where its inputs come from.
        walls: (position, velocity) of each end stop, places among the states.
        functions: (F,) for each event function the place of its value among watched values, guards and what branches
            show. It is side · weight · (value − level), all three at run time: positive until the event.
        branches: roots and the like that may rest at the edge of their domain.
    """

    moded: Moded
    layout: Layout
    walls: tuple[tuple[int, int], ...]
    functions: tuple[int, ...]
    branches: tuple[Branch, ...] = ()


class Form:
    """The kernel of a motion that holds some guards at zero, and what is made of it."""

    def __init__(self, kernel: Kernel, layout: Layout) -> None:
        self.kernel = kernel
        self.stiffness = Stiffness(kernel, layout)
        self.evaluate: Callable[..., tuple[float, ...]] = to_python(kernel)


class Motion:
    """The kernel of a scheme in Python: rates and watched values at one instant.

    Args:
        scheme: what moves. explicit: whether short spans are short beside its fastest decay. exact: whether states
            are known to rounding.
    """

    def __init__(self, scheme: Scheme, *, explicit: bool, exact: bool) -> None:
        self.scheme = scheme
        self.bend = BEND if explicit else FINE_BEND
        self.near = NEAR if exact else ROUGHLY_NEAR
        self._explicit = explicit
        self._count = len(scheme.layout.states)
        self._forms: dict[tuple[int, ...], Form] = {(): Form(scheme.moded.kernel, scheme.layout)}
        self._adding: dict[tuple[int, ...], bool] = {}
        layout = scheme.layout
        self._moving = Moving(states=layout.states, ramps=layout.ramps, time=layout.time, walls=scheme.walls)

    def __call__(self, at: Course, time: float, state: np.ndarray) -> tuple[np.ndarray, tuple[float, ...]]:
        """((n,) rates as they are with the walls, watched values and guards; of what is held its level, at the end)."""
        found = self.form(at.held).evaluate(*self.arguments(at, time, state))
        rates = np.array(found[: self._count])
        for contact, (position, velocity) in zip(at.contacts, self.scheme.walls, strict=True):
            if contact:
                rates[position] = rates[velocity] = 0.0
        return rates, found[self._count :]

    def form(self, held: tuple[int, ...]) -> Form:
        """The motion along the surfaces of some guards; made when it is first met."""
        if held not in self._forms:
            kernel = sliding(self.scheme.moded.kernel, held, self._moving)
            self._forms[held] = Form(kernel, self.scheme.layout)
        return self._forms[held]

    def arguments(self, at: Course, time: float, state: np.ndarray) -> list[float]:
        """The inputs of the kernel."""
        modes = [*at.modes, *at.rests]
        if at.held:
            modes += [*at.contacts, *self.scheme.layout.slopes(at.values)]
        return self.scheme.layout.arguments(time, state.tolist(), at.values, at.saturated, modes)

    def slopes(self, at: Course, time: float, state: np.ndarray) -> np.ndarray | None:
        """(n, n) ∂rate/∂state as it is with the walls; None where it is not known or not asked for."""
        found = None if self._explicit else self.form(at.held).stiffness.slopes(self.arguments(at, time, state))
        if found is None:
            return None
        for contact, places in zip(at.contacts, self.scheme.walls, strict=True):
            if contact:
                found[list(places)] = 0.0
        return found

    @cached_property
    def _normals(self) -> Callable[..., tuple[float, ...]]:
        guards = [f"{GUARD}{k}" for k in range(self.scheme.moded.guards)]
        layout = self.scheme.layout
        names = [*layout.states, *layout.ramps, *([] if layout.time is None else [layout.time])]
        return to_python(tangents(restricted(self.scheme.moded.kernel, guards), names, piecewise=True))

    def normals(self, at: Course) -> tuple[np.ndarray, np.ndarray]:
        """((guards, n) slopes of the guards along the states, (guards,) their rates while the states stand still)."""
        layout, guards = self.scheme.layout, self.scheme.moded.guards
        arguments = self.arguments(replace(at, held=()), at.time, at.state)
        found = np.array(self._normals(*arguments)).reshape(-1, guards).T
        drift = [*layout.slopes(at.values), *([] if layout.time is None else [1.0])]
        return found[:, : self._count], found[:, self._count :] @ np.array(drift)

    def add_up(self, guards: tuple[int, ...]) -> bool:
        """Whether the jumps at some guards contribute to the rates one by one."""
        if guards not in self._adding:
            kernel = self.scheme.moded.kernel
            self._adding[guards] = add_up(kernel, guards, kernel.outputs[: self._count])
        return self._adding[guards]

    def moved(self, at: Course, span: float, steps: int = 1) -> np.ndarray:
        """(n,) state a short span later: steps of Heun, where the system is stiff linearly implicit ones of Euler."""
        step, state = span / steps, at.state
        for k in range(steps):
            time = at.time + k * step
            here, _ = self(at, time, state)
            slopes = self.slopes(at, time, state)
            if slopes is not None and np.isfinite(slopes).all():
                state = state + np.linalg.solve(np.eye(len(state)) - step * slopes, step * here)
                continue
            there, _ = self(at, time + step, state + step * here)
            state = state + 0.5 * step * (here + there)
        return state


@dataclass(slots=True, kw_only=True)
class Course:
    """Where a run stands. Everything in it changes.

    Attributes:
        span: s, length of the whole run. values: constants and ramp coefficients of the stretch.
        until: s, beyond which nothing is known yet. modes: of guards. held: guards that stay at zero. rests: of
            branches, 1 at the edge. saturated: of limits. contacts: of walls (−1 at the lower stop, 1 at the upper).
        sides: (F,) of each event function: sign of value − level, 0 where it is not looked at. levels, weights: (F,).
        reactions: when events were found. events: what happened. outcome: how it ended, None while it goes on.
        divisors: (n,) of the states, see `Yardstick`.
    """

    motion: Motion
    span: float
    time: float = 0.0
    state: np.ndarray
    values: list[float] = field(default_factory=list)
    modes: list[float]
    saturated: list[float]
    contacts: list[float]
    rests: list[float]
    held: tuple[int, ...] = ()
    until: float = 0.0
    sides: np.ndarray
    levels: np.ndarray
    weights: np.ndarray
    events: list[Event] = field(default_factory=list)
    outcome: Outcome | None = None
    watchers: Sequence[Any] = ()
    reactions: list[float] = field(default_factory=list)
    begun: bool = False
    divisors: np.ndarray | None = None

    def shown(self, function: int) -> float:
        """Value − level of an event function."""
        return self.value(self.motion.scheme.functions[function]) - float(self.levels[function])

    def value(self, place: int) -> float:
        """One of the values that the motion shows besides the rates."""
        return self.motion(self, self.time, self.state)[1][place]

    def level(self, guard: int) -> float:
        """Where between the two sides of its surface the jump of a guard stands that is held: λ of `sliding`."""
        return self.motion(self, self.time, self.state)[1][self.held.index(guard) - len(self.held)]

    def distances(self, state: np.ndarray | None = None, time: float | None = None) -> np.ndarray:
        """(F,) value − level of every event function, here or at another state."""
        watched = self.motion(self, self.time if time is None else time, self.state if state is None else state)[1]
        return np.array([watched[k] for k in self.motion.scheme.functions]) - self.levels

    def side(self, function: int) -> float:
        """Sign of value − level; of a value that is zero the sign that it has a moment later."""
        found = _sign(self.shown(function))
        for part in PROBES:
            if found:
                break
            later = part * self.span
            found = _sign(float(self.distances(self.motion.moved(self, later, 8), self.time + later)[function]))
        return found

    def tell(self, kind: EventKind, signal: str, direction: float) -> None:
        """Keep an event that happens here and now."""
        state = tuple(self.state.tolist())
        self.events.append(Event(time=self.time, kind=kind, signal=signal, direction=int(direction), state=state))

    def copied(self) -> Course:
        """One that goes its own way."""
        return replace(
            self,
            state=self.state.copy(),
            modes=list(self.modes),
            saturated=list(self.saturated),
            contacts=list(self.contacts),
            rests=list(self.rests),
            sides=self.sides.copy(),
            levels=self.levels.copy(),
            weights=self.weights.copy(),
            events=list(self.events),
            reactions=list(self.reactions),
            watchers=[copy(watcher) for watcher in self.watchers],
        )

    def enter(self, time: float, state: np.ndarray, values: list[float], until: float) -> None:
        """Begin a stretch: modes, sides and contacts as inputs and state ask for."""
        self.time, self.state, self.values, self.until = time, np.array(state, dtype=float), values, until
        for watcher in self.watchers:
            watcher.begin(self)
        self.begun = True
        self.weigh()
        self.settle(until)

    def weigh(self) -> None:
        """Scale the event functions to 1: heyoka sizes its steps by them as well as by the states."""
        here = np.abs(self.distances())
        rates, _ = self.motion(self, self.time, self.state)
        later = MOMENT * self.span
        change = np.abs(self.distances(self.state + later * rates, self.time + later) - self.distances()) / later
        # States of sizes near 1 leave small functions as they are; of other sizes nothing is known.
        least = 1.0 if self.divisors is None else 0.0
        largest = np.maximum(least, np.maximum(here, change))
        good = np.isfinite(largest) & (largest > SMALLEST)
        self.weights[:] = np.where(good, 1.0 / np.where(good, largest, 1.0), 1.0)

    def at_edge(self, time: float, state: np.ndarray) -> bool:
        """Whether some watcher sees the edge of its domain there."""
        there = replace(self, time=time, state=state)
        return any(watcher.at_edge(there, -1) for watcher in self.watchers)

    def react(self, function: int, until: float) -> None:
        """Let an event happen that was found here, unless the value only touches its level, and go on from it."""
        self.until = until
        self.reactions.append(self.time)
        if len(self.reactions) > PILE and self.time - self.reactions[-1 - PILE] < PILE_TIME * self.span:
            self._piled_up(function)
            return
        edge = next((watcher for watcher in self.watchers if watcher.at_edge(self, function)), None)
        if edge is not None:
            edge.crossed(self, function)
        else:
            moment = self.moment()
            later = self.motion.moved(self, moment)
            if not self.distances(later, self.time + moment)[function] * self.sides[function] > 0.0:
                self._happen(function)
        self.settle(until)

    def settle(self, until: float) -> None:
        """Move a moment on, not beyond a time; whatever is on the wrong side then happens now."""
        self.until = until
        if not len(self.sides):
            return
        function = 0
        for _ in range(CHATTER):
            if self.outcome is not None:
                return
            here, moment = self.time, self.moment()
            later = self.motion.moved(self, moment)
            if not np.isfinite(later).all():
                # The integrator itself shall find out how far it comes.
                return
            wrong = np.flatnonzero(self.sides * self.distances(later, here + moment) < 0.0)
            if not len(wrong):
                self.time, self.state = (until if moment == until - here else here + moment), later
                for watcher in self.watchers:
                    watcher.decide(self)
                return
            function = int(wrong[0])
            self._happen(function)
        self._piled_up(function)

    def _piled_up(self, function: int) -> None:
        watcher = next((each for each in self.watchers if function in each.functions), None)
        self.tell(EventKind.ZENO, "" if watcher is None else watcher.named(function), 0.0)
        self.outcome = Outcome.ZENO

    def moment(self) -> float:
        """A short span, s, over which the motion is straight and that ends before what is known to happen next."""
        least = 16.0 * math.ulp(self.time)
        span = max(MOMENT * self.span, least)
        here, _ = self.motion(self, self.time, self.state)
        while span > least:
            there, _ = self.motion(self, self.time + span, self.state + span * here)
            bend, way = 0.5 * span * np.abs(there - here).max(), np.abs(self.state).max() + span * np.abs(here).max()
            if not bend > self.motion.bend * way:
                break
            span = max(span / 16.0, least)
        return min(span, self.until - self.time)

    def moved_on(self, span: float) -> Course:
        """Another course a short span later, its jumps decided by where it is then."""
        later = self.copied()
        later.state, later.time = self.motion.moved(self, span, 8), self.time + span
        for watcher in later.watchers:
            watcher.jumped(later)
        return later

    def _happen(self, function: int) -> None:
        next(watcher for watcher in self.watchers if function in watcher.functions).crossed(self, function)

    def finished(self, outcome: Outcome) -> tuple[Event, ...]:
        """What happened during the run, in order of time, once it is over."""
        last = [event for watcher in self.watchers for event in watcher.last()] if outcome is Outcome.FINISHED else []
        return tuple(sorted((*self.events, *last), key=lambda event: event.time))


def _sign(value: float) -> float:
    # A NaN is on no side.
    return float(value > 0.0) - float(value < 0.0)
