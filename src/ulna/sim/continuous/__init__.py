"""Continuous runs: Taylor series, an implicit engine for stiff plants, what happens at exact instants, many runs."""

from ulna.sim.continuous.crossing import Crossing, Direction
from ulna.sim.continuous.implicit import Implicit
from ulna.sim.continuous.settling import Settling
from ulna.sim.continuous.taylor import Taylor

__all__ = ["Crossing", "Direction", "Implicit", "Settling", "Taylor"]
