"""A compiled Taylor integrator that stops at events, lets them happen and goes on."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np

from ulna.program import MODE, REST
from ulna.sim.continuous.course import Course, Motion, Scheme
from ulna.sim.continuous.flow import Stretch, compiled, ended_early, inside, last_good, sources, states_of
from ulna.sim.continuous.taylor import Taylor
from ulna.sim.continuous.yardstick import Yardstick
from ulna.sim.outcome import Outcome


class SwitchedFlow:
    """The flow of a scheme. Hold `lock` while calling: the integrator is one piece of memory.

    heyoka ends a step on the first zero of an event function. It is not trusted with what happens there: its own
    way to go on hides whatever happens shortly after, and a function that is zero at the start of a step hides its
    next zero. So each event ends the integration, and the next begins where every function is positive.
    """

    def __init__(self, scheme: Scheme, settings: Taylor) -> None:
        import heyoka as hy

        self._codes = hy.taylor_outcome
        self.lock = threading.Lock()
        self.motion = Motion(scheme)
        self._scheme = scheme
        self._settings = settings
        self._integrators: dict[tuple[bool, bool], Any] = {}

    def run(
        self, began: Course, initial: np.ndarray, times: np.ndarray, values: list[float], sizes: Yardstick
    ) -> tuple[Course, Stretch]:
        """Where the run stands at the end, and its states at the given times (N ≥ 2); `initial` holds at the first."""
        course, stretch = self._measured(began, initial, times, values, sizes, bounded=False)
        if stretch.outcome is not Outcome.NOT_FINITE and inside(stretch.states, self._settings.bound):
            return course, stretch
        # Only now is the bound worth its cost.
        return self._measured(began, initial, times, values, sizes, bounded=True)

    def _measured(
        self,
        began: Course,
        initial: np.ndarray,
        times: np.ndarray,
        values: list[float],
        sizes: Yardstick,
        *,
        bounded: bool,
    ) -> tuple[Course, Stretch]:
        while True:
            course = began.copied()
            course.divisors = sizes.divisors
            stretch = self._attempted(course, initial, times, values, bounded=bounded)
            if sizes.fits(stretch.states):
                return course, stretch

    def _attempted(
        self, course: Course, initial: np.ndarray, times: np.ndarray, values: list[float], *, bounded: bool
    ) -> Stretch:
        integrator = self._integrator(bounded=bounded, divided=course.divisors is not None)
        states = np.empty((len(times), len(initial)))
        states[0], done = initial, 1
        limit = steps = self._settings.maximum_steps
        # Steps become ever shorter towards a branch point: one looks now and then.
        most = min(APPROACH, limit) if self._scheme.branches else limit
        course.enter(float(times[0]), initial, values, float(times[1]))
        for _ in range(limit):
            while course.outcome is None and done < len(times) and times[done] <= course.time:
                states[done] = course.state
                done += 1
            if course.outcome is not None:
                return _stopped(course, times[:done], states[:done])
            if done == len(times):
                return Stretch(times=times, states=states, outcome=Outcome.FINISHED)
            code, rows, at, last = self._propagated(integrator, course, times[done:], most)
            states[done : done + len(rows)] = rows
            done += len(rows)
            if code == self._codes.time_limit:
                return Stretch(times=times, states=states, outcome=Outcome.FINISHED)
            # heyoka names the event that ended a run by −1 − its place; the bound comes after all others.
            function = -1 - code.value
            known = edge = function in range(len(self._scheme.functions))
            if not known:
                steps -= most
                early = {self._codes.step_limit: Outcome.STEP_LIMIT, self._codes.err_nf_state: Outcome.NOT_FINITE}
                found = early.get(code, Outcome.BLEW_UP)
                edge = found is not Outcome.BLEW_UP and course.at_edge(at, last)
                if not edge and (found is not Outcome.STEP_LIMIT or steps <= 0):
                    course.outcome = found
                    return ended_early(initial, times[:done], states[:done], at, last, found)
            course.time, course.state = at, last
            if known or edge:
                course.react(function, float(times[min(done, len(times) - 1)]))
        course.outcome = Outcome.STEP_LIMIT
        return _stopped(course, times[:done], states[:done])

    def _propagated(
        self, integrator: Any, course: Course, times: np.ndarray, steps: int
    ) -> tuple[Any, np.ndarray, float, np.ndarray]:
        """(heyoka's code, states at the times that were reached, where it ended, the state there)."""
        self._set(integrator, course)
        result = integrator.propagate_grid(np.concatenate(([course.time], times)), max_steps=steps)
        code, rows, at, last = result[0], result[5][1:], float(integrator.time), integrator.state.copy()
        if code == self._codes.err_nf_state:
            self._set(integrator, course)
            at, last = last_good(integrator, float(times[-1]), steps)
            rows = rows[: np.searchsorted(times, at, side="right")]
        if course.divisors is not None:
            rows, last = rows * course.divisors, last * course.divisors
        return code, rows, at, last

    def _set(self, integrator: Any, course: Course) -> None:
        scheme = self._scheme
        integrator.time = course.time
        integrator.state[:] = course.state if course.divisors is None else course.state / course.divisors
        sides = course.sides * course.weights
        # A function that is zero at the start hides its next zero; near a level of some size rounding makes it so.
        sizes = _ROUNDING * np.abs(course.levels)
        shifts = np.where(np.abs(course.distances()) <= sizes, np.maximum(2.0 * sizes, _TINY / course.weights), 0.0)
        levels = course.levels - course.sides * shifts
        given = [*course.values[: scheme.layout.first_mode], *course.saturated, *course.modes, *course.rests]
        given += [*course.contacts, *levels, *sides]
        if course.divisors is not None:
            given += [*course.divisors.tolist(), *(1.0 / course.divisors).tolist()]
        integrator.pars[:] = given[: len(integrator.pars)]
        integrator.reset_cooldowns()

    def _integrator(self, *, bounded: bool, divided: bool) -> Any:
        if (bounded, divided) not in self._integrators:
            self._integrators[bounded, divided] = self._compiled(bounded=bounded, divided=divided)
        return self._integrators[bounded, divided]

    def _compiled(self, *, bounded: bool, divided: bool) -> Any:
        import heyoka as hy

        from ulna.program.lowering.heyoka import to_heyoka

        scheme, layout = self._scheme, self._scheme.layout
        modes = [*layout.saturated, *(f"{MODE}{k}" for k in range(scheme.moded.guards))]
        modes += [f"{REST}{k}" for k in range(len(scheme.branches))]
        first = layout.first_mode
        own = {name: hy.par[first + k] for k, name in enumerate(modes)}
        first += len(modes)
        count, functions = len(scheme.walls), len(scheme.functions)
        variables, known, inverses = states_of(layout, first + count + 2 * functions if divided else None)
        given = to_heyoka(scheme.moded.kernel, sources(layout, known) | own)
        expressions = list(given.values())
        rates, watched = expressions[: len(variables)], expressions[len(variables) :]
        rates = [rate * inverse for rate, inverse in zip(rates, inverses, strict=True)] if divided else rates
        for k, places in enumerate(scheme.walls):
            for place in places:
                rates[place] = hy.select(hy.eq(hy.par[first + k], 0.0), rates[place], 0.0)
        first += count
        events = []
        for k, place in enumerate(scheme.functions):
            level, side = hy.par[first + k], hy.par[first + functions + k]
            # What is not looked at must not be met again and again.
            function = hy.select(hy.eq(side, 0.0), 1.0, side * (watched[place] - level))
            events.append(hy.t_event(function, direction=hy.event_direction.negative))
        return compiled(variables, known, rates, self._settings, bounded=bounded, events=events)


APPROACH = 2000
"""Steps after which a run with branch points is looked at: it may come ever closer to one."""

_ROUNDING = 1e-15
"""How close to its level, as part of it, a value cannot be told from it."""

_TINY = 1e-17
"""How far from zero, in units of its scale, an event function begins that would begin at zero."""


def _stopped(course: Course, times: np.ndarray, states: np.ndarray) -> Stretch:
    """What ended at an event: its time and state stand at the end."""
    if course.time > times[-1]:
        times, states = np.append(times, course.time), np.vstack([states, course.state])
    return Stretch(times=times, states=states, outcome=course.outcome or Outcome.FINISHED)
