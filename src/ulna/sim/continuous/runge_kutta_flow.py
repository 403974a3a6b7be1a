"""A flow by SciPy's Runge-Kutta method of order 8 that stops at events: where heyoka has no wheel."""

from __future__ import annotations

import warnings
from functools import cache
from importlib.util import find_spec

import numpy as np

from ulna.base import UlnaWarning
from ulna.sim.continuous.course import Course, Scheme
from ulna.sim.continuous.switching import Leg, Switching
from ulna.sim.continuous.taylor import Taylor
from ulna.sim.outcome import Outcome

LEAST = 1e-12
"""Smallest tolerance of a step: below it the method counts rounding errors."""

NEAR = 1e-6
"""Part of its size below which a state is held to an absolute tolerance."""

FINE = 4.0 * np.finfo(float).eps
"""How exactly the instant of an event is found within a step, as part of it."""


@cache
def taylor_available() -> bool:
    """Whether heyoka, which integrates by Taylor series, is installed; the first "no" says what takes its place."""
    if find_spec("heyoka") is not None:
        return True
    warnings.warn(
        "heyoka is not installed: continuous runs take SciPy's Runge-Kutta method of order 8, which is slower and "
        "holds an error of 1e-12 a step at best.",
        UlnaWarning,
        stacklevel=2,
    )
    return False


class RungeKuttaFlow(Switching):
    """The flow of a scheme by SciPy's `DOP853`; within a step a zero is looked for on its interpolant."""

    def __init__(self, scheme: Scheme, settings: Taylor) -> None:
        super().__init__(scheme, settings.bound, settings.maximum_steps)
        self._tolerance = max(settings.tolerance, LEAST)

    @property
    def explicit(self) -> bool:
        """See `Switching`."""
        return True

    @property
    def exact(self) -> bool:
        """See `Switching`."""
        return False

    def leg(self, course: Course, times: np.ndarray, steps: int, *, bounded: bool) -> Leg:  # noqa: ARG002
        """See `Switching`; the bound is always looked at."""
        from scipy.integrate import DOP853
        from scipy.optimize import brentq

        sizes = np.ones(len(course.state)) if course.divisors is None else course.divisors
        functions = self.event_functions(course)
        end = float(times[-1])
        rows: list[np.ndarray] = []

        def ended(outcome: Outcome, time: float, state: np.ndarray, event: int | None = None) -> Leg:
            kept = np.array(rows).reshape(len(rows), len(course.state))
            return Leg(event=event, outcome=outcome, rows=kept, time=time, state=np.array(state))

        with np.errstate(all="ignore"):  # what is not finite is looked at below
            method = DOP853(
                lambda time, state: self.motion(course, time, state)[0],
                course.time,
                course.state,
                end,
                rtol=self._tolerance,
                atol=NEAR * self._tolerance * sizes,
            )
            before = functions(course.time, course.state)
            for _ in range(steps):
                began, good = float(method.t), np.array(method.y)
                method.step()
                if method.status == "failed" or not np.isfinite(method.y).all():
                    return ended(Outcome.NOT_FINITE, began, good)
                curve, after = method.dense_output(), functions(method.t, method.y)
                crossed = np.flatnonzero((before > 0.0) & (after <= 0.0))
                at, event = float(method.t), None
                for k in crossed:
                    here = _zero(brentq, lambda t, k=k, curve=curve: functions(t, curve(t))[k], began, method.t)
                    at, event = (here, int(k)) if here < at or event is None else (at, event)
                upto = np.searchsorted(times[len(rows) :], at, side="right")
                rows += [method.y.copy() if t == method.t else curve(t) for t in times[len(rows) :][:upto].tolist()]
                if event is not None:
                    known = event < len(self.scheme.functions)
                    outcome = Outcome.FINISHED if known else Outcome.BLEW_UP
                    return ended(outcome, at, curve(at), event if known else None)
                if method.status == "finished":
                    return ended(Outcome.FINISHED, float(method.t), method.y)
                before = after
        return ended(Outcome.STEP_LIMIT, float(method.t), method.y)


def _zero(search: object, function: object, began: float, ended: float) -> float:
    """Where the function reaches zero from above; it is positive at first and not at the end."""
    if function(ended) == 0.0:  # type: ignore[operator]
        return ended
    return float(search(function, began, ended, xtol=FINE * (ended - began), rtol=FINE))  # type: ignore[operator]
