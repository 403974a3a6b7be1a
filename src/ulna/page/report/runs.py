"""What a report says of a run: its curves and figures, and what the hardware makes of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ulna.base import UlnaError
from ulna.loop import Loop
from ulna.page.report.formulas import cut
from ulna.page.report.hardware import hardware_rows
from ulna.page.report.quantities import number_text, with_unit
from ulna.plot import plot_trajectories, svg_text
from ulna.report import Block, Cell, Picture, Section, Table, Text, verbatim
from ulna.report.run_figures import RunFigures, figures_of, levels_of, ranges_left, without_dust
from ulna.sim import Trajectory, simulate

_TIMES = 1001
IDEAL, REAL = "without the hardware", "with the hardware"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ran:
    """Runs by label with their figures; of a loop with hardware also the one without."""

    runs: Mapping[str, Trajectory]
    figures: Mapping[str, RunFigures | None]


def ran(
    loop: Loop,
    *,
    initial: Mapping[str, float],
    inputs: Mapping[str, Any],
    parameters: Mapping[str, float],
    horizon: float,
    engine: Any = None,
    seed: int = 0,
) -> Ran:
    """The run of a loop, and beside it the run without its hardware where it has some."""
    runs: dict[str, Trajectory] = {}
    for label, body in ((REAL if loop.hardware is not None else "run", loop), (IDEAL, replace(loop, hardware=None))):
        if label == IDEAL and loop.hardware is None:
            continue
        stepped = body.sampled or body.system.discrete
        times = horizon if stepped else np.linspace(0.0, horizon, _TIMES)
        try:
            runs[label] = simulate(body, _known(body, initial), times, inputs=inputs, parameters=parameters,
                                   engine=None if stepped else engine, seed=seed, throw=False)  # fmt: skip
        except UlnaError:
            if label != IDEAL:
                raise
    figures = {label: figures_of(loop, run, inputs=inputs, parameters=parameters) for label, run in runs.items()}
    return Ran(runs=runs, figures=figures)


def _known(loop: Loop, initial: Mapping[str, float]) -> dict[str, float]:
    """Of a start what this loop has: a processor remembers more than a continuous controller."""
    if loop.sampled:
        return dict(initial)
    names = {s.name for s in loop.system.states}
    return {name: value for name, value in initial.items() if name in names}


def run_section(loop: Loop, found: Ran) -> Section:
    """Curves and figures of the runs, and the hardware."""
    return Section(anchor="run", title="A run", blocks=tuple(_run(loop, found)))


def _run(loop: Loop, found: Ran) -> Iterator[Block]:
    for label, run in found.runs.items():
        start = ", ".join(f"{s.name} = {with_unit(float(run[s.name][0]), s.unit)}" for s in loop.plant.states)
        note = f" {run.note}" if run.note else ""
        yield Text(text=verbatim(f"{label.capitalize()}, from {start}: {run.outcome.text}{note}"))
        yield from (Text(text=verbatim(f"{label.capitalize()}: {told}")) for told in ranges_left(loop.plant, run))
    figures = found.figures[next(iter(found.runs))]
    runs = found.runs if len(found.runs) > 1 else {"": next(iter(found.runs.values()))}
    yield Picture(
        svg=svg_text(plot_trajectories(runs, levels=levels_of(loop, figures)), prefix="run-"),
        caption="The run in SI units; faint lines are set points and limits, dashed lines estimates and references.",
        description="A panel of curves over time for every state and input.",
    )
    yield from _figures(found)
    if loop.hardware is not None:
        rows = tuple((verbatim(name), cut(told)) for name, told in hardware_rows(loop))
        yield Table(head=("", "as built"), rows=rows, caption="The hardware")


def _figures(found: Ran) -> Iterator[Block]:
    outputs: list[tuple[Cell, ...]] = []
    inputs: list[tuple[Cell, ...]] = []
    for label, each in found.figures.items():
        if each is None:
            continue
        for name, way in each.outputs.items():
            error = without_dust(way.steady_error, way.peak_error)
            shown = (each.targets[name], way.settling_time, 100 * way.overshoot, error)
            outputs.append((label, cut(name), *map(_number, shown)))
        for name, (largest, last) in each.following.items():
            outputs.append((label, cut(name), "its reference", "–", f"within {number_text(largest)}", _number(last)))
        inputs += [(label, cut(name), _number(i.rms), _number(i.peak)) for name, i in each.inputs.items()]
    if outputs:
        head = ("", "output", "target", "settles within 2 % (s)", "overshoot (%)", "error at the end")
        yield Table(head=head, rows=tuple(outputs), caption="How it went", numeric=frozenset(range(2, 6)))
    if inputs:
        yield Table(
            head=("", "input", "RMS", "peak"), rows=tuple(inputs), caption="What it took", numeric=frozenset((2, 3))
        )


def _number(value: float) -> str:
    return "never" if math.isinf(value) else number_text(value)
