"""A sampled loop made ready: wiring, source, compiled function, and the numbers that fill it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
import sympy as sp

from ulna.base import SimulationError
from ulna.program import compiled
from ulna.sim.cache import IdentityCache
from ulna.sim.inputs import Formula, Input, Interpolated
from ulna.sim.metrics import BAND
from ulna.sim.sampled.constants import held_numbers, memory_rows
from ulna.sim.sampled.drive import Pwm
from ulna.sim.sampled.layout import EndStopPlace, Layout
from ulna.sim.sampled.sampled import Sampled
from ulna.sim.sampled.source import gpu_source, loop_source
from ulna.sim.sampled.tables import TINY
from ulna.sim.sampled.wiring import Wiring, wire
from ulna.system import Signal, System

LANES = 40
"""Runs of a block: five vector registers full. With 32 every 16th row of numbers falls on the same place in the
processor's first cache, which costs a quarter."""

Option = TypeVar("Option")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Loop:
    """A loop that can run.

    Attributes:
        layout: what it is made of. run: the compiled function. values: its settings, in order.
        columns: row of the record of each number kept at a sample. results: column of each number at the end of a run.
        held: constants of the controller. memory: (1, states of estimator and controller) at the start.
        series: (row of the record, role, signal) of what a trajectory shows besides states, inputs and outputs.
    """

    layout: Layout
    run: Callable[..., Any]
    values: np.ndarray
    held: np.ndarray
    memory: np.ndarray
    columns: Mapping[str, int]
    results: Mapping[str, int]
    series: tuple[tuple[int, str, Signal], ...]


_LOOPS = IdentityCache(64)


def loop_of(
    plant: System,
    settings: Sampled,
    inputs: Mapping[str, Input],
    *,
    lanes: int = 1,
    recording: bool = False,
    gpu: bool = False,
) -> Loop:
    """The loop of a plant, remembered by the identity of plant and settings.

    Args:
        plant: what is controlled. settings: of the loop. inputs: what drives the plant's other inputs.
        lanes: runs side by side. recording: keep every sample of a run. gpu: for a GPU, which needs neither.

    Raises:
        SimulationError: names that fit nothing, settings that contradict each other.
        OptionalDependencyError: without Numba.
    """
    formulas = tuple((name, given.expression) for name, given in inputs.items() if isinstance(given, Formula))
    ramps = any(isinstance(given, Interpolated) for given in inputs.values())

    def write(layout: Layout) -> tuple[str, tuple[str, ...]]:
        return gpu_source(layout) if gpu else loop_source(layout, lanes=lanes, recording=recording)

    key = (settings, formulas, ramps, lanes, recording, gpu)
    return _LOOPS.get(plant, key, lambda: _made(plant, settings, dict(formulas), ramps, write))


def _made(
    plant: System,
    settings: Sampled,
    formulas: dict[str, sp.Expr],
    ramps: bool,
    write: Callable[[Layout], tuple[str, tuple[str, ...]]],
) -> Loop:
    wiring = wire(plant, settings, formulas)
    _check_references(settings, wiring)
    layout, numbers = _layout(plant, settings, wiring, ramps)
    held, memory = held_numbers(settings, wiring), memory_rows(settings, wiring, {}, 1)
    source, names = write(layout)
    values = np.array([numbers[name] for name in names])
    # Last: mistakes come to light before seconds are spent on compiling.
    run = compiled(source)
    return Loop(
        layout=layout,
        run=run,
        values=values,
        held=held,
        memory=memory,
        columns=layout.columns(),
        results=layout.results(),
        series=_series(layout),
    )


def _series(layout: Layout) -> tuple[tuple[int, str, Signal], ...]:
    """Commands, limited commands, measured values, estimates and the controller's states; a name once."""
    columns, wiring = layout.columns(), layout.wiring
    groups = [
        ("command", "{}_command", "c{}", wiring.driven),
        ("limited command", "{}_limited", "h{}_0", wiring.driven),
        ("measured", "{}_measured", "yn{}", wiring.measured),
        ("estimate", "{}", "e{}", wiring.estimates),
        ("memory", "{}", "z{}", wiring.memory),
    ]
    found: dict[str, tuple[int, str, Signal]] = {}
    for role, label, slot, signals in groups:
        for k, signal in enumerate(signals):
            name, row = label.format(signal.name), columns.get(slot.format(k))
            if row is not None:
                found.setdefault(name, (row, role, Signal(name=name, unit=signal.unit, text=signal.text)))
    return tuple(found.values())


def _check_references(settings: Sampled, wiring: Wiring) -> None:
    names = [s.name for s in wiring.references]
    unused = [name for name in settings.references if name not in names]
    if unused:
        raise SimulationError(
            f"references of the controller '{settings.controller.name}'",
            f"nothing reads {', '.join(unused)}.",
            f"Its inputs: {', '.join(s.name for s in settings.controller.inputs) or 'none'}.",
        )


