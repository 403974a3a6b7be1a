"""A compiled Taylor integrator for one kernel without jumps: run from an initial state, with blow-up found."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any

import numpy as np

from ulna.program import Kernel
from ulna.sim.continuous.layout import Layout
from ulna.sim.continuous.stiffness import APPROACH, Stiffness
from ulna.sim.continuous.taylor import Taylor
from ulna.sim.continuous.yardstick import PARTS, Yardstick
from ulna.sim.outcome import Outcome

MANY = 20_000
"""Steps between later looks at a run."""

COMPACT_ABOVE = 12
"""Number of states above which straight code takes longer to compile than it is worth."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """What came of a run. times: (N,), states: (N, n), both up to where it ended. stiff: it ended for being stiff."""

    times: np.ndarray
    states: np.ndarray
    outcome: Outcome
    stiff: bool = False


class Flow:
    """The compiled flow of a kernel whose outputs are the rates of the n states.

    Hold `lock` while calling: the integrator is one piece of memory.

    Args:
        kernel: one without jumps.
        layout: where its inputs come from.
        settings: tolerance, bound and compilation.
    """

    def __init__(self, kernel: Kernel, layout: Layout, settings: Taylor) -> None:
        import heyoka as hy  # 0.4 s: only when something is integrated

        self._codes = hy.taylor_outcome
        self._reached = hy.taylor_outcome.time_limit
        self.lock = threading.Lock()
        self._kernel = kernel
        self._layout = layout
        self._settings = settings
        self._stiffness = Stiffness(kernel, layout)
        self._plain = self._compiled(bounded=False, divided=False)
        self._others: dict[tuple[bool, bool], Any] = {}
        # Views into the integrator's memory: asking for them anew costs as much as a step.
        self._state = self._plain.state
        self._values = self._plain.pars
        self._value_count = len(self._plain.pars)

    def final(self, initial: np.ndarray, start: float, end: float, values: list[float]) -> np.ndarray | None:
        """(n,) state at `end`, the fast way; None where `run` is needed: an early end, states of uneven sizes."""
        integrator = self._plain
        integrator.time = start
        self._state[:] = initial
        if self._value_count:
            self._values[:] = values[: self._value_count]
        grid = start + (end - start) * PARTS
        grid[-1] = end
        result = integrator.propagate_grid(grid, max_steps=min(MANY, self._settings.maximum_steps))
        states = result[5]
        if result[0] != self._reached or not inside(states[-1], self._settings.bound):
            return None
        return states[-1] if Yardstick().fits(states) else None

    def run(self, initial: np.ndarray, times: np.ndarray, values: list[float], sizes: Yardstick) -> Stretch:
        """The states at the given times (N ≥ 2); `initial` holds at the first. `sizes` are taken in and used."""
        stretch = self._measured(initial, times, values, sizes, bounded=False)
        if stretch.stiff or (
            stretch.outcome is not Outcome.NOT_FINITE and inside(stretch.states, self._settings.bound)
        ):
            return stretch
        # Only now is the event worth its cost: it slows every step and doubles the time to compile.
        return self._measured(initial, times, values, sizes, bounded=True)

    def _measured(
        self, initial: np.ndarray, times: np.ndarray, values: list[float], sizes: Yardstick, *, bounded: bool
    ) -> Stretch:
        while True:
            stretch = self._attempted(initial, times, values, sizes.divisors, bounded=bounded)
            if stretch.outcome is Outcome.STEP_LIMIT or sizes.fits(stretch.states):
                return stretch

    def _attempted(
        self,
        initial: np.ndarray,
        times: np.ndarray,
        values: list[float],
        divisors: np.ndarray | None,
        *,
        bounded: bool,
    ) -> Stretch:
        integrator = self._integrator(bounded=bounded, divided=divisors is not None)
        integrator.time = float(times[0])
        integrator.state[:] = initial if divisors is None else initial / divisors
        given = values
        if divisors is not None:
            given = [*values, *divisors.tolist(), *(1.0 / divisors).tolist()]
        # A value that no rate uses has no place in the integrator's memory.
        integrator.pars[:] = given[: len(integrator.pars)]
        if integrator.with_events:
            integrator.reset_cooldowns()
        code, states, stiff = self._propagated(integrator, times, values, divisors)
        last = integrator.state
        if divisors is not None:
            states, last = states * divisors, last * divisors
        if code == self._reached:
            return Stretch(times=times, states=states, outcome=Outcome.FINISHED)
        outcomes = {self._codes.step_limit: Outcome.STEP_LIMIT, self._codes.err_nf_state: Outcome.NOT_FINITE}
        at = float(integrator.time)
        if code == self._codes.err_nf_state:
            integrator.time = float(times[0])
            integrator.state[:] = initial if divisors is None else initial / divisors
            at, last = last_good(integrator, float(times[-1]), self._settings.maximum_steps)
            last = last if divisors is None else last * divisors
        return ended_early(initial, times, states, at, last, outcomes.get(code, Outcome.BLEW_UP), stiff=stiff)

    def _propagated(
        self, integrator: Any, times: np.ndarray, values: list[float], divisors: np.ndarray | None
    ) -> tuple[Any, np.ndarray, bool]:
        """(heyoka's code, states at the times that were reached, whether it was given up for being stiff)."""
        left, states, grid = self._settings.maximum_steps, [], times
        while True:
            steps, began = min(left, APPROACH if not states else MANY), float(grid[0])
            result = integrator.propagate_grid(grid, max_steps=steps)
            code, rows = result[0], result[5] if not states else result[5][1:]
            states.append(rows)
            left -= steps
            at, end = float(integrator.time), float(times[-1])
            if code != self._codes.step_limit:
                break
            state = integrator.state if divisors is None else integrator.state * divisors
            arguments = self._layout.arguments(at, state.tolist(), values, [], [])
            if self._stiffness.holds(arguments, (at - began) / steps, end - at, left):
                return code, np.concatenate(states), True
            if left <= 0:
                break
            grid = np.concatenate(([at], grid[len(rows) + bool(len(states) > 1) :]))
        return code, states[0] if len(states) == 1 else np.concatenate(states), False

    def _integrator(self, *, bounded: bool, divided: bool) -> Any:
        if not (bounded or divided):
            return self._plain
        if (bounded, divided) not in self._others:
            self._others[bounded, divided] = self._compiled(bounded=bounded, divided=divided)
        return self._others[bounded, divided]

    def _compiled(self, *, bounded: bool, divided: bool) -> Any:
        from ulna.program.lowering.heyoka import to_heyoka

        variables, states, inverses = states_of(self._layout, self._layout.first_mode if divided else None)
        rates = list(to_heyoka(self._kernel, sources(self._layout, states)).values())
        rates = [rate * inverse for rate, inverse in zip(rates, inverses, strict=True)] if divided else rates
        return compiled(variables, states, rates, self._settings, bounded=bounded, events=[])


def states_of(layout: Layout, divisors: int | None) -> tuple[list[Any], list[Any], list[Any]]:
    """(what is integrated, the states, what rates are multiplied by), heyoka's expressions.

    Args:
        layout: names the states. divisors: place of the states' divisors among the run-time values, which their
            reciprocals follow; None where the states themselves are integrated.
    """
    import heyoka as hy

    count = len(layout.states)
    variables = [hy.expression(f"s{k}") for k in range(count)]
    if divisors is None:
        return variables, variables, []
    states = [hy.par[divisors + k] * variable for k, variable in enumerate(variables)]
    return variables, states, [hy.par[divisors + count + k] for k in range(count)]


def compiled(
    variables: list[Any], states: list[Any], rates: list[Any], settings: Taylor, *, bounded: bool, events: list[Any]
) -> Any:
    """heyoka's integrator of the rates that stops at events; the bound, if it is looked at, is the last of them."""
    import heyoka as hy

    if bounded:
        # Scaled to 1: heyoka chooses its steps by the size of the event functions as well as of the state.
        norm = hy.sum([state * state for state in states])
        outwards = hy.event_direction.negative
        events = [*events, hy.t_event(1.0 - norm * settings.bound**-2, direction=outwards)]
    return hy.taylor_adaptive(
        list(zip(variables, rates, strict=True)),
        [0.0] * len(variables),
        tol=settings.tolerance,
        opt_level=3 if settings.optimise else 0,
        compact_mode=len(variables) > COMPACT_ABOVE if settings.compact is None else settings.compact,
        **({"t_events": events} if events else {}),
    )


def sources(layout: Layout, states: list[Any]) -> dict[str, Any]:
    """A heyoka expression for each input of the kernel but modes: a state, the time or run-time values."""
    import heyoka as hy

    found: dict[str, Any] = dict(zip(layout.states, states, strict=True))
    found |= {name: hy.par[k] for k, name in enumerate(layout.constants)}
    for k, name in enumerate(layout.ramps):
        place = len(layout.constants) + 2 * k
        found[name] = hy.par[place] + hy.par[place + 1] * hy.time
    if layout.time is not None:
        found[layout.time] = hy.time
    return found


def inside(states: np.ndarray, bound: float) -> bool:
    """Whether the norm of every state is below the bound; (n,) or (N, n)."""
    # Written so that a NaN is outside; the sum over all rows is the cheap test that nearly always settles it.
    limit = bound**2
    return bool(np.vdot(states, states) < limit) or bool((np.square(states).sum(axis=-1) < limit).all())


def last_good(integrator: Any, end: float, steps: int) -> tuple[float, np.ndarray]:
    """Time and state after the last step, from where the integrator stands, that came out finite."""
    found = [(float(integrator.time), integrator.state.copy())]

    def keep(at: Any) -> bool:
        if np.isfinite(at.state).all():
            found[0] = (float(at.time), at.state.copy())
        return True

    integrator.propagate_until(end, max_steps=steps, callback=keep)
    return found[0]


def ended_early(
    initial: np.ndarray,
    times: np.ndarray,
    states: np.ndarray,
    at: float,
    last: np.ndarray,
    outcome: Outcome,
    *,
    stiff: bool = False,
) -> Stretch:
    """The rows that are good, and the state `last` at the end `at` if that is finite and new."""
    finite = np.asarray(np.isfinite(states).all(axis=1))
    count = len(finite) if finite.all() else int(np.argmin(finite))
    if not count:
        return Stretch(times=times[:1], states=initial[None, :].copy(), outcome=outcome, stiff=stiff)
    ended, rows = times[:count], states[:count]
    if np.isfinite(at) and np.isfinite(last).all() and at > ended[-1]:
        ended, rows = np.append(ended, at), np.vstack([rows, last])
    return Stretch(times=ended, states=rows, outcome=outcome, stiff=stiff)
