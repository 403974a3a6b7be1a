"""Continuous runs: Taylor integration, what happens at exact instants, and many runs at a time."""

from ulna.sim.continuous.continuous import Continuous
from ulna.sim.continuous.crossing import Crossing, Direction
from ulna.sim.continuous.settling import Settling

__all__ = ["Continuous", "Crossing", "Direction", "Settling"]
