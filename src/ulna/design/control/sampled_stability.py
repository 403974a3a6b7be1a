"""Whether a controller designed in continuous time can work at a sampling period, before any simulation.

Source: K. J. Åström, B. Wittenmark, Computer-Controlled Systems, 3rd ed., sections 2.3 (sampling with delay), 3.2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ulna.base import DesignError, Verdict
from ulna.design.control.grid import LoopGrid, loop_grid
from ulna.design.control.law import Law
from ulna.design.control.output_feedback import Compensator, close_loop
from ulna.loop import Discretisation, Hardware, Loop, Program, Repeat, RungeKutta4, Steps, applied
from ulna.loop.flow import flow
from ulna.loop.step import step
from ulna.program import Kernel, Unwritten, tangents, to_numpy
from ulna.symbolic.compiling import batch_jacobian, batch_vector
from ulna.system import System

_ENOUGH = 50.0
"""1/0.02: a 2 % band."""
_WORTH = 0.5
"""Least share of the designed decay rate that sampling must leave."""
_FINE = 0.02
"""Step of the plant over its shortest time constant: its slopes are then right to eleven digits."""


def sampled_grid(
    plant: System,
    controller: Law | Compensator,
    over: Mapping[str, Sequence[float] | np.ndarray],
    *,
    period: float,
    delay: float | None = None,
    discretisation: Discretisation | None = None,
    guess: Mapping[str, str | float] | None = None,
) -> LoopGrid:
    """The loop of `loop_grid`, closed by a processor: eigenvalues ln(z)/period of its linearisation at rest.

    The kernels of `loop.step` and `loop.flow` are linearised. The real part of ln(z)/period is the decay rate of the
    samples; it is positive where the sampled loop is unstable. There are as many eigenvalues as states and commands.

    Args:
        plant: the true plant; over, guess: as in `loop_grid` of the continuous loop.
        controller: a law on measured states, or a compensator; without integral action.
        period: in s; delay: in s from 0 to the period; left out, a whole period.
        discretisation: of the observer; left out, that of `Hardware`.

    Raises:
        DesignError: for a delay outside 0 … period, or a law with states of its own.
    """
    late = period if delay is None else delay
    if not (0 < period < math.inf and 0 <= late <= period):
        raise DesignError(
            f"period {period} s, delay {late} s", "expected a positive period and a delay between 0 and the period."
        )
    law = controller if isinstance(controller, Law) else controller.law
    if law.system.states:
        raise DesignError(f"sampled loop of '{plant.name}'", "its law has integrators.", "Leave them out here.")
    grid = loop_grid(close_loop(plant, controller).system, over, guess=guess)
    chip = Hardware(
        period=period,
        delay=late,
        discretisation=discretisation or RungeKutta4(),
        guard=None,
        arithmetic=Unwritten(),
    )
    loop, at = Loop(plant=plant, controller=controller, hardware=chip), _values(plant, controller, grid)
    rates = _rates(plant, at)
    number = max(1, math.ceil(period * float(np.nanmax(rates, initial=0.0)) / _FINE))
    slopes = _period_map(loop, at, grid, number)
    found = np.isfinite(slopes).all(axis=(1, 2))
    size = grid.rest.shape[1] + len(loop.wiring.driven)
    multipliers = np.full((len(slopes), size), np.nan, dtype=complex)
    if found.any():
        every = np.linalg.eigvals(slopes[found])
        multipliers[found] = np.take_along_axis(every, np.argsort(-np.abs(every), axis=1), axis=1)[:, :size]
    smallest = np.where(np.abs(multipliers) < 1e-300, 1e-300, multipliers)  # dead beat: ln 0
    return replace(grid, eigenvalues=np.log(smallest) / period)


def sampling_advice(
    plant: System,
    controller: Law | Compensator,
    *,
    period: float,
    delay: float | None = None,
    at: Mapping[str, float] | None = None,
    limits: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
) -> Verdict:
    """Whether the controller can work on the plant at this period; said before simulating, from linear analysis.

    Refuted where the sampled loop is unstable at rest or keeps less than half the decay rate designed. The evidence
    holds the largest multiplier |z|, its frequency in Hz (half the sampling frequency: the command alternates from
    sample to sample), the plant's shortest time constant over the period, the settling time ln 50/decay, the decay
    without sampling, and for each limited input the law's command at the start over its limit.

    Args:
        at: SI values of references and parameters at which the loop rests; also where Newton's method starts for
            states of these names.
        limits: largest |input| by name, in SI; start: the plant's state at the start by name, else 0.
    """
    points = {name: [value] for name, value in (at or {}).items()}
    names = {s.name for s in plant.states}
    known = {n: v for n, v in points.items() if n not in names}
    guess = {n: v[0] for n, v in points.items() if n in names}
    loop = close_loop(plant, controller).system
    grid = sampled_grid(plant, controller, known, period=period, delay=delay, guess=guess)
    continuous = loop_grid(loop, known, guess=guess)
    row = grid.eigenvalues[0]
    worst = row[int(np.argmax(row.real))]
    fastest = float(_rates(plant, _values(plant, controller, continuous))[0])
    evidence: dict[str, object] = {
        "largest_multiplier": float(np.exp(worst.real * period)),
        "frequency": float(abs(worst.imag) / (2 * math.pi)),
        "decay_without_sampling": -continuous.worst,
        "shortest_time_constant_over_period": 1.0 / (fastest * period) if fastest else math.inf,
        "settling_time": math.log(_ENOUGH) / -float(worst.real) if worst.real < 0 else math.inf,
    }
    evidence |= {
        f"command_over_limit_of_{name}": ratio
        for name, ratio in _over_limits(controller, at or {}, limits or {}, start or {}).items()
    }
    claim = f"the controller of '{plant.name}' works at a period of {period:g} s"
    works = worst.real < 0 and -worst.real >= _WORTH * -continuous.worst
    return (Verdict.supported if works else Verdict.refuted)(claim, **evidence)


def _values(plant: System, controller: Law | Compensator, grid: LoopGrid) -> dict[str, np.ndarray]:
    """(P,) values at rest of everything that plant, observer and law contain."""
    loop, size = grid.system, grid.rest.shape[0]
    held = {s.name: np.zeros(size) for s in loop.inputs}
    for system in (plant, controller.system):
        held |= {p.name: np.full(size, float(p.si_value)) for p in system.parameters if p.si_value is not None}
    states = {s.name: grid.rest[:, k] for k, s in enumerate(loop.states)}
    outputs = {o.name: grid.outputs[:, k] for k, o in enumerate(loop.outputs)}
    return {**held, **outputs, **states, **grid.points}


def _period_map(loop: Loop, at: Mapping[str, np.ndarray], grid: LoopGrid, number: int) -> np.ndarray:
    """(P, S, S) slopes of all slots after a period by those before: of the step's kernels, then of the flow's."""
    wiring, plant = loop.wiring, loop.plant
    known = {name: at[name] for name, _ in wiring.parameters}
    fitted = loop.fit({name: float(values[0]) for name, values in known.items()})
    processor, moving = step(fitted), flow(fitted, Steps(number=number), {})
    first: list[Kernel | Repeat] = [moving.outputs, *processor.stages, applied(fitted)]
    program = (*first, *moving.motion)
    states = {f"x{k}": grid.rest[:, k] for k in range(len(plant.states))}
    states |= {f"z{k}": grid.rest[:, len(plant.states) + k] for k in range(len(wiring.memory))}
    slots = {name: np.full(len(grid.rest), value) for name, value in moving.numbers.items()}
    before, constants = wiring.controller.before, moving.constants
    held = np.array(list(known.values()))
    slots |= dict(zip(before.outputs, to_numpy(before)(*(held[int(name[1:])] for name in before.inputs)), strict=True))
    own = {f"p{k}": at[p.name] for k, p in enumerate(plant.parameters)}
    found = to_numpy(constants)(*(own[name] for name in constants.inputs))
    slots |= {f"plant_{name}": value for name, value in zip(constants.outputs, found, strict=True)}
    slots |= {f"r{k}": at[s.name] for k, s in enumerate(wiring.references)}
    slots |= {f"d{k}": at[s.name] for k, s in enumerate(wiring.disturbances)}
    slots |= {"span": slots["period"], "begun": np.zeros(len(grid.rest))}
    # At rest a sample changes nothing: what is on its way arrives after a few.
    for _ in range(fitted.whole_delay + 3):
        slots |= states
        for each in first:
            slots |= _answers(each, slots)
    slots |= states | {"begun": np.ones(len(grid.rest))}
    return _slopes(program, slots, tuple(dict.fromkeys(_outputs(program))))


def _outputs(program: Program) -> Iterator[str]:
    for each in program:
        yield from _outputs(each.body) if isinstance(each, Repeat) else each.outputs


def _answers(kernel: Kernel | Repeat, slots: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    if isinstance(kernel, Repeat) or not kernel.outputs:
        return {}
    zero = np.zeros_like(slots["period"])
    found = to_numpy(kernel)(*(slots.get(name, zero) for name in kernel.inputs))
    return dict(zip(kernel.outputs, found, strict=True))


def _slopes(program: Program, slots: dict[str, np.ndarray], names: tuple[str, ...]) -> np.ndarray:
    """(P, S, S) slopes of the slots of these names after a program by those before it; the slots are moved on."""
    whole = np.broadcast_to(np.eye(len(names)), (len(slots["period"]), len(names), len(names)))
    for each in program:
        if isinstance(each, Repeat):
            times = int(slots[each.times][0])
            whole = np.linalg.matrix_power(_slopes(each.body, slots, names), times) @ whole
            continue
        along = [name for name in each.inputs if name in names]
        part = np.broadcast_to(np.eye(len(names)), whole.shape).copy()
        rows = [names.index(name) for name in each.outputs]
        part[:, rows] = 0.0
        for label, value in _answers(tangents(each, along, piecewise=True), slots).items():
            output, _, name = label.rpartition("/")
            part[:, names.index(output), names.index(name)] = value
        slots |= _answers(each, slots)
        whole = part @ whole
    return whole


def _rates(plant: System, at: Mapping[str, np.ndarray]) -> np.ndarray:
    """(P,) largest eigenvalue of the plant in size, 1/s; NaN where there is no rest."""
    symbols = [*plant.state_symbols, *plant.input_symbols, *plant.parameter_symbols]
    slopes = batch_jacobian("plant", plant.inline(plant.rates), plant.state_symbols, symbols)(at)
    found = np.isfinite(slopes).all(axis=(1, 2))
    rates = np.full(len(slopes), np.nan)
    rates[found] = np.abs(np.linalg.eigvals(slopes[found])).max(axis=1)
    return rates


def _over_limits(
    controller: Law | Compensator, at: Mapping[str, float], limits: Mapping[str, float], start: Mapping[str, float]
) -> dict[str, float]:
    law = controller if isinstance(controller, Law) else controller.law
    symbols = [*law.system.input_symbols, *law.system.parameter_symbols]
    values = {s.name: np.zeros(1) for s in symbols}
    values |= {p.name: np.full(1, float(p.si_value)) for p in law.system.parameters if p.si_value is not None}
    values |= {n: np.full(1, float(v)) for n, v in {**at, **start}.items()}
    commands = batch_vector("law", law.system.inline(law.system.readouts), symbols)(values)[0]
    return {
        o.name: abs(float(c)) / limits[o.name]
        for o, c in zip(law.system.outputs, commands, strict=True)
        if o.name in limits
    }
