"""What moves while the outputs are held: zero dynamics and the class of their equilibria."""

from ulna.design.internal.output_zeroing import ZeroDynamics, zero_dynamics
from ulna.design.internal.phase import minimum_phase
