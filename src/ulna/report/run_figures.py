"""What a control engineer reads off a run: how far over, how fast, how exact, at what effort."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from ulna.loop import Loop
from ulna.sim import (
    InputMetrics,
    OutputMetrics,
    Trajectory,
    as_input,
    input_metrics,
    input_values,
    output_metrics,
    rest_values,
)
from ulna.system import System, controlled_part, out_of_range


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFigures:
    """Figures of the outputs that a controller holds, and of the inputs that it drives, by name.

    Attributes:
        targets: SI, where each output is to end: its constant reference, else where the plant is held.
        outputs: how it went there. inputs: what it took.
        following: of each output that follows a moving reference the largest and the last deviation, SI.
    """

    targets: Mapping[str, float]
    outputs: Mapping[str, OutputMetrics]
    inputs: Mapping[str, InputMetrics]
    following: Mapping[str, tuple[float, float]]


def target_of(loop: Loop, name: str, inputs: Mapping[str, Any], parameters: Mapping[str, float]) -> float:
    """Where an output or state is to end, SI: its constant reference, else where the plant is held at rest."""
    reference = inputs.get(f"{name}_ref")
    if isinstance(reference, float):
        return reference
    return rest_values(loop.plant.with_parameters(parameters)).get(name, 0.0)


def figures_of(
    loop: Loop, trajectory: Trajectory, *, inputs: Mapping[str, Any], parameters: Mapping[str, float]
) -> RunFigures | None:
    """The figures of a run under a controller; None of a plant alone or with an observer only.

    Args:
        loop, trajectory: what ran and how. inputs, parameters: what the run was given, SI by name.
    """
    driven = () if loop.controller is None else loop.wiring.driven
    if not driven or len(trajectory.times) < 2:
        return None
    targets, outputs, following = {}, {}, {}
    for signal in controlled_part(loop.plant).outputs:
        name = signal.name
        reference = inputs.get(f"{name}_ref")
        values = trajectory[name]
        if reference is None or isinstance(reference, float):
            targets[name] = target_of(loop, name, inputs, parameters)
            outputs[name] = output_metrics(trajectory.times, values, targets[name])
        else:
            error = values - _along(reference, trajectory)
            following[name] = (float(abs(error).max()), float(error[-1]))
    efforts = {s.name: input_metrics(trajectory.times, trajectory[s.name]) for s in driven}
    return RunFigures(targets=targets, outputs=outputs, inputs=efforts, following=following)


def levels_of(loop: Loop, figures: RunFigures | None) -> dict[str, list[float]]:
    """By signal what a drawing of the run marks: set points, limits, end stops, SI."""
    levels = {name: [target] for name, target in (figures.targets if figures else {}).items()}
    for name, limit in loop.saturation.items():
        levels[name] = [end for end in (limit.lower, limit.upper) if abs(end) < math.inf]
    for stop in () if loop.hardware is None else loop.hardware.end_stops:
        levels[stop.position] = [stop.lower, stop.upper]
    # A state that the output repeats has the panel.
    states = {s.name for s in loop.plant.states}
    for output, readout in zip(loop.plant.outputs, loop.plant.inline(loop.plant.readouts), strict=True):
        if output.name in levels and str(readout) in states:
            levels.setdefault(str(readout), levels[output.name])
    return levels


def ranges_left(plant: System, trajectory: Trajectory) -> Iterator[str]:
    """A sentence for each state and input that leaves the range that the plant declares; the run goes on."""
    for signal in (*plant.states, *plant.inputs):
        if beyond := out_of_range(signal, trajectory[signal.name]):
            yield f"{signal.name} leaves its declared range: {beyond}"


def _along(reference: object, trajectory: Trajectory) -> object:
    """(N,) the values of a reference that is a formula of time."""
    return input_values(as_input("reference", reference), trajectory.times, trajectory.parameters)


def figure_lines(found: RunFigures, units: Mapping[str, str]) -> Iterator[str]:
    """A sentence for each output and input."""
    for name, each in found.outputs.items():
        target = _with_unit(found.targets[name], units.get(name))
        if math.isnan(each.settling_time):
            yield (
                f"{name} starts at its target {target}; it deviates by at most "
                f"{_with_unit(each.peak_error, units.get(name))}"
            )
            continue
        settled = (
            f"settles (2 %) in {each.settling_time:.4g} s" if math.isfinite(each.settling_time) else "does not settle"
        )
        yield (
            f"{name} to {target}: {settled}, overshoot {100 * each.overshoot:.3g} %, "
            f"error at the end {_with_unit(without_dust(each.steady_error, each.peak_error), units.get(name))}"
        )
    for name, (largest, last) in found.following.items():
        yield (
            f"{name} follows its reference within {_with_unit(largest, units.get(name))}, "
            f"error at the end {_with_unit(without_dust(last, largest), units.get(name))}"
        )
    for name, each in found.inputs.items():
        unit = units.get(name)
        yield f"{name}: effort {_with_unit(each.rms, unit)} RMS, at most {_with_unit(each.peak, unit)}"


def without_dust(value: float, size: float) -> float:
    """The value, 0 where it is rounding beside what it belongs to: nobody reads -7.6e-17."""
    return 0.0 if abs(value) < 1e-12 * abs(size) else value


def _with_unit(value: float, unit: str | None) -> str:
    return f"{value:.4g}{f' {unit}' if unit and unit != '1' else ''}"


def figure_data(found: RunFigures) -> dict[str, object]:
    """The same for machines; infinite where an output does not settle."""
    return {
        "outputs": {name: {"target": found.targets[name]} | asdict(each) for name, each in found.outputs.items()},
        "following": {name: {"largest": a, "last": b} for name, (a, b) in found.following.items()},
        "inputs": {name: asdict(each) for name, each in found.inputs.items()},
    }
