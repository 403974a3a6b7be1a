"""Taylor runs: Taylor integration, what happens at exact instants, and many runs at a time."""

from ulna.sim.continuous.crossing import Crossing, Direction
from ulna.sim.continuous.settling import Settling
from ulna.sim.continuous.taylor import Taylor

__all__ = ["Crossing", "Direction", "Settling", "Taylor"]
