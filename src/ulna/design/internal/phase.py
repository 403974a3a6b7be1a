"""Minimum phase: the stability class of a plant's zero dynamics at its operating point."""

from __future__ import annotations

from ulna.base import Status, Verdict
from ulna.design.internal.critical_class import StabilityClass
from ulna.design.internal.equilibrium_stability import EquilibriumStability, equilibrium_stability
from ulna.design.internal.output_zeroing import ZeroDynamics
from ulna.geometry import relative_degree
from ulna.system import System


def minimum_phase(dynamics: ZeroDynamics, *, seconds: float = 5.0) -> EquilibriumStability:
    """The class of the zero dynamics at the equilibrium in, or nearest to, the operating point.

    Without zero dynamics a plant is minimum phase trivially: exponential.

    Args:
        dynamics: zero dynamics of a plant.
        seconds: s.
    """
    system = dynamics.system
    empty = system or System(name=f"zero dynamics of {dynamics.plant.name}", states=(), rates=())
    if system is None and dynamics.verdict.status is Status.UNDECIDED and _no_zero_dynamics(dynamics.plant):
        return _trivially(empty, "the relative degrees add up to its dimension")
    if system is None:
        claim = "the zero dynamics have a stability class"
        verdict = Verdict.undecided(claim, because=dynamics.verdict.claim, **dynamics.verdict.evidence)
        return EquilibriumStability(system=empty, stability=StabilityClass.UNDECIDED, verdict=verdict)
    if not system.states:
        return _trivially(system, "it has no zero dynamics")
    near = {x: dynamics.point[x] for x in system.state_symbols}
    return equilibrium_stability(system, near=near, seconds=seconds)


def _trivially(system: System, reason: str) -> EquilibriumStability:
    verdict = Verdict.proved("the plant is minimum phase", reason=reason)
    return EquilibriumStability(system=system, stability=StabilityClass.EXPONENTIAL, verdict=verdict)


def _no_zero_dynamics(plant: System) -> bool:
    """Whether the outputs and their derivatives are coordinates around the operating point."""
    if len(plant.outputs) != len(plant.inputs):
        return False
    degree = relative_degree(plant)
    return degree.at_point.holds and degree.total == len(plant.states)
