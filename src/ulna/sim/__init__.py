"""Simulation: `simulate` answers with a `Trajectory`, or with an `Ensemble` of many runs."""

from ulna.loop import TIME
from ulna.sim.continuous.crossing import Crossing, Direction
from ulna.sim.continuous.implicit import Implicit
from ulna.sim.continuous.rules import limited
from ulna.sim.continuous.settling import Settling
from ulna.sim.continuous.taylor import Taylor
from ulna.sim.ensemble import CODES, Ensemble
from ulna.sim.event import Event, EventKind
from ulna.sim.figures import BAND, last_entry, output_figures
from ulna.sim.inputs import Constant, Formula, Held, Input, Interpolated, as_input, input_values
from ulna.sim.metrics import InputMetrics, Metrics, OutputMetrics, input_metrics, metrics, output_metrics
from ulna.sim.mode import Mode
from ulna.sim.outcome import Outcome
from ulna.sim.record import Ends, Figures, Paths
from ulna.sim.rest import rest_values
from ulna.sim.sampled import AbstractProcessor, FixedSteps, ForeignStep, Gpu, begun
from ulna.sim.simulate import simulate
from ulna.sim.trajectory import Series, Trajectory

__all__ = [
    "BAND",
    "CODES",
    "TIME",
    "AbstractProcessor",
    "Constant",
    "Crossing",
    "Direction",
    "Ends",
    "Ensemble",
    "Event",
    "EventKind",
    "Figures",
    "FixedSteps",
    "ForeignStep",
    "Formula",
    "Gpu",
    "Held",
    "Implicit",
    "Input",
    "InputMetrics",
    "Interpolated",
    "Metrics",
    "Mode",
    "Outcome",
    "OutputMetrics",
    "Paths",
    "Series",
    "Settling",
    "Taylor",
    "Trajectory",
    "as_input",
    "begun",
    "input_metrics",
    "input_values",
    "last_entry",
    "limited",
    "metrics",
    "output_figures",
    "output_metrics",
    "rest_values",
    "simulate",
]
