"""A compiled Taylor integrator that stops at events."""

from __future__ import annotations

from typing import Any

import numpy as np

from ulna.program import CONTACT, MODE, REST, SLOPE
from ulna.sim.continuous.course import Course, Scheme
from ulna.sim.continuous.flow import compiled, last_good, sources, states_of
from ulna.sim.continuous.switching import Leg, Switching
from ulna.sim.continuous.taylor import Taylor
from ulna.sim.outcome import Outcome


class SwitchedFlow(Switching):
    """The flow of a scheme by Taylor series.

    heyoka ends a step on the first zero of an event function. It is not trusted with what happens there: its own
    way to go on hides whatever happens shortly after, and a function that is zero at the start of a step hides its
    next zero. So each event ends the integration, and the next begins where every function is positive.
    """

    def __init__(self, scheme: Scheme, settings: Taylor) -> None:
        import heyoka as hy

        super().__init__(scheme, settings.bound, settings.maximum_steps)
        codes = hy.taylor_outcome
        self._outcomes = {
            codes.time_limit: Outcome.FINISHED,
            codes.step_limit: Outcome.STEP_LIMIT,
            codes.err_nf_state: Outcome.NOT_FINITE,
        }
        self._settings = settings
        self._integrators: dict[tuple[bool, bool, tuple[int, ...]], Any] = {}

    @property
    def explicit(self) -> bool:
        """See `Switching`."""
        return True

    def leg(self, course: Course, times: np.ndarray, steps: int, *, bounded: bool) -> Leg:
        """See `Switching`."""
        integrator = self._integrator(course, bounded=bounded)
        self._set(integrator, course)
        result = integrator.propagate_grid(np.concatenate(([course.time], times)), max_steps=steps)
        code, rows, at, last = result[0], result[5][1:], float(integrator.time), integrator.state.copy()
        # heyoka names the event that ended a run by −1 − its place; the bound comes after all others.
        event = -1 - code.value
        outcome = self._outcomes.get(code, Outcome.BLEW_UP)
        if outcome is Outcome.NOT_FINITE:
            self._set(integrator, course)
            at, last = last_good(integrator, float(times[-1]), steps)
            rows = rows[: np.searchsorted(times, at, side="right")]
        if course.divisors is not None:
            rows, last = rows * course.divisors, last * course.divisors
        known = event in range(len(self.scheme.functions))
        return Leg(event=event if known else None, outcome=outcome, rows=rows, time=at, state=last)

    def _set(self, integrator: Any, course: Course) -> None:
        scheme = self.scheme
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

    def _integrator(self, course: Course, *, bounded: bool) -> Any:
        key = (bounded, course.divisors is not None, course.held)
        if key not in self._integrators:
            self._integrators[key] = self._compiled(course.held, bounded=bounded, divided=key[1])
        return self._integrators[key]

    def _compiled(self, held: tuple[int, ...], *, bounded: bool, divided: bool) -> Any:
        import heyoka as hy

        from ulna.program.lowering.heyoka import to_heyoka

        scheme, layout = self.scheme, self.scheme.layout
        modes = [*layout.saturated, *(f"{MODE}{k}" for k in range(scheme.moded.guards))]
        modes += [f"{REST}{k}" for k in range(len(scheme.branches))]
        first = layout.first_mode
        own = {name: hy.par[first + k] for k, name in enumerate(modes)}
        first += len(modes)
        count, functions = len(scheme.walls), len(scheme.functions)
        variables, known, inverses = states_of(layout, first + count + 2 * functions if divided else None)
        own |= {f"{CONTACT}{k}": hy.par[first + k] for k in range(count)}
        own |= {f"{SLOPE}{k}": hy.par[len(layout.constants) + 2 * k + 1] for k in range(len(layout.ramps))}
        given = to_heyoka(self.motion.form(held).kernel, sources(layout, known) | own)
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


_ROUNDING = 1e-15
"""How close to its level, as part of it, a value cannot be told from it."""

_TINY = 1e-17
"""How far from zero, in units of its scale, an event function begins that would begin at zero."""
