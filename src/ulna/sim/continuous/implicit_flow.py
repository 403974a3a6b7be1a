"""A flow by backward differentiation (CVODE of SUNDIALS) that stops at events."""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from contextlib import redirect_stdout
from typing import Any

import numpy as np

from ulna.base import OptionalDependencyError
from ulna.sim.continuous.course import Course, Scheme
from ulna.sim.continuous.implicit import EXTRA, Implicit
from ulna.sim.continuous.switching import Leg, Switching
from ulna.sim.outcome import Outcome

NEAR = 1e-6
"""Part of its size below which a state is held to an absolute tolerance."""

TOO_MUCH_WORK = -1
AT_EVENT = 2
"""What CVODE says when it stops."""


class ImplicitFlow(Switching):
    """The flow of a scheme by CVODE, with the slopes of the kernel as its Jacobian."""

    def __init__(self, scheme: Scheme, settings: Implicit) -> None:
        super().__init__(scheme, settings.bound, settings.maximum_steps)
        self._settings = settings
        self._solver = _solver()

    @property
    def explicit(self) -> bool:
        """See `Switching`."""
        return False

    def leg(self, course: Course, times: np.ndarray, steps: int, *, bounded: bool) -> Leg:  # noqa: ARG002
        """See `Switching`; the bound is always looked at."""
        solver = self._started(course, steps)
        end, rows, status, good = float(times[-1]), [], 0, True
        outcome, event = Outcome.FINISHED, None
        at, state = course.time, course.state
        # It prints what its result says as well.
        with redirect_stdout(io.StringIO()):
            solver.init_step(course.time, course.state)
            for time in times.tolist():
                found = solver.step(time, tstop=end)
                status, good = found.status, bool(found.success and np.isfinite(found.y).all())
                if np.isfinite(found.y).all():
                    at, state = float(np.ravel(found.t)[-1]), np.array(found.y, dtype=float)
                if status == AT_EVENT:
                    event = int(np.flatnonzero(np.ravel(found.i_events))[0])
                if status == AT_EVENT or not good:
                    break
                rows.append(state)
        if event == len(self.scheme.functions):
            event, outcome = None, Outcome.BLEW_UP
        elif not good:
            outcome = Outcome.STEP_LIMIT if status == TOO_MUCH_WORK else Outcome.NOT_FINITE
        return Leg(
            event=event,
            outcome=outcome,
            rows=np.array(rows).reshape(len(rows), len(course.state)),
            time=at,
            state=state,
        )

    def _started(self, course: Course, steps: int) -> Any:
        settings, count = self._settings, len(course.state)
        sizes = np.ones(count) if course.divisors is None else course.divisors
        functions = self.event_functions(course)

        def rates(time: float, state: np.ndarray, found: np.ndarray) -> None:
            found[:] = self.motion(course, time, state)[0]

        def slopes(time: float, state: np.ndarray, _rates: np.ndarray, found: np.ndarray) -> None:
            found[:] = self.motion.slopes(course, time, state)

        def events(time: float, state: np.ndarray, found: np.ndarray) -> None:
            found[:] = functions(time, state)

        number = len(self.scheme.functions) + 1
        events.terminal, events.direction = [True] * number, [-1] * number  # type: ignore[attr-defined]
        begun = self.motion.slopes(course, course.time, course.state)
        return self._solver(
            rates,
            jacfn=None if begun is None else slopes,
            eventsfn=events,
            num_events=number,
            rtol=settings.tolerance,
            atol=NEAR * settings.tolerance * sizes,
            max_num_steps=steps,
        )


def _solver() -> Callable[..., Any]:
    # Its warnings go to standard output unless this names another place when it starts.
    os.environ.setdefault("SUNLOGGER_WARNING_FILENAME", os.devnull)
    os.environ.setdefault("SUNLOGGER_ERROR_FILENAME", os.devnull)
    try:
        from sksundae.cvode import CVODE
    except ImportError:
        raise OptionalDependencyError("engine=Implicit()", EXTRA) from None
    return CVODE
