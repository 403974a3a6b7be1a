"""A sampled loop made ready: wiring, source, compiled function, and the numbers that fill it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
import sympy as sp
from scipy.linalg import expm

from ulna.base import SimulationError
from ulna.sim.cache import IdentityCache
from ulna.sim.inputs import Constant, Formula, Input, Interpolated, as_input, input_values
from ulna.sim.metrics import BAND
from ulna.sim.sampled.compiled import compiled
from ulna.sim.sampled.discretisation import ExactHold
from ulna.sim.sampled.drive import Pwm
from ulna.sim.sampled.layout import EndStopPlace, Layout
from ulna.sim.sampled.sampled import Sampled
from ulna.sim.sampled.source import loop_source
from ulna.sim.sampled.wiring import Wiring, wire
from ulna.symbolic.program.instructions_from_sympy import rounded
from ulna.symbolic.program.kernel import kernel
from ulna.symbolic.program.lowering.python_source import to_python
from ulna.system import Signal, System
from ulna.system.linear_injection import LinearInjection

LANES = 32
"""Runs of a block; below 16 the compiler unrolls instead of making vector code, 32 are a sixth faster than 16."""

TINY = 1e-9
"""Part of a period below which a time counts as a whole number of periods."""

Option = TypeVar("Option")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Loop:
    """A loop that can run.

    Attributes:
        layout: what it is made of. run: the compiled function. values: its settings, in order.
        columns: row of the record of each number kept at a sample. held: constants of the controller.
        memory: (states of estimator and controller,) at the start.
    """

    layout: Layout
    run: Callable[..., int]
    values: np.ndarray
    held: np.ndarray
    memory: np.ndarray
    columns: Mapping[str, int]


_LOOPS = IdentityCache(64)


def loop_of(plant: System, settings: Sampled, inputs: Mapping[str, Input], *, lanes: int, recording: bool) -> Loop:
    """The loop of a plant, remembered by the identity of plant and settings.

    Raises:
        SimulationError: names that fit nothing, settings that contradict each other.
        OptionalDependencyError: without Numba.
    """
    formulas = tuple((name, given.expression) for name, given in inputs.items() if isinstance(given, Formula))
    ramps = any(isinstance(given, Interpolated) for given in inputs.values())
    key = (settings, formulas, ramps, lanes, recording)
    return _LOOPS.get(plant, key, lambda: _made(plant, settings, dict(formulas), ramps, lanes, recording))


def _made(
    plant: System, settings: Sampled, formulas: dict[str, sp.Expr], ramps: bool, lanes: int, recording: bool
) -> Loop:
    wiring = wire(plant, settings, formulas)
    _check_references(settings, wiring)
    layout, numbers = _layout(plant, settings, wiring, ramps)
    held, memory = _held(settings, wiring), _memory(settings, wiring)
    source, names = loop_source(layout, lanes=lanes, recording=recording)
    values = np.array([numbers[name] for name in names])
    # Last: mistakes come to light before seconds are spent on compiling.
    run = compiled(source)
    return Loop(layout=layout, run=run, values=values, held=held, memory=memory, columns=layout.columns())


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
    switched = _switched(settings, bridges)
    if switched is not None:
        numbers |= {"carriers": float(switched), "old_carriers": float(round(fraction * switched))}
    layout = Layout(
        wiring=wiring,
        discretisation=settings.discretisation,
        plant_steps=settings.plant_steps,
        whole_delay=whole,
        split=split,
        saturated=tuple(each is not None for each in saturations),
        slewed=tuple(each is not None for each in slews),
        quantised=tuple(each is not None for each in sensors),
        noisy=tuple(each is not None for each in noises),
        bridged=tuple(each is not None for each in bridges),
        switched=switched is not None,
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


def _switched(settings: Sampled, bridges: tuple[Pwm | None, ...]) -> int | None:
    """Carrier periods of a sampling period where pulses are integrated."""
    pulsed = [bridge for bridge in bridges if bridge is not None and bridge.switched]
    if not pulsed:
        return None
    if len(bridges) > 1:
        raise SimulationError(
            "Pwm(switched=True)", f"the controller drives {len(bridges)} inputs.", "Pulses are for one; use the mean."
        )
    count = pulsed[0].frequency * settings.period
    if round(count) < 1 or abs(count - round(count)) > 1e-6 * count:
        raise SimulationError(
            f"Pwm(frequency={pulsed[0].frequency:g}, switched=True)",
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


def _held(settings: Sampled, wiring: Wiring) -> np.ndarray:
    """The controller's constants, then Φ, G₀ and G₁ row by row."""
    known = parameters_of(settings, wiring)
    before = wiring.controller.before
    values = to_python(before)(*(known[int(name[1:])] for name in before.inputs))
    if not all(map(math.isfinite, values)):
        raise SimulationError(
            f"controller '{settings.controller.name}'", "its formulas are not finite for its parameters."
        )
    estimator = settings.estimator
    if not isinstance(settings.discretisation, ExactHold) or not isinstance(estimator, LinearInjection):
        return np.array([*values, 0.0])
    symbols = estimator.system.parameter_symbols
    table = dict(zip(symbols, known, strict=False))
    matrix = np.array(estimator.matrix.xreplace(table), dtype=float)
    blocks = held_matrices(matrix, settings.period, interpolate=settings.discretisation.interpolate)
    return np.concatenate([np.array(values), *(block.ravel() for block in blocks)])


