"""A compiled Taylor integrator for one kernel: run from an initial state, with jumps located and blow-up found."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any

import numpy as np

from ulna.sim.continuous import Continuous
from ulna.sim.guards import Flip, Guards, Layout
from ulna.sim.outcome import Outcome
from ulna.symbolic.program.modes import Moded

COMPACT_ABOVE = 12
"""Number of states above which straight code takes longer to compile than it is worth."""

PROBE = 1e-6
"""Fraction of a stretch over which a guard that starts at zero shows where it goes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """What came of a run. times: (N,), states: (N, n), both up to where it ended."""

    times: np.ndarray
    states: np.ndarray
    outcome: Outcome


class Flow:
    """The compiled flow of one moded kernel, whose first n outputs are the rates of the n states.

    Hold `lock` while calling: the integrator is one piece of memory.

    Args:
        moded: the kernel without jumps.
        layout: where its inputs come from.
        settings: tolerance, bound and compilation.
    """

    def __init__(self, moded: Moded, layout: Layout, settings: Continuous) -> None:
        import heyoka as hy  # 0.4 s: only when something is integrated

        self._codes = hy.taylor_outcome
        self._reached = hy.taylor_outcome.time_limit
        self.lock = threading.Lock()
        self._moded = moded
        self._layout = layout
        self._settings = settings
        self._guards = Guards(moded, layout) if moded.guards else None
        self._plain = self._compiled(bounded=False)
        self._bounded: Any = None
        # Views into the integrator's memory: asking for them anew costs as much as a step.
        self._state = self._plain.state
        self._values = self._plain.pars
        self._value_count = len(self._plain.pars)

    def final(self, initial: np.ndarray, start: float, end: float, values: list[float]) -> np.ndarray | None:
        """(n,) state at `end`, the fast way; None where jumps or an early end need `run`."""
        if self._guards is not None:
            return None
        integrator = self._plain
        integrator.time = start
        self._state[:] = initial
        if self._value_count:
            self._values[:] = values[: self._value_count]
        outcome = integrator.propagate_until(end, max_steps=self._settings.maximum_steps)[0]
        if outcome != self._reached or not self._inside(self._state):
            return None
        return self._state.copy()

    def run(self, initial: np.ndarray, times: np.ndarray, values: list[float]) -> Stretch:
        """The states at the given times (N ≥ 2); `initial` holds at the first."""
        stretch = self._attempted(self._plain, initial, times, values)
        if stretch.outcome is not Outcome.NOT_FINITE and self._inside(stretch.states):
            return stretch
        # Only now is the event worth its cost: it slows every step and doubles the time to compile.
        if self._bounded is None:
            self._bounded = self._compiled(bounded=True)
        return self._attempted(self._bounded, initial, times, values)

    def _inside(self, states: np.ndarray) -> bool:
        # Written so that a NaN is outside; the sum over all rows is the cheap test that nearly always settles it.
        limit = self._settings.bound**2
        return bool(np.vdot(states, states) < limit) or bool((np.square(states).sum(axis=-1) < limit).all())

    def _attempted(self, integrator: Any, initial: np.ndarray, times: np.ndarray, values: list[float]) -> Stretch:
        if self._guards is not None:
            values = values + self._modes_at_start(integrator, initial, times, values)
        _set(integrator, float(times[0]), initial, values)
        result = integrator.propagate_grid(times, max_steps=self._settings.maximum_steps)
        code, states = result[0], result[5]
        if code == self._reached:
            return Stretch(times=times, states=states, outcome=Outcome.FINISHED)
        # heyoka names the event that ended a run by −1 − its place; the bound comes after the guards.
        outcome = Outcome.BLEW_UP
        if self._guards is not None and -1 - code.value in range(self._guards.count):
            outcome = Outcome.SLIDING
        elif code == self._codes.step_limit:
            outcome = Outcome.STEP_LIMIT
        elif code == self._codes.err_nf_state:
            outcome = Outcome.NOT_FINITE
        return _ended_early(integrator, initial, times, states, outcome)

    def _modes_at_start(
        self, integrator: Any, initial: np.ndarray, times: np.ndarray, values: list[float]
    ) -> list[float]:
        """The signs of the guards; one that is zero takes the sign that it has a moment later."""
        guards = self._guards
        if guards is None:
            return []
        modes = guards.settled(float(times[0]), initial, values, [0.0] * guards.count)
        if all(modes):
            return modes
        _set(integrator, float(times[0]), initial, values + modes)
        integrator.step(max_delta_t=PROBE * float(times[-1] - times[0]))
        shown = guards.values(float(integrator.time), integrator.state, values, modes)
        return [mode or float(np.sign(guard)) for mode, guard in zip(modes, shown, strict=True)]

    def _compiled(self, *, bounded: bool) -> Any:
        import heyoka as hy

        from ulna.symbolic.program.lowering.heyoka import to_heyoka

        layout = self._layout
        variables = [hy.expression(f"s{k}") for k in range(len(layout.states))]
        expressions = list(to_heyoka(self._moded.kernel, self._sources(variables)).values())
        rates, guards = expressions[: len(variables)], expressions[len(variables) :]
        events = []
        if self._guards is not None:
            # A guard whose mode is 0 stays at zero: it must not be met again and again.
            modes = [hy.par[layout.first_mode + k] for k in range(len(guards))]
            watched = [hy.select(hy.eq(m, 0.0), 1.0, guard) for m, guard in zip(modes, guards, strict=True)]
            events = [hy.t_event(guard, callback=Flip(self._guards, k)) for k, guard in enumerate(watched)]
        if bounded:
            # Scaled to 1: heyoka chooses its steps by the size of the event functions as well as of the state.
            norm = hy.sum([variable * variable for variable in variables])
            outwards = hy.event_direction.negative
            events.append(hy.t_event(1.0 - norm * self._settings.bound**-2, direction=outwards))
        compact = self._settings.compact
        return hy.taylor_adaptive(
            list(zip(variables, rates, strict=True)),
            [0.0] * len(variables),
            tol=self._settings.tolerance,
            opt_level=3 if self._settings.optimise else 0,
            compact_mode=len(variables) > COMPACT_ABOVE if compact is None else compact,
            **({"t_events": events} if events else {}),
        )

    def _sources(self, variables: list[Any]) -> dict[str, Any]:
        """A heyoka expression for each input of the kernel: a variable, the time or run-time values."""
        import heyoka as hy

        layout = self._layout
        sources: dict[str, Any] = dict(zip(layout.states, variables, strict=True))
        sources |= {name: hy.par[k] for k, name in enumerate(layout.constants)}
        for k, name in enumerate(layout.ramps):
            place = len(layout.constants) + 2 * k
            sources[name] = hy.par[place] + hy.par[place + 1] * hy.time
        if layout.time is not None:
            sources[layout.time] = hy.time
        modes = [name for name in self._moded.kernel.inputs if name not in sources]
        return sources | {name: hy.par[layout.first_mode + k] for k, name in enumerate(modes)}


def _set(integrator: Any, time: float, state: np.ndarray, values: list[float]) -> None:
    integrator.time = time
    integrator.state[:] = state
    # A value that no rate uses has no place in the integrator's memory.
    integrator.pars[:] = values[: len(integrator.pars)]
    if integrator.with_events:
        integrator.reset_cooldowns()


def _ended_early(
    integrator: Any, initial: np.ndarray, times: np.ndarray, states: np.ndarray, outcome: Outcome
) -> Stretch:
    """The rows that are good, and the state at the end if that is finite and new."""
    finite = np.asarray(np.isfinite(states).all(axis=1))
    count = len(finite) if finite.all() else int(np.argmin(finite))
    if not count:
        return Stretch(times=times[:1], states=initial[None, :].copy(), outcome=outcome)
    ended, rows = times[:count], states[:count]
    at, last = float(integrator.time), integrator.state
    if np.isfinite(at) and np.isfinite(last).all() and at > ended[-1]:
        ended, rows = np.append(ended, at), np.vstack([rows, last])
    return Stretch(times=ended, states=rows, outcome=outcome)
