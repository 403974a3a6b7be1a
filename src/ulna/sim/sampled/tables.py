"""The arrays that a compiled loop takes: what runs begin with, what all share at a sample, samples of their own."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy as sp

from ulna.base import SimulationError
from ulna.loop import TINY, Loop, parameters_of
from ulna.program import to_python
from ulna.sim.cache import IdentityCache
from ulna.sim.inputs import Constant, Formula, Held, Input, Interpolated, input_values
from ulna.sim.sampled.prepared import Prepared, Shape
from ulna.sim.starts import Starts
from ulna.symbolic.compiling import kernel
from ulna.system import LinearInjection

MOST_SAMPLES = 100_000_000
"""Of one run: tables and trajectories of more do not fit into memory."""


def samples_of(period: float, start: float, end: float) -> int:
    """The number of periods between two times.

    Raises:
        SimulationError: a period longer than the run or too many samples, a run that does not begin at 0.
    """
    if start != 0.0:
        raise SimulationError("times of a sampled run", f"they begin at {start:g} s.", "A sampled run begins at 0 s.")
    ratio = end / period  # infinite of the shortest periods that a number can be
    count = ratio if math.isinf(ratio) else math.floor(ratio + TINY * max(1.0, ratio))
    if count < 1:
        raise SimulationError(
            f"Hardware(period={period:g})",
            f"the period is longer than the run of {end:g} s.",
            "Run longer or sample faster.",
        )
    if count > MOST_SAMPLES:
        raise SimulationError(
            f"Hardware(period={period:g})",
            f"a run of {end:g} s has {count:.3g} samples, at most {MOST_SAMPLES:.0e} are possible.",
            "Sample more slowly or run shorter.",
        )
    return int(count)


ALONE = Shape()
"""No inputs."""


def shape_of(loop: Loop, inputs: Mapping[str, Input]) -> Shape:
    """How the inputs enter: formulas of disturbances are compiled in, samples of each run's own are read."""
    if not inputs:
        return ALONE
    plant = {s.name for s in loop.disturbances}
    free = [name for name in inputs if name in plant]
    formulas = tuple((name, given.expression) for name in free if isinstance(given := inputs[name], Formula))
    slots = [s.name for s in loop.disturbances if s.name not in dict(formulas)]
    names = {f"r{k}": s.name for k, s in enumerate(loop.references)} | {f"d{k}": name for k, name in enumerate(slots)}
    names |= {f"noise{k}": f"{s.name}_noise" for k, s in enumerate(loop.wiring.measured)}
    own = {p.name for p in loop.plant.parameters}
    return Shape(
        formulas=formulas,
        ramps=any(isinstance(inputs[name], Interpolated) for name in free),
        paths=tuple(slot for slot, name in names.items() if _of_its_own(inputs.get(name), slot, own)),
    )


def _of_its_own(given: Input | None, slot: str, parameters: set[str]) -> bool:
    """Whether each run has samples of its own: noise, samples with a row for each, formulas of the run's parameters."""
    if isinstance(given, Formula):
        return slot.startswith("noise") or not parameters.isdisjoint(s.name for s in given.expression.free_symbols)
    return given is not None and (slot.startswith("noise") or np.ndim(getattr(given, "values", 0.0)) == 2)


def source_of(slot: str, loop: Loop, made: Prepared) -> str:
    """The name of the input that fills a slot of samples."""
    stem, k = slot.rstrip("0123456789"), int(slot.lstrip("abcdefghijklmnopqrstuvwxyz"))
    if stem == "noise":
        return f"{loop.wiring.measured[k].name}_noise"
    return (loop.references if stem == "r" else made.disturbances)[k].name


def begin_table(loop: Loop, made: Prepared, starts: Starts) -> np.ndarray:
    """(N, columns) what each run begins with."""
    runs = len(starts.initial)
    table = np.zeros((runs, max(1, made.blocks.columns[-1].end if made.blocks.columns else 0)))
    rows = {"x": starts.initial, "p": starts.parameters, "target": starts.targets}
    named = {"z": loop.wiring.memory, "u": loop.wiring.driven, "r": loop.references, "d": made.disturbances}
    memory = _memory(loop, made, starts, runs)
    for each in made.blocks.columns:
        if each.stem in rows:
            table[:, each.begin : each.end] = rows[each.stem][:, each.first : each.first + each.end - each.begin]
        elif known := memory if each.stem in {"z", "u"} else starts.own:
            for k, column in enumerate(range(each.begin, each.end), each.first):
                table[:, column] = known.get(named[each.stem][k].name, 0.0)
    return table


def shared_table(loop: Loop, made: Prepared, starts: Starts, count: int) -> np.ndarray:
    """(count + 1, columns) references and disturbances at the nominal sample times, and slopes until the next one.

    Remembered, to be read only.
    """
    given = tuple(starts.inputs.items())
    formulas = any(isinstance(each, Formula) for _, each in given)
    known = tuple(starts.controller.items()) if formulas else ()
    return _TABLES.get(made, (count, given, known), lambda: _shared(loop, made, starts, count))


_TABLES = IdentityCache(16)


