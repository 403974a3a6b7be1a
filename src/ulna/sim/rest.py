"""Where a plant rests, as the numbers at which its outputs and states should end."""

from __future__ import annotations

from ulna.system import System, equilibrium


def rest_values(plant: System) -> dict[str, float]:
    """SI values of outputs and states, by name, where the plant rests at its operating point; 0 where that is open."""
    valued = plant.with_values()
    point = equilibrium(valued)
    at = {**point.states, **point.inputs}
    shown = dict(zip((s.name for s in valued.states), valued.state_symbols, strict=True))
    shown |= dict(zip((s.name for s in valued.outputs), valued.inline(valued.readouts), strict=True))
    found = {name: each.subs(at) for name, each in shown.items()}
    return {name: float(value) if value.is_real and value.is_number else 0.0 for name, value in found.items()}
