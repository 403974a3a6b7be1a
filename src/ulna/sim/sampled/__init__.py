"""Sampled-data loops: a continuous plant, a processor that runs once a period, and what lies between them."""

from ulna.sim.sampled.clock import Jitter, MissedSamples
from ulna.sim.sampled.discretisation import Euler, ExactHold, RungeKutta4
from ulna.sim.sampled.drive import Pwm
from ulna.sim.sampled.gpu import Gpu
from ulna.sim.sampled.limits import ConditionalIntegration, EndStop, Saturation, SlewLimit
from ulna.sim.sampled.sampled import Sampled
from ulna.sim.sampled.sensors import MeasurementNoise, Quantiser

__all__ = [
    "ConditionalIntegration",
    "EndStop",
    "Euler",
    "ExactHold",
    "Gpu",
    "Jitter",
    "MeasurementNoise",
    "MissedSamples",
    "Pwm",
    "Quantiser",
    "RungeKutta4",
    "Sampled",
    "Saturation",
    "SlewLimit",
]
