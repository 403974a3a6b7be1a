"""Runs of a loop with a processor: a compiled program of its kernels, one run or many side by side."""

from ulna.sim.sampled.engine import FixedSteps
from ulna.sim.sampled.ensemble import sampled_figures
from ulna.sim.sampled.foreign import AbstractProcessor, ForeignStep
from ulna.sim.sampled.gpu import Gpu
from ulna.sim.sampled.run import run_sampled
from ulna.sim.sampled.tables import begun

__all__ = ["AbstractProcessor", "FixedSteps", "ForeignStep", "Gpu", "begun", "run_sampled", "sampled_figures"]
