"""Simulation: `simulate` takes a system, an initial state and times, and answers with a `Trajectory`."""

from ulna.sim.continuous import Continuous
from ulna.sim.inputs import TIME, Constant, Formula, Held, Input, Interpolated
from ulna.sim.metrics import InputMetrics, Metrics, OutputMetrics, metrics
from ulna.sim.outcome import Outcome
from ulna.sim.simulate import simulate
from ulna.sim.trajectory import Trajectory

__all__ = [
    "TIME",
    "Constant",
    "Continuous",
    "Formula",
    "Held",
    "Input",
    "InputMetrics",
    "Interpolated",
    "Metrics",
    "Outcome",
    "OutputMetrics",
    "Trajectory",
    "metrics",
    "simulate",
]
