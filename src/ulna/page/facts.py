"""What a page has to know of a loop besides its program: names, units, ranges and the slots that hold the numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import sympy as sp

from ulna.base import PlantError, unit
from ulna.loop import Amplifier, Fitted, Loop, Pwm
from ulna.page.program import Program
from ulna.page.sampled import SPARE, retimed
from ulna.symbolic.compiling import rounded
from ulna.system import Parameter, Signal, System

FINE = 2.0**-500
"""The step of an encoder that is switched off: a power of two, so small that the value passes through to the bit."""
FINE_SINGLE = 2.0**-80
"""The same where numbers are floats."""
CELL = "cell"
"""V at no load, among the numbers of an `Amplifier`, and `cell_resistance`, ohm: what makes a battery of it."""


def signal_facts(signal: Signal, **more: Any) -> dict[str, Any]:
    """A signal as the page shows it; its numbers are in its unit."""
    ends = [None if each is None else float(each) for each in (signal.lower, signal.upper)]
    return {
        "name": signal.name,
        "unit": signal.unit,
        "scale": 1.0,
        "text": signal.text,
        "range": None if ends == [None, None] else ends,
        **more,
    }


def parameter_facts(parameter: Parameter, value: float, *, owner: str, slot: str) -> dict[str, Any]:
    """A parameter as the page shows it: SI numbers, and what a unit of its label is in SI."""
    factors = unit(parameter.unit)
    scale = float(factors.factor) * (math.pi / 180) ** factors.degrees
    ends = [None if each is None else float(each) * scale for each in (parameter.lower, parameter.upper)]
    return {
        "name": parameter.name,
        "unit": parameter.unit,
        "scale": scale,
        "text": parameter.text,
        "range": None if ends == [None, None] else ends,
        "value": value,
        "owner": owner,
        "slot": slot,
    }


def parameter_values(system: System, given: Mapping[str, float] | None) -> dict[str, float]:
    """The SI value of every parameter.

    Raises:
        PlantError: a name that is not a parameter, parameters without a value.
    """
    names = [p.name for p in system.parameters]
    unknown = [name for name in given or {} if name not in names]
    if unknown:
        known = ", ".join(names) or "none"
        raise PlantError(
            f"parameter '{unknown[0]}' of '{system.name}'", "there is no such parameter.", f"Known: {known}."
        )
    values = {p.name: (given or {}).get(p.name, p.si_value) for p in system.parameters}
    missing = [name for name, value in values.items() if value is None]
    if missing:
        raise PlantError(
            f"a page of '{system.name}'",
            f"parameters without a value: {', '.join(missing)}; a simulation needs numbers.",
            f"Give them: parameters={{'{missing[0]}': ...}}, or --set {missing[0]}=1.",
        )
    return {
        name: rounded(value, name) if isinstance(value, sp.Basic) else float(value)
        for name, value in values.items()
        if value is not None
    }


def sampled_signals(loop: Loop) -> list[dict[str, Any]]:
    """Every signal that can be read, with its slot; of equal names the first one counts."""
    wiring = loop.wiring
    groups: list[tuple[str, str, str, Sequence[Signal]]] = [
        ("state", "{}", "x{}", loop.plant.states),
        ("output", "{}", "o{}", loop.plant.outputs),
        ("input", "{}", "ub{}", wiring.driven),
        ("reference", "{}", "r{}", wiring.references),
        ("disturbance", "{}", "d{}", wiring.disturbances),
        ("estimate", "{}", "e{}", wiring.estimates),
        ("command", "{}_command", "c{}", wiring.driven),
        ("limited command", "{}_limited", "h{}_0", wiring.driven),
        ("measured", "{}_measured", "yn{}", wiring.measured),
        ("memory", "{}", "z{}", wiring.memory),
    ]
    watched = [{"name": "fault", "slot": "code", "unit": "", "text": "fault code of the processor", "role": "fault"}]
    return [
        {"name": label.format(s.name), "slot": slot.format(k), "unit": s.unit, "text": s.text, "role": role}
        for role, label, slot, signals in groups
        for k, s in enumerate(signals)
    ] + (watched if loop.fit({}).hardware.watches else [])


def sampled_options(made: Program, loop: Loop) -> list[dict[str, Any]]:
    """What of the hardware can be switched off or changed while it runs; the program gets the numbers for it."""
    own, hardware = loop.fit({}), loop.fit({}).hardware
    fine = FINE_SINGLE if made.constants["single"] else FINE
    wide = {"lower": -math.inf, "upper": math.inf}
    open_sensor = {"step": fine, "codes": 1.0 / fine, "code_low": -math.inf, "code_high": math.inf}
    without: dict[str, tuple[str, dict[str, float]]] = {
        "encoder": ("sensors round to their steps", _each(own.sensors, open_sensor)),
        "noise": ("measured values are noisy", _each(own.noises, {"std": 0.0})),
        "limits": ("commands are limited", _each(own.saturations, wide)),
        "slew": ("commands change no faster than their rate", _each(own.slews, {"change": math.inf})),
        "battery": ("the battery sags behind its resistance", _batteries(own)),
        "jitter": ("samples are late at random", {"jitter": 0.0} if hardware.jitter else {}),
        "missed": ("samples are missed at random", {"missed_share": 0.0} if hardware.missed else {}),
    }
    found: list[dict[str, Any]] = []
    switches: dict[str, list[list[Any]]] = {}
    for name, (text, numbers) in without.items():
        # A slot that no kernel reads has nothing to be switched.
        known = {slot: value for slot, value in numbers.items() if slot in made.places}
        if known:
            switches[name] = [[slot, value] for slot, value in known.items()]
            found.append(_switch(name, text))
    if _cuts(own):
        found.append(_switch("drive", "the drive gives what its supply allows"))
    if retimed(loop):
        longest = (own.whole_delay + SPARE) * own.period
        found.append(
            {
                "name": "delay",
                "text": "from a sample to the new input",
                "kind": "number",
                "value": hardware.delay,
                "range": [0.0, longest],
                "unit": "s",
                "scale": 1.0,
            }
        )
    made.constants["switches"] = switches
    return found


def _batteries(own: Fitted) -> dict[str, float]:
    """What an ideal supply has in place of the battery of each drive whose numbers name one."""
    drives = [(k, each) for k, each in enumerate(own.drives) if isinstance(each, Amplifier)]
    return {
        f"drive{k}_{name}": ideal
        for k, each in drives
        if math.isfinite(each.numbers.get(CELL, math.inf))
        for name, ideal in ((CELL, math.inf), (f"{CELL}_resistance", 0.0))
    }


def _cuts(own: Fitted) -> bool:
    """Whether a drive stands between command and input that can be taken out of the way."""
    drives = [each for each in own.drives if each is not None]
    return bool(drives) and not any(isinstance(each, Pwm) and each.pulsed for each in drives)


def _each(parts: Sequence[object], numbers: Mapping[str, float]) -> dict[str, float]:
    return {f"{name}{k}": value for k, part in enumerate(parts) if part is not None for name, value in numbers.items()}


def _switch(name: str, text: str) -> dict[str, Any]:
    return {"name": name, "text": text, "kind": "switch", "value": True, "range": None, "unit": "", "scale": 1.0}


def limits_of(loop: Loop | None) -> dict[str, list[float]]:
    """The limits of driven inputs as designed, by name."""
    return {} if loop is None else {name: [each.lower, each.upper] for name, each in loop.saturation.items()}


def stops_of(loop: Loop | None) -> list[dict[str, Any]]:
    """The walls of the plant."""
    stops = () if loop is None or loop.hardware is None else loop.hardware.end_stops
    return [{"position": s.position, "velocity": s.velocity, "range": [s.lower, s.upper]} for s in stops]
