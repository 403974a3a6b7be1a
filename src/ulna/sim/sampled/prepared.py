"""A loop with a processor made ready: blocks, source, compiled function, and the numbers that fill it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from ulna.base import SimulationError
from ulna.loop import Fitted, Loop
from ulna.loop.flow import flow
from ulna.loop.pulses import STEPS
from ulna.loop.step import step
from ulna.program import compiled
from ulna.sim.cache import IdentityCache
from ulna.sim.sampled.blocks import Blocks, blocks
from ulna.sim.sampled.engine import FixedSteps
from ulna.sim.sampled.foreign import ForeignStep
from ulna.sim.sampled.source import loop_source
from ulna.system import Signal

LANES = 40
"""Runs of a block: five vector registers full. With 32 every 16th row of numbers falls on the same place in the
processor's first cache, which costs a quarter."""

HEAD = ("code", "end")
"""First columns of the results."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """What of the inputs shapes the source.

    Attributes:
        formulas: plant inputs that are formulas of time. ramps: whether disturbances change between samples.
        paths: slots that are read from samples of each run's own.
    """

    formulas: tuple[tuple[str, sp.Expr], ...] = ()
    ramps: bool = False
    paths: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prepared:
    """A loop that can run.

    Attributes:
        fitted: hardware and wiring. blocks: what a run does. disturbances: those that are slots.
        foreign: what computes the samples, where the kernels do not.
        run: the compiled function. numbers: its numbers, in order. steps: the place of that of the plant's steps.
        stretch: the longest one of constant input, over the period.
        results: slots handed back at the end of a run, after code and end. record: slots kept at every sample.
        series: (row of the record, role, signal) of what a trajectory shows besides states, inputs and outputs.
        rows: of the record by slot.
    """

    fitted: Fitted
    blocks: Blocks
    disturbances: tuple[Signal, ...]
    foreign: ForeignStep | None
    run: Callable[..., Any]
    numbers: np.ndarray
    steps: int
    stretch: float
    results: tuple[str, ...]
    record: tuple[str, ...]
    series: tuple[tuple[int, str, Signal], ...]
    rows: Mapping[str, int]

    def columns(self, results: np.ndarray) -> dict[str, np.ndarray]:
        """The results by name, (N,) each."""
        return dict(zip((*HEAD, *self.results), results.T, strict=True))


_PREPARED = IdentityCache(64)


def prepared(
    loop: Loop,
    engine: FixedSteps,
    shape: Shape,
    parameters: Mapping[str, float],
    *,
    lanes: int,
    record: tuple[str, ...] | None = (),
) -> Prepared:
    """The loop made ready, remembered by the identity of the loop.

    Args:
        loop: with a processor. engine: steps, bound and device. shape: of the inputs.
        parameters: SI values of the controller's parameters. lanes: runs side by side.
        record: slots to keep at every sample; None for all of interest.

    Raises:
        SimulationError: options that fit nothing. OptionalDependencyError: without Numba.
    """
    key = (engine, shape, tuple(sorted(parameters.items())), lanes, record)
    return _PREPARED.get(loop, key, lambda: _prepare(loop, engine, shape, parameters, lanes, record))


def _prepare(
    loop: Loop,
    engine: FixedSteps,
    shape: Shape,
    parameters: Mapping[str, float],
    lanes: int,
    record: tuple[str, ...] | None,
) -> Prepared:
    found, formulas = loop.fit(parameters), dict(shape.formulas)
    free = tuple(s for s in loop.disturbances if s.name not in formulas)
    moving = flow(found, engine.steps, formulas, ramps=shape.ramps)
    foreign = engine.processor.step_of(loop) if engine.processor is not None else None
    if foreign is not None:
        if parameters:
            raise SimulationError(
                f"parameter '{next(iter(parameters))}'",
                "the controller's numbers are compiled already.",
                "Export it anew with these.",
            )
        foreign.link()
    made = blocks(
        found,
        step(found),
        moving,
        disturbances=len(free),
        paths=shape.paths,
        ramps=shape.ramps,
        bound=engine.bound,
        foreign=foreign,
    )
    results, kept = _results(found), recorded(found) if record is None else record
    source, names = loop_source(made, results, kept, lanes=lanes, gpu=engine.device is not None)
    return Prepared(
        fitted=found,
        blocks=made,
        disturbances=free,
        foreign=foreign,
        run=compiled(source),
        numbers=np.array([*(made.numbers[name] for name in names), 0.0]),
        steps=names.index(STEPS),
        stretch=moving.stretch,
        results=results,
        record=kept,
        series=_series(loop, kept),
        rows={name: row for row, name in enumerate(kept)},
    )


def recorded(loop: Fitted) -> tuple[str, ...]:
    """Slots worth keeping at a sample: time, states, memory, measured values, estimates, commands, what was applied."""
    wiring = loop.wiring
    shown = {s.name for s in wiring.estimates}
    names = ["time", *(f"x{k}" for k in range(len(wiring.plant.states)))]
    names += [f"z{k}" for k, s in enumerate(wiring.memory) if s.name not in shown]
    names += [f"yn{k}" for k in range(len(wiring.measured))]
    names += [f"e{k}" for k in range(len(wiring.estimates))]
    for k in range(len(wiring.driven)):
        names += [f"c{k}", f"h{k}_0", f"ub{k}"] + ([f"ua{k}"] if loop.split else [])
    names += ["code"] if loop.hardware.watches else []
    return (*names, *(f"hit{k}" for k in range(len(loop.walls))))


def _series(loop: Loop, record: tuple[str, ...]) -> tuple[tuple[int, str, Signal], ...]:
    """Commands, limited commands, measured values, estimates and the controller's states; a name once."""
    wiring, rows = loop.wiring, {name: row for row, name in enumerate(record)}
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
            name, row = label.format(signal.name), rows.get(slot.format(k))
            if row is not None:
                found.setdefault(name, (row, role, Signal(name=name, unit=signal.unit, text=signal.text)))
    if "code" in rows:
        found.setdefault("fault", (rows["code"], "fault", Signal(name="fault", text="fault code of the processor")))
    return tuple(found.values())


def _results(loop: Fitted) -> tuple[str, ...]:
    wiring = loop.wiring
    names = [f"x{k}" for k in range(len(wiring.plant.states))]
    for k in range(len(wiring.driven)):
        names += [f"peak{k}", f"square{k}"]
    for k in range(len(wiring.plant.outputs)):
        names += [f"{stem}{k}" for stem in ("last", "first", "least", "most", "settled")]
    return (*names, "pace")
