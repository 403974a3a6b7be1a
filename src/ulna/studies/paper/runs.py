"""What the loops do: runs from the paper's initial angles, where they end, and which printed number moves the end."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ulna.sim import Outcome, OutputMetrics, Trajectory, simulate
from ulna.sim.metrics import input_metrics, output_metrics
from ulna.studies.paper.exact import Exact
from ulna.studies.paper.loops import Controller, Deviation, compensator_loop, deviations, state_feedback_loop
from ulna.system import Equilibrium, System, equilibrium, linearise

SECONDS = 10.0
_SAMPLES = 1001
_CLOSE = 1e-3
ANGLE = "theta"


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One run of a loop.

    Attributes:
        angle: the initial angle in rad; everything else starts at zero.
        trajectory: the run.
        output: figures of the angle, target 0.
        peak_voltage: largest |u| on the way, in V.
        arrives: whether it ends at the loop's rest point.
    """

    angle: float
    trajectory: Trajectory
    output: OutputMetrics
    peak_voltage: float
    arrives: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Loop:
    """A closed loop and what came of it.

    Attributes:
        key: its name in the results; title: for reading; printed: whether as printed, not exact.
        system: the loop.
        rest: its equilibrium nearest to the horizontal; poles: of the linearisation there, in 1/s.
        runs: one for each initial angle.
    """

    key: str
    title: str
    printed: bool
    system: System
    rest: Equilibrium
    poles: tuple[complex, ...]
    runs: tuple[Run, ...]

    @property
    def steady_error_degrees(self) -> float:
        """Angle at rest − 0, in degrees."""
        return math.degrees(self.rest[ANGLE])

    @property
    def holding_voltage(self) -> float:
        """Voltage at rest, in V."""
        return self.rest["u"]

    @property
    def holding_power(self) -> float:
        """Electric power at rest, u·i, in W: all of it heats the armature."""
        return self.rest["u"] * self.rest["i"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Cause:
    """What one printed number does.

    Attributes:
        deviation: the number.
        alone: steady error in degrees with it alone as printed.
        repaired: steady error in degrees as printed, with it alone made exact.
        stable: whether the loop with it alone as printed is stable at rest.
    """

    deviation: Deviation
    alone: float
    repaired: float
    stable: bool


def loops(
    exact: Exact, exact_controller: Controller, printed_controller: Controller, angles: Sequence[float]
) -> tuple[Loop, ...]:
    """The four loops: state feedback and compensator, exact and as printed."""
    kinds = (
        ("state_feedback_exact", "Exact law, true states", False, state_feedback_loop, exact_controller),
        ("state_feedback_printed", "Law (32) as printed, true states", True, state_feedback_loop, printed_controller),
        ("compensator_exact", "Exact law and estimator", False, compensator_loop, exact_controller),
        ("compensator_printed", "Law (54), estimator (53) as printed", True, compensator_loop, printed_controller),
    )
    return tuple(
        _loop(key, title, printed, build(exact, controller, title), angles)
        for key, title, printed, build, controller in kinds
    )


def uncontrolled(exact: Exact, angles: Sequence[float]) -> tuple[Trajectory, ...]:
    """The arm without voltage from each initial angle, at rest and without current (Figure 4)."""
    times = np.linspace(0.0, SECONDS, _SAMPLES)
    return tuple(simulate(exact.plant, (angle, 0.0, 0.0), times) for angle in angles)


def causes(exact: Exact, good: Controller, bad: Controller) -> tuple[Cause, ...]:
    """Each number in which the printed controller is wrong, taken alone, in the loop with the estimator."""
    found = []
    for deviation in deviations(good, bad):
        alone = equilibrium(compensator_loop(exact, deviation.alone, "one number as printed"), near={})
        repaired = equilibrium(compensator_loop(exact, deviation.repaired, "one number repaired"), near={})
        found.append(
            Cause(
                deviation=deviation,
                alone=math.degrees(alone[ANGLE]),
                repaired=math.degrees(repaired[ANGLE]),
                stable=linearise(alone).stable,
            )
        )
    return tuple(found)


def _loop(key: str, title: str, printed: bool, system: System, angles: Sequence[float]) -> Loop:
    rest = equilibrium(system, near={})
    poles, runs = linearise(rest).eigenvalues, tuple(_run(system, rest, angle) for angle in angles)
    return Loop(key=key, title=title, printed=printed, system=system, rest=rest, poles=poles, runs=runs)


def _run(system: System, rest: Equilibrium, angle: float) -> Run:
    start = {s.name: 0.0 for s in system.states} | {ANGLE: angle}
    trajectory = simulate(system, start, np.linspace(0.0, SECONDS, _SAMPLES), throw=False)
    away = max(
        abs(float(value) - there) for there, value in zip(rest.numbers.values(), trajectory.final_state, strict=True)
    )
    return Run(
        angle=angle,
        trajectory=trajectory,
        output=output_metrics(trajectory.times, trajectory[ANGLE], 0.0),
        peak_voltage=input_metrics(trajectory.times, trajectory["u"]).peak,
        arrives=trajectory.outcome is Outcome.FINISHED and away < _CLOSE,
    )
