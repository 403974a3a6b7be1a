"""`Hardware`: what lies between a controller's formulas and the plant: processor, sensors, drive, limits, clock."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields

from ulna.base import SimulationError
from ulna.loop.clock import Jitter, MissedSamples
from ulna.loop.discretisation import Discretisation, RungeKutta4
from ulna.loop.drive import Amplifier, Pwm
from ulna.loop.guard import Guard
from ulna.loop.limits import ConditionalIntegration, EndStop, Saturation, SlewLimit
from ulna.loop.sensors import MeasurementNoise, Quantiser
from ulna.loop.watches import Deadline, InnovationLimit, ReferenceRange
from ulna.program import AbstractArithmetic, Fused

LONGEST_DELAY = 1000
"""Periods: every command on its way is a slot of the step's memory."""

_OF_A_PROCESSOR = (
    "delay",
    "sensors",
    "noise",
    "drive",
    "slew",
    "anti_windup",
    "clock",
    "deadline",
    "references",
    "innovation",
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hardware:
    """A processor that runs the controller once a period, its sensors and its drive; the limits of the plant.

    At t_k = k · period: measure (noise, then quantiser); advance the controller's states from k − 1 to k; compute the
    command; limit it (slew, saturation); after `delay` the drive holds it on the plant's input until the next one.
    Without a period the controller is continuous, and only saturation and end stops are possible; a `Loop` gives it the
    period of a plant or controller in discrete time.

    Args:
        period: s; None for a continuous controller.
        delay: s from the sample to the new input; may be longer than a period.
        sensors, noise: of all measured signals, or by name.
        drive: of all driven inputs, or by name.
        saturation, slew: of all driven inputs, or by name.
        anti_windup: what the law's integrals do in saturation.
        discretisation: of a continuous controller; one in discrete time runs as it is written.
        clock: what the real clock does: `Jitter`, `MissedSamples`, or both in a tuple.
        end_stops: walls of the plant.
        guard: what the processor does with a value that is not finite; None for no check.
        deadline: what it does when it is called late, or samples are missed.
        references: ranges of all references, or by name. innovation: when its estimator has lost the plant.
        arithmetic: how it computes: `Fused()` with fused multiply-add, `Plain()` the same bits in every language.

    Raises:
        SimulationError: a period or delay out of range, a jitter longer than the period.

    Examples:
        >>> chip = ulna.Hardware(period=1e-3, saturation=ulna.Saturation(lower=-24, upper=24), delay=1e-3)
        >>> loop = ulna.close_loop("duffing", ulna.state_feedback("duffing", [-1, -2]), hardware=chip)
        >>> loop.hardware.period
        0.001
    """

    period: float | None = None
    delay: float = 0.0
    sensors: Quantiser | Mapping[str, Quantiser] | None = None
    noise: MeasurementNoise | Mapping[str, MeasurementNoise] | None = None
    drive: Pwm | Amplifier | Mapping[str, Pwm | Amplifier] | None = None
    saturation: Saturation | Mapping[str, Saturation] | None = None
    slew: SlewLimit | Mapping[str, SlewLimit] | None = None
    anti_windup: ConditionalIntegration | None = None
    discretisation: Discretisation = field(default_factory=RungeKutta4)
    clock: Jitter | MissedSamples | tuple[Jitter | MissedSamples, ...] | None = None
    end_stops: tuple[EndStop, ...] = ()
    guard: Guard | None = field(default_factory=Guard)
    deadline: Deadline | None = None
    references: ReferenceRange | Mapping[str, ReferenceRange] | None = None
    innovation: InnovationLimit | None = None
    arithmetic: AbstractArithmetic = field(default_factory=Fused)

    def __post_init__(self) -> None:
        self._check_stops()
        if self.period is None:
            return
        if not (0 < self.period < math.inf):
            raise SimulationError(f"Hardware(period={self.period})", "the period must be a positive time in s.")
        if not (0 <= self.delay < math.inf):
            raise SimulationError(f"Hardware(delay={self.delay})", "expected a time of 0 s or more.")
        if self.delay >= LONGEST_DELAY * self.period:
            raise SimulationError(
                f"Hardware(delay={self.delay})",
                f"it is {self.delay / self.period:.3g} periods, of which the loop remembers {LONGEST_DELAY} at most.",
                "Give the delay and the period in seconds.",
            )
        if self.jitter is not None and not (self.jitter.width < self.period):
            raise SimulationError(
                f"Jitter(width={self.jitter.width})", f"it is not shorter than the period of {self.period} s."
            )

    @property
    def sampled(self) -> bool:
        """Whether the controller runs once a period."""
        return self.period is not None

    def require_period(self) -> None:
        """Refuse hardware of a processor without a period.

        Raises:
            SimulationError: naming the first of it.
        """
        idle = {each.name: each.default for each in fields(self)}
        given = [name for name in _OF_A_PROCESSOR if getattr(self, name) != idle[name]]
        if given and self.period is None:
            raise SimulationError(
                f"Hardware({given[0]}=...)",
                "only a controller that runs once a period has it.",
                "Give the period too, Hardware(period=1e-3, ...) say.",
            )

    @property
    def jitter(self) -> Jitter | None:
        """How late the samples come, if they do."""
        return next((each for each in self._clock if isinstance(each, Jitter)), None)

    @property
    def missed(self) -> MissedSamples | None:
        """Which samples are missed, if some are."""
        return next((each for each in self._clock if isinstance(each, MissedSamples)), None)

    @property
    def told_missed(self) -> bool:
        """Whether the step is told that there is no new sample."""
        return self.missed is not None or (self.deadline is not None and self.deadline.missed is not None)

    @property
    def told_elapsed(self) -> bool:
        """Whether the step is told the time since its last call."""
        return self.deadline is not None and self.deadline.lateness is not None

    @property
    def watches(self) -> bool:
        """Whether there are faults besides numbers that are not finite."""
        return any(each is not None for each in (self.deadline, self.references, self.innovation))

    @property
    def _clock(self) -> tuple[Jitter | MissedSamples, ...]:
        if self.clock is None:
            return ()
        return self.clock if isinstance(self.clock, tuple) else (self.clock,)

    def _check_stops(self) -> None:
        positions = [stop.position for stop in self.end_stops]
        if len(set(positions)) < len(positions):
            raise SimulationError(
                "Hardware(end_stops=...)",
                f"one position has two ({', '.join(positions)}).",
                "Give lower and upper of one EndStop.",
            )
