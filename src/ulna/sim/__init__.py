"""Simulation: `simulate` answers with a `Trajectory`, `run_ensemble` with the figures of many runs."""

from ulna.sim.continuous.continuous import Continuous
from ulna.sim.continuous.crossing import Crossing, Direction
from ulna.sim.continuous.settling import Settling
from ulna.sim.ensemble import EnsembleResult, run_ensemble
from ulna.sim.event import Event, EventKind
from ulna.sim.inputs import TIME, Constant, Formula, Held, Input, Interpolated
from ulna.sim.metrics import InputMetrics, Metrics, OutputMetrics, metrics
from ulna.sim.outcome import Outcome
from ulna.sim.sampled import (
    ConditionalIntegration,
    EndStop,
    Euler,
    ExactHold,
    Gpu,
    Jitter,
    MeasurementNoise,
    MissedSamples,
    Pwm,
    Quantiser,
    RungeKutta4,
    Sampled,
    Saturation,
    SlewLimit,
)
from ulna.sim.simulate import simulate
from ulna.sim.trajectory import Series, Trajectory

__all__ = [
    "TIME",
    "ConditionalIntegration",
    "Constant",
    "Continuous",
    "Crossing",
    "Direction",
    "EndStop",
    "EnsembleResult",
    "Euler",
    "Event",
    "EventKind",
    "ExactHold",
    "Formula",
    "Gpu",
    "Held",
    "Input",
    "InputMetrics",
    "Interpolated",
    "Jitter",
    "MeasurementNoise",
    "Metrics",
    "MissedSamples",
    "Outcome",
    "OutputMetrics",
    "Pwm",
    "Quantiser",
    "RungeKutta4",
    "Sampled",
    "Saturation",
    "Series",
    "Settling",
    "SlewLimit",
    "Trajectory",
    "metrics",
    "run_ensemble",
    "simulate",
]