def held_matrices(matrix: np.ndarray, period: float, *, interpolate: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(Φ, G₀, G₁), each (n, n), of z' = F z + w with w on a straight line from w₀ to w₁, or held at w₀.

    One matrix exponential gives all three: C. F. Van Loan, "Computing integrals involving the matrix exponential",
    IEEE Trans. Autom. Contr. 23 (1978).
    """
    n = len(matrix)
    whole = np.zeros((3 * n, 3 * n))
    whole[:n, :n] = matrix * period
    whole[:n, n : 2 * n] = np.eye(n) * period
    whole[n : 2 * n, 2 * n :] = np.eye(n)
    grown = expm(whole)
    phi, step, ramp = grown[:n, :n], grown[:n, n : 2 * n], grown[:n, 2 * n :]
    return (phi, step - ramp, ramp) if interpolate else (phi, step, np.zeros((n, n)))


def parameters_of(settings: Sampled, wiring: Wiring) -> list[float]:
    """The SI values of the parameters of estimator and controller."""
    names = [name for name, _ in wiring.parameters]
    unknown = [name for name in settings.parameters if name not in names]
    if unknown:
        raise SimulationError(
            f"parameters of the controller '{settings.controller.name}'",
            f"it has no {', '.join(unknown)}.",
            f"Known: {', '.join(dict.fromkeys(names)) or 'none'}.",
        )
    missing = [name for name, value in wiring.parameters if value is None and name not in settings.parameters]
    if missing:
        raise SimulationError(
            f"controller '{settings.controller.name}'",
            f"parameters without a value: {', '.join(dict.fromkeys(missing))}.",
            f"Give them: Sampled(parameters={{'{missing[0]}': ...}}).",
        )
    return [
        rounded(value, name) if value is not None and name not in settings.parameters else settings.parameters[name]
        for name, value in wiring.parameters
    ]


def _memory(settings: Sampled, wiring: Wiring) -> np.ndarray:
    """States of estimator and controller at the start."""
    names = [s.name for s in wiring.memory]
    estimator = settings.estimator
    shown = [s.name for s in estimator.system.outputs] if isinstance(estimator, LinearInjection) else []
    unknown = [name for name in settings.initial if name not in (*names, *shown)]
    if unknown:
        raise SimulationError(
            "initial state of the controller",
            f"there is no {', '.join(unknown)}.",
            f"Known: {', '.join((*names, *shown)) or 'none'}.",
        )
    start = {name: float(settings.initial.get(name, 0.0)) for name in names}
    if isinstance(estimator, LinearInjection):
        symbols = [sp.Symbol(name, real=True) for name in shown]
        own = [s.name for s in estimator.system.states]
        values = dict(zip(estimator.system.parameter_symbols, parameters_of(settings, wiring), strict=False))
        expressions = [expression.xreplace(values) for expression in estimator.start]
        evaluate = to_python(kernel("start", symbols, dict(zip(own, expressions, strict=True))))
        begun = evaluate(*(float(settings.initial.get(name, 0.0)) for name in shown))
        start |= {name: value for name, value in zip(own, begun, strict=True) if name not in settings.initial}
    if not all(map(math.isfinite, start.values())):
        raise SimulationError("initial state of the controller", "a value is not a finite number.")
    return np.array([start[name] for name in names] or [0.0])


def samples_of(settings: Sampled, start: float, end: float) -> int:
    """The number of periods between two times.

    Raises:
        SimulationError: a period longer than the run, a run that does not begin at 0.
    """
    if start != 0.0:
        raise SimulationError("times of a sampled run", f"they begin at {start:g} s.", "A sampled run begins at 0 s.")
    count = math.floor(end / settings.period + TINY * max(1.0, end / settings.period))
    if count < 1:
        raise SimulationError(
            f"Sampled(period={settings.period:g})",
            f"the period is longer than the run of {end:g} s.",
            "Run longer or sample faster.",
        )
    return count


def reference_table(settings: Sampled, wiring: Wiring, count: int) -> np.ndarray:
    """(count + 1, references) values at the nominal sample times."""
    names = [s.name for s in wiring.references]
    values = parameters_of(settings, wiring)
    known = dict(zip((name for name, _ in wiring.parameters), values, strict=True))
    given = [as_input(name, settings.references[name]) for name in names]
    return _table(given, names, settings, count, known)


def _table(
    inputs: list[Input], names: list[str], settings: Sampled, count: int, parameters: Mapping[str, float]
) -> np.ndarray:
    times = settings.period * np.arange(count + 1)
    table = np.zeros((count + 1, max(1, len(inputs))))
    for column, (name, given) in enumerate(zip(names, inputs, strict=True)):
        _check_span(name, given, float(times[-1]))
        table[:, column] = input_values(given, times, parameters)
    return table


def _check_span(name: str, given: Input, end: float) -> None:
    if isinstance(given, Constant | Formula):
        return
    if given.times[0] > 0.0 or (isinstance(given, Interpolated) and given.times[-1] < end - TINY):
        raise SimulationError(
            f"'{name}' of the sampled loop",
            f"it is given from {given.times[0]:g} s to {given.times[-1]:g} s, the run goes from 0 s to {end:g} s.",
            "Give samples for the whole run.",
        )


def disturbance_table(
    inputs: Mapping[str, Input], settings: Sampled, wiring: Wiring, count: int, parameters: Mapping[str, float]
) -> np.ndarray:
    """(count + 1, 2 others): value at each sample, slope until the next one."""
    table = np.zeros((count + 1, 2 * max(1, len(wiring.others))))
    names = [s.name for s in wiring.others]
    given = [inputs.get(name, Constant(value=0.0)) for name in names]
    values = _table(given, names, settings, count, parameters)
    for column, each in enumerate(given):
        table[:, 2 * column] = values[:, column]
        if isinstance(each, Interpolated):
            table[:-1, 2 * column + 1] = np.diff(values[:, column]) / settings.period
    return table


def as_rows(rows: int, columns: int, values: Any = None) -> np.ndarray:
    """(rows, columns) floats, contiguous, at least one column so that the compiled loop can take it."""
    table = np.zeros((rows, max(1, columns)))
    if values is not None and columns:
        table[:, :columns] = values
    return table
