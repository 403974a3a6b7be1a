"""`Switching`: a flow that stops at events, lets them happen and goes on; one kind for each integrator."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ulna.sim.continuous.course import Course, Motion, Scheme
from ulna.sim.continuous.flow import Stretch, ended_early, inside
from ulna.sim.continuous.stiffness import APPROACH
from ulna.sim.continuous.yardstick import Yardstick
from ulna.sim.outcome import Outcome

PATIENCE = 5000
"""Steps after which an implicit run is looked at, which follows a motion in few."""

HOPELESS = 1e5
"""An implicit run that would need more than so many looks to arrive is over: it comes ever closer to a pole."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """What came of integrating until something happened.

    Attributes:
        event: number of the event function that ended it. outcome: how it ended where that was no event.
        rows: (N, n) states at the times that were reached. time: s, where it ended. state: (n,) there.
    """

    event: int | None = None
    outcome: Outcome = Outcome.FINISHED
    rows: np.ndarray
    time: float
    state: np.ndarray


class Switching(ABC):
    """The flow of a scheme. Hold `lock` while calling: the integrator is one piece of memory.

    Args:
        scheme: what is integrated. bound: of the state's norm. steps: at most.
    """

    def __init__(self, scheme: Scheme, bound: float, steps: int) -> None:
        self.lock = threading.Lock()
        self.scheme = scheme
        self.bound = bound
        self._steps = steps
        self.motion = Motion(scheme, explicit=self.explicit, exact=self.exact)

    @abstractmethod
    def leg(self, course: Course, times: np.ndarray, steps: int, *, bounded: bool) -> Leg:
        """From where the course is to the last of the times, an event or an early end."""

    @property
    @abstractmethod
    def explicit(self) -> bool:
        """Whether stiffness holds its steps short."""

    @property
    def exact(self) -> bool:
        """Whether its steps are exact to rounding."""
        return self.explicit

    def event_functions(self, course: Course) -> Callable[[float, np.ndarray], np.ndarray]:
        """(time, state) → the functions that are positive until their event, the last of them for the bound."""
        sides = course.sides * course.weights
        watched = np.flatnonzero(sides)

        def values(time: float, state: np.ndarray) -> np.ndarray:
            found = np.ones(len(self.scheme.functions) + 1)
            if len(watched):
                found[watched] = sides[watched] * course.distances(state, time)[watched]
            found[-1] = 1.0 - float(state @ state) / self.bound**2
            return found

        return values

    def run(
        self, began: Course, initial: np.ndarray, times: np.ndarray, values: list[float], sizes: Yardstick
    ) -> tuple[Course, Stretch]:
        """Where the run stands at the end, and its states at the given times (N ≥ 2); `initial` holds at the first."""
        course, stretch = self._measured(began, initial, times, values, sizes, bounded=False)
        if stretch.stiff or (stretch.outcome is not Outcome.NOT_FINITE and inside(stretch.states, self.bound)):
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
            if stretch.outcome is Outcome.STEP_LIMIT or sizes.fits(stretch.states):
                return course, stretch

    def _attempted(
        self, course: Course, initial: np.ndarray, times: np.ndarray, values: list[float], *, bounded: bool
    ) -> Stretch:
        states = np.empty((len(times), len(initial)))
        states[0], done, steps = initial, 1, self._steps
        course.enter(float(times[0]), initial, values, float(times[1]))
        for _ in range(self._steps):
            while course.outcome is None and done < len(times) and times[done] <= course.time:
                states[done] = course.state
                done += 1
            if course.outcome is not None:
                return _stopped(course, times[:done], states[:done])
            if done == len(times):
                return Stretch(times=times, states=states, outcome=Outcome.FINISHED)
            # Steps become ever shorter towards a branch point: one looks now and then.
            most = min(APPROACH if self.explicit else PATIENCE, steps)
            began = course.time
            leg = self.leg(course, times[done:], most, bounded=bounded)
            states[done : done + len(leg.rows)] = leg.rows
            done += len(leg.rows)
            edge = False
            if leg.event is None:
                if leg.outcome is Outcome.FINISHED:
                    return Stretch(times=times, states=states, outcome=Outcome.FINISHED)
                steps -= most
                edge = leg.outcome is not Outcome.BLEW_UP and course.at_edge(leg.time, leg.state)
                stuck = self._stuck(course, leg, began, float(times[-1]), steps)
                if not self.explicit and (leg.time - began) * HOPELESS < float(times[-1]) - leg.time:
                    steps = 0
                if not edge and (leg.outcome is not Outcome.STEP_LIMIT or steps <= 0 or stuck):
                    course.outcome = leg.outcome
                    return ended_early(
                        initial, times[:done], states[:done], leg.time, leg.state, leg.outcome, stiff=stuck
                    )
            course.time, course.state = leg.time, leg.state
            if leg.event is not None or edge:
                course.react(-1 if leg.event is None else leg.event, float(times[min(done, len(times) - 1)]))
        course.outcome = Outcome.STEP_LIMIT
        return _stopped(course, times[:done], states[:done])

    def _stuck(self, course: Course, leg: Leg, began: float, end: float, steps: int) -> bool:
        if not self.explicit or leg.outcome is not Outcome.STEP_LIMIT:
            return False
        arguments = self.motion.arguments(course, leg.time, leg.state)
        stiffness = self.motion.form(course.held).stiffness
        return stiffness.holds(arguments, (leg.time - began) / APPROACH, end - leg.time, steps)


def _stopped(course: Course, times: np.ndarray, states: np.ndarray) -> Stretch:
    """What ended at an event: its time and state stand at the end."""
    if course.time > times[-1]:
        times, states = np.append(times, course.time), np.vstack([states, course.state])
    return Stretch(times=times, states=states, outcome=course.outcome or Outcome.FINISHED)