def _shared(loop: Loop, made: Prepared, starts: Starts, count: int) -> np.ndarray:
    times = made.fitted.period * np.arange(count + 1)
    table = np.zeros((count + 1, max(1, len(made.blocks.tables))))
    place = {name: column for column, name in enumerate(made.blocks.tables)}
    known = _controller_values(loop, starts)
    for slot, stem, signals in (("r", "reference", loop.references), ("d", "other", made.disturbances)):
        for k, signal in enumerate(signals):
            given = starts.inputs.get(signal.name)
            if given is not None and f"{slot}{k}" not in made.blocks.paths:
                _check_span(signal.name, given, float(times[-1]))
                table[:, place[f"{stem}{k}"]] = input_values(given, times, known)
            if isinstance(given, Interpolated) and f"slope{k}" in place and stem == "other":
                values = table[:, place[f"other{k}"]]
                table[:-1, place[f"slope{k}"]] = np.diff(values) / np.diff(times)
    return table


def path_table(loop: Loop, made: Prepared, starts: Starts, count: int) -> np.ndarray:
    """(count + 1, paths, N) samples of each run's own."""
    names, runs = made.blocks.paths, len(starts.initial)
    if not names:
        return np.zeros((1, 1, 1))
    times = made.fitted.period * np.arange(count + 1)
    table = np.empty((count + 1, len(names), runs))
    for row, slot in enumerate(names):
        name = source_of(slot, loop, made)
        given: Any = starts.inputs[name]
        if isinstance(given, Constant | Formula):
            # One by one: a run gets the same bits alone.
            for run, own in enumerate(starts.parameters.tolist()):
                plant = dict(zip((p.name for p in loop.plant.parameters), own, strict=True))
                table[:, row, run] = input_values(given, times, _controller_values(loop, starts) | plant)
            continue
        _check_span(name, given, float(times[-1]))
        values = np.broadcast_to(given.values, (runs, len(given.times)))
        if isinstance(given, Held):
            table[:, row, :] = values[:, np.maximum(np.searchsorted(given.times, times, side="right") - 1, 0)].T
        else:
            table[:, row, :] = np.stack([np.interp(times, given.times, each) for each in values], axis=1)
    return table


def _controller_values(loop: Loop, starts: Starts) -> dict[str, float]:
    """Parameters of the controller, in SI."""
    names = [name for name, _ in loop.wiring.parameters]
    return dict(zip(names, parameters_of(loop.wiring, starts.controller), strict=True))


def _check_span(name: str, given: Input, end: float) -> None:
    if isinstance(given, Constant | Formula):
        return
    if given.times[0] > 0.0 or (isinstance(given, Interpolated) and given.times[-1] < end - TINY):
        raise SimulationError(
            f"input '{name}' of the sampled loop",
            f"it is given from {given.times[0]:g} s to {given.times[-1]:g} s, but the run goes from 0 s to {end:g} s.",
            "Give samples for the whole run.",
        )


def _memory(loop: Loop, made: Prepared, starts: Starts, runs: int) -> dict[str, np.ndarray]:
    if made.foreign is not None and not starts.memory:
        return {name: np.full(runs, value) for name, value in made.foreign.initial.items()}
    return begun(loop, starts.memory, parameters=starts.controller, runs=runs)


def begun(
    loop: Loop, given: Mapping[str, Any], *, parameters: Mapping[str, float] | None = None, runs: int = 1
) -> dict[str, np.ndarray]:
    """(N,) by name where they do not begin at 0: states of estimator and controller, and driven inputs, in SI.

    Args:
        loop: with a processor. given: (N,) or numbers by name; estimates too, of an estimator that can start at them.
        parameters: of the controller by name, where other than its own. runs: N.

    Raises:
        SimulationError: names that the controller does not have, values that are not finite.
    """
    wiring = loop.wiring
    estimator = wiring.injected
    if estimator is None and not given:
        return {}
    names = [s.name for s in wiring.memory]
    shown = [] if estimator is None else [s.name for s in estimator.system.outputs]
    known = (*names, *shown, *(s.name for s in wiring.driven))
    unknown = [name for name in given if name not in known]
    if unknown:
        raise SimulationError(
            "initial state of the controller",
            f"there is no {', '.join(unknown)}.",
            f"Known: {', '.join(dict.fromkeys(known)) or 'none'}.",
        )
    found = {name: np.broadcast_to(np.asarray(value, dtype=float), (runs,)) for name, value in given.items()}
    if not all(np.isfinite(values).all() for values in found.values()):
        raise SimulationError("initial state of the controller", "a value is not a finite number.")
    if estimator is None:
        return found
    numbers = parameters_of(wiring, parameters or {})
    return _started(estimator, numbers, runs, {name: found.get(name, 0.0) for name in shown}) | found


def _started(
    estimator: LinearInjection, numbers: list[float], runs: int, shown: Mapping[str, Any]
) -> dict[str, np.ndarray]:
    """The estimator's states for the estimates wanted at the start."""
    symbols = [sp.Symbol(name, real=True) for name in shown]
    own = [s.name for s in estimator.system.states]
    values = dict(zip(estimator.system.parameter_symbols, numbers, strict=False))
    expressions = [expression.xreplace(values) for expression in estimator.start]
    evaluate = to_python(kernel("start", symbols, dict(zip(own, expressions, strict=True))))
    if all(np.ndim(value) == 0 for value in shown.values()):
        row = evaluate(*(float(value) for value in shown.values()))
        return {name: np.full(runs, value) for name, value in zip(own, row, strict=True)}
    # One by one: a run gets the same bits alone.
    rows = np.stack([np.broadcast_to(np.asarray(value, dtype=float), (runs,)) for value in shown.values()], axis=1)
    columns = np.array([evaluate(*row) for row in rows.tolist()])
    return dict(zip(own, columns.T, strict=True))