def _layout(plant: System, settings: Sampled, wiring: Wiring, ramps: bool) -> tuple[Layout, dict[str, float]]:
    period = settings.period
    whole = math.floor(settings.delay / period + TINY)
    fraction = settings.delay / period - whole
    split = fraction > TINY
    driven, measured = wiring.driven, wiring.measured
    saturations = _each("saturation", settings.saturation, driven)
    slews = _each("slew", settings.slew, driven)
    bridges = _each("drive", settings.drive, driven)
    sensors = _each("sensors", settings.sensors, measured)
    noises = _each("noise", settings.noise, measured)
    numbers = {
        "period": period,
        "fraction": fraction,
        "band": BAND,
        "bound_square": settings.bound**2,
        "jitter": settings.jitter.width if settings.jitter else 0.0,
        "missed": settings.missed.probability if settings.missed else 0.0,
    }
    for k, saturation in enumerate(saturations):
        if saturation is not None:
            numbers |= {f"lower{k}": saturation.lower, f"upper{k}": saturation.upper}
    for k, slew in enumerate(slews):
        numbers[f"change{k}"] = slew.rate * period if slew else math.inf
    for k, sensor in enumerate(sensors):
        if sensor is not None:
            numbers |= {f"step{k}": sensor.step, f"codes{k}": 1.0 / sensor.step}
            numbers |= {f"code_low{k}": sensor.lower, f"code_high{k}": sensor.upper}
    for k, noise in enumerate(noises):
        numbers[f"std{k}"] = noise.std if noise else 0.0
    for k, bridge in enumerate(bridges):
        if bridge is not None:
            numbers |= {
                f"supply{k}": bridge.supply,
                f"sag{k}": bridge.sag,
                f"dead{k}": bridge.dead_time * bridge.frequency,
            }
    for k, wall in enumerate(settings.end_stops):
        numbers |= {f"wall_low{k}": wall.lower, f"wall_high{k}": wall.upper, f"bounce{k}": wall.restitution}
    carriers = _carriers(settings, bridges)
    if carriers:
        numbers |= {"carriers": float(carriers), "old_carriers": float(round(fraction * carriers))}
    layout = Layout(
        wiring=wiring,
        discretisation=settings.discretisation,
        plant_steps=settings.plant_steps,
        plant_order=settings.plant_order,
        whole_delay=whole,
        split=split,
        saturated=tuple(each is not None for each in saturations),
        slewed=tuple(each is not None for each in slews),
        quantised=tuple(each is not None for each in sensors),
        noisy=tuple(each is not None for each in noises),
        bridged=tuple(each is not None for each in bridges),
        switched=tuple(each is not None and each.pulsed for each in bridges),
        rippled=any(each is not None and each.ripple for each in bridges),
        frozen=_frozen(settings, wiring),
        end_stops=_walls(plant, settings),
        jittered=settings.jitter is not None,
        missing=settings.missed is not None,
        ramps=ramps,
    )
    return layout, numbers


def _each(
    what: str, given: Option | Mapping[str, Option] | None, signals: tuple[Signal, ...]
) -> tuple[Option | None, ...]:
    """The option of each signal."""
    names = [s.name for s in signals]
    if not isinstance(given, Mapping):
        return (given,) * len(names)
    unknown = [name for name in given if name not in names]
    if unknown:
        raise SimulationError(
            f"{what} of the sampled loop", f"there is no signal {', '.join(unknown)}.", f"Known: {', '.join(names)}."
        )
    return tuple(given.get(name) for name in names)


def _carriers(settings: Sampled, bridges: tuple[Pwm | None, ...]) -> int:
    """Carrier periods of a sampling period where the plant gets pulses, else 0."""
    pulsed = [bridge for bridge in bridges if bridge is not None and bridge.pulsed]
    if not pulsed:
        return 0
    frequencies = sorted({bridge.frequency for bridge in pulsed})
    if len(frequencies) > 1 or len({bridge.ripple for bridge in pulsed}) > 1:
        raise SimulationError(
            "bridges with pulses",
            f"they have different carriers ({', '.join(f'{each:g} Hz' for each in frequencies)}), or one is switched "
            "and another has ripple.",
            "Give all of them the same, or some only their mean.",
        )
    count = frequencies[0] * settings.period
    if round(count) < 1 or abs(count - round(count)) > 1e-6 * count:
        raise SimulationError(
            f"Pwm(frequency={frequencies[0]:g}) with pulses",
            f"a period of {settings.period:g} s has {count:g} carrier periods.",
            "Make it a whole number.",
        )
    return round(count)


def _frozen(settings: Sampled, wiring: Wiring) -> tuple[int, ...]:
    if settings.anti_windup is None:
        return ()
    names = [s.name for s in wiring.memory]
    unknown = [name for name in settings.anti_windup.states if name not in names]
    if unknown:
        raise SimulationError(
            "anti-windup", f"the controller has no state {', '.join(unknown)}.", f"Known: {', '.join(names) or 'none'}."
        )
    return tuple(names.index(name) for name in settings.anti_windup.states)


def _walls(plant: System, settings: Sampled) -> tuple[EndStopPlace, ...]:
    names = [s.name for s in plant.states]
    for wall in settings.end_stops:
        for name in (wall.position, wall.velocity):
            if name not in names:
                raise SimulationError(
                    "EndStop", f"'{plant.name}' has no state '{name}'.", f"Its states: {', '.join(names)}."
                )
    return tuple(
        EndStopPlace(position=names.index(wall.position), velocity=names.index(wall.velocity))
        for wall in settings.end_stops
    )
