"""`Sampled`: how a plant runs in a loop with a processor."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ulna.base import SimulationError
from ulna.sim.sampled.clock import Jitter, MissedSamples
from ulna.sim.sampled.discretisation import Discretisation, ExactHold, RungeKutta4
from ulna.sim.sampled.drive import Pwm
from ulna.sim.sampled.limits import ConditionalIntegration, EndStop, Saturation, SlewLimit
from ulna.sim.sampled.sensors import MeasurementNoise, Quantiser
from ulna.system import LinearInjection, System

LONGEST_DELAY = 1000
"""Periods: every command on its way is a variable of the compiled loop."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sampled:
    """A continuous plant and a controller that runs once a period.

    At t_k = k · period: measure (noise, then quantiser); advance the controller's states from k − 1 to k; compute the
    command; limit it (slew, saturation); after `delay` the drive holds it on the plant's input until the next one.
    Between samples the plant takes `plant_steps` Runge-Kutta steps for each stretch of constant input.

    The wiring is by names. Plant inputs that bear the name of a controller output are driven by it, the others are
    disturbances (`inputs=` of `simulate`). The estimator reads plant outputs and driven inputs as it believes them:
    limited and delayed. The controller reads estimates (`x` or `x_hat`), plant outputs, else plant states, else
    references. Without an estimator it is a whole compensator, or a law on measured states.

    Args:
        controller: law or compensator; its outputs include plant inputs.
        period: s.
        estimator: an observer that sees the limited, delayed input; `LinearInjection` for `ExactHold`.
        discretisation: of estimator and controller.
        plant_steps: Runge-Kutta steps of the plant a period, or a stretch of constant input.
        plant_order: 4, the classical step, or 2, the midpoint rule at half the price: enough where stretches are short
            against the plant's fastest time constant, as the pulses of a bridge often are.
        delay: s from the sample to the new input; may be longer than a period.
        initial: states of estimator and controller at the start by name, else 0; for a `LinearInjection` estimates.
        saturation, slew, drive: of all driven inputs, or by input name.
        sensors, noise: of all measured outputs, or by output name.
        anti_windup: what the law's integrals do in saturation.
        jitter, missed: of the clock.
        end_stops: walls of the plant.
        references: by name what drives the other inputs of the controller: as inputs of `simulate`.
        parameters: SI values for the controller's and estimator's parameters, by name; else their own.
        seed: of all random numbers, which depend on (seed, sample, channel) only.
        bound: the run ends as blown up where the Euclidean norm of the plant's state (SI) reaches this.

    Raises:
        SimulationError: a period or delay out of range, a jitter longer than the period, a hold without its form.
    """

    controller: System
    period: float
    estimator: System | LinearInjection | None = None
    discretisation: Discretisation = field(default_factory=RungeKutta4)
    plant_steps: int = 1
    plant_order: int = 4
    delay: float = 0.0
    initial: Mapping[str, float] = field(default_factory=dict)
    saturation: Saturation | Mapping[str, Saturation] | None = None
    slew: SlewLimit | Mapping[str, SlewLimit] | None = None
    anti_windup: ConditionalIntegration | None = None
    sensors: Quantiser | Mapping[str, Quantiser] | None = None
    noise: MeasurementNoise | Mapping[str, MeasurementNoise] | None = None
    jitter: Jitter | None = None
    missed: MissedSamples | None = None
    drive: Pwm | Mapping[str, Pwm] | None = None
    end_stops: tuple[EndStop, ...] = ()
    references: Mapping[str, Any] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0
    bound: float = 1e12

    def __post_init__(self) -> None:
        if not (0 < self.period < math.inf):
            raise SimulationError(f"Sampled(period={self.period})", "the period must be a positive time in s.")
        if not (0 <= self.delay < math.inf):
            raise SimulationError(f"Sampled(delay={self.delay})", "the delay must be a time from 0 s on.")
        if self.delay >= LONGEST_DELAY * self.period:
            raise SimulationError(
                f"Sampled(delay={self.delay})",
                f"it is {self.delay / self.period:.3g} periods, of which the loop remembers {LONGEST_DELAY} at most.",
                "Give the delay and the period in seconds.",
            )
        if self.plant_steps < 1:
            raise SimulationError(f"Sampled(plant_steps={self.plant_steps})", "at least one step is needed.")
        if self.plant_order not in {2, 4}:
            raise SimulationError(f"Sampled(plant_order={self.plant_order})", "the steps are of order 2 or 4.")
        if not (self.bound > 0):
            raise SimulationError(f"Sampled(bound={self.bound})", "the bound must be positive.")
        if not (0 <= self.seed < 2**64):
            raise SimulationError(f"Sampled(seed={self.seed})", "a seed is a whole number of 64 bits.")
        if self.jitter is not None and not (self.jitter.width < self.period):
            raise SimulationError(
                f"Jitter(width={self.jitter.width})", f"it is not shorter than the period of {self.period} s."
            )
        if isinstance(self.discretisation, ExactHold) and not isinstance(self.estimator, LinearInjection):
            raise SimulationError(
                "ExactHold()",
                "it needs an estimator whose linear part is known.",
                "Give estimator=injected_observer(form, gains).linear.",
            )
