"""The hardware of a loop with the period that plant or controller bring along."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ulna.base import SimulationError
from ulna.loop.hardware import Hardware
from ulna.loop.parts import parts_of
from ulna.system import System

_CLOSE = 1e-9
"""Relative difference of periods that are the same: 0.001 as a fraction and as a float."""


def timed(plant: System, controller: Any, hardware: Hardware | None) -> Hardware | None:
    """The hardware, its period filled in; None for a loop that is one `System`.

    Raises:
        SimulationError: periods that differ; hardware of a processor without a period; a continuous controller of a
            plant in discrete time without hardware; a delay, pulses or a clock within the period of such a plant.
    """
    law = None if controller is None else parts_of(controller).system
    periods = {f"'{each.name}'": float(each.period) for each in (plant, law) if each is not None and each.period}
    if hardware is not None and hardware.period is not None:
        periods["the hardware"] = hardware.period
    if periods and max(periods.values()) > min(periods.values()) * (1.0 + _CLOSE):
        found = ", ".join(f"{name} {period:g} s" for name, period in periods.items())
        raise SimulationError(
            f"loop of '{plant.name}'", f"its periods differ: {found}.", "Give all of them the same period."
        )
    period = next(iter(periods.values()), None)
    if plant.discrete:
        _require_whole(plant, law, hardware)
        if hardware is None:
            return None
    if hardware is None:
        return None if period is None else Hardware(period=period)
    if period is None:
        hardware.require_period()
        return hardware
    return replace(hardware, period=period)


def _require_whole(plant: System, law: System | None, hardware: Hardware | None) -> None:
    """Refuse what happens between two steps of a plant in discrete time."""
    asked = f"loop of '{plant.name}', which moves in {plant.time_text}"
    if hardware is None:
        if law is not None and law.states and not law.discrete:
            hint = "Give it a period, or Hardware(): a processor then discretises it."
            raise SimulationError(asked, f"the controller '{law.name}' is in continuous time.", hint)
        return
    part = hardware.delay / float(plant.period or 1)
    inside = ["delay"] if abs(part - round(part)) > _CLOSE * max(1.0, part) else []
    inside += [name for name in ("clock", "drive") if getattr(hardware, name) is not None]
    if inside:
        found = f"{inside[0]}={getattr(hardware, inside[0])!r} acts between two of them."
        raise SimulationError(asked, found, "Leave it out, delay by whole periods, or write the plant as x' = ….")
