"""What a control engineer reads off a run: how far over, how fast, how exact, at what effort."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ulna.cli.asked_events import target_of
from ulna.cli.asked_run import Run

if TYPE_CHECKING:
    from ulna.sim import InputMetrics, OutputMetrics, Trajectory


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


def figures_of(asked: Run, trajectory: Trajectory) -> RunFigures | None:
    """The figures of a run under a controller; None of a plant alone or with an observer only."""
    from ulna.sim import input_metrics, output_metrics
    from ulna.system import controlled_part

    loop = asked.loop
    driven = () if loop.controller is None else loop.wiring.driven
    if not driven or len(trajectory.times) < 2:
        return None
    targets, outputs, following = {}, {}, {}
    for signal in controlled_part(loop.plant).outputs:
        name = signal.name
        reference = asked.inputs.get(f"{name}_ref")
        values = trajectory[name]
        if reference is None or isinstance(reference, float):
            targets[name] = target_of(asked, name)
            outputs[name] = output_metrics(trajectory.times, values, targets[name])
        else:
            error = values - _along(reference, trajectory)
            following[name] = (float(abs(error).max()), float(error[-1]))
    inputs = {s.name: input_metrics(trajectory.times, trajectory[s.name]) for s in driven}
    return RunFigures(targets=targets, outputs=outputs, inputs=inputs, following=following)


def _along(reference: object, trajectory: Trajectory) -> object:
    """(N,) the values of a reference that is a formula of time."""
    from ulna.sim import as_input, input_values

    return input_values(as_input("reference", reference), trajectory.times, trajectory.parameters)


def figure_lines(found: RunFigures, units: Mapping[str, str]) -> Iterator[str]:
    """A sentence for each output and input."""
    for name, each in found.outputs.items():
        target = _with_unit(found.targets[name], units.get(name))
        if math.isnan(each.settling_time):
            yield (
                f"{name} starts on its target {target}; it moves off it by at most "
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
    from dataclasses import asdict

    return {
        "outputs": {name: {"target": found.targets[name]} | asdict(each) for name, each in found.outputs.items()},
        "following": {name: {"largest": a, "last": b} for name, (a, b) in found.following.items()},
        "inputs": {name: asdict(each) for name, each in found.inputs.items()},
    }
