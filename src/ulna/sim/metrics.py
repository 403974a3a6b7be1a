"""`metrics`: what a control engineer reads off a run: how fast, how far over, how exact, at what effort."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import astuple, dataclass
from types import MappingProxyType

import numpy as np

from ulna.base import SimulationError, html_table
from ulna.sim.figures import BAND, crossing, last_entry, output_figures
from ulna.sim.trajectory import Trajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputMetrics:
    """How one output went from its first value to its target. NaN: does not apply (it started on the target).

    Attributes:
        rise_time: s from 10 % to 90 % of the way, first crossings; infinite if 90 % is never reached.
        overshoot: farthest beyond the target as a fraction of the way; 0 if it never passes the target.
        settling_time: s from the start until it stays within 2 % of the way around the target; infinite if it does
            not by the end.
        steady_error: last value − target, in SI.
        peak_error: largest |value − target|, in SI.
    """

    rise_time: float
    overshoot: float
    settling_time: float
    steady_error: float
    peak_error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class InputMetrics:
    """The effort on one input, in SI. peak: largest |u|; rms: √(mean of u² over time)."""

    peak: float
    rms: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Metrics:
    """Figures of a run for each output and each input, by name.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> run = ulna.simulate(spring, [1, 0], np.linspace(0, 60, 6001))
        >>> round(ulna.metrics(run).outputs["y"].settling_time, 2)
        14.66
    """

    outputs: Mapping[str, OutputMetrics]
    inputs: Mapping[str, InputMetrics]

    def _repr_html_(self) -> str:
        """Two tables for notebooks: a row for each output, a row for each input."""
        ways = [
            (name, *("does not apply" if math.isnan(v) else v for v in astuple(each)))
            for name, each in self.outputs.items()
        ]
        efforts = [(name, *astuple(each)) for name, each in self.inputs.items()]
        names = ("output", "rise time [s]", "overshoot", "settling time [s]", "steady error", "peak error")
        tables = [(ways, names), (efforts, ("input", "peak", "RMS"))]
        return "".join(html_table(rows, headings=headings) for rows, headings in tables if rows)


def metrics(
    trajectory: Trajectory, *, targets: Mapping[str, float] | None = None, effort: tuple[str, ...] = ()
) -> Metrics:
    """Rise, overshoot, 2 % settling, steady and peak error of each output; peak and RMS of each input.

    Between samples values are joined by straight lines: ask `simulate` for enough times (some 50 a rise time give
    three digits).

    Args:
        trajectory: the run.
        targets: by output name where it should end, in SI; 0 where left out.
        effort: further signals to report as inputs: a closed loop has its plant's input among its outputs.

    Raises:
        SimulationError: an unknown name.

    Examples:
        >>> law = ulna.state_feedback("duffing", [-1, -2])
        >>> run = ulna.simulate(ulna.close_loop("duffing", law), [1, 0], np.linspace(0, 10, 1001))
        >>> ulna.metrics(run).outputs["y"].overshoot
        0.0
    """
    system = trajectory.system
    wanted = dict(targets or {})
    names = [signal.name for signal in system.outputs]
    unknown = [name for name in wanted if name not in names]
    if unknown:
        raise SimulationError(
            f"metrics of '{system.name}'",
            f"targets for {', '.join(unknown)}, which are not outputs.",
            f"Its outputs: {', '.join(names) or 'none'}.",
        )
    outputs = {
        name: output_metrics(trajectory.times, trajectory.outputs[:, column], wanted.get(name, 0.0))
        for column, name in enumerate(names)
        if name not in effort
    }
    driven = [signal.name for signal in system.inputs] + list(effort)
    inputs = {name: input_metrics(trajectory.times, trajectory[name]) for name in driven}
    return Metrics(outputs=MappingProxyType(outputs), inputs=MappingProxyType(inputs))


def output_metrics(times: np.ndarray, values: np.ndarray, target: float) -> OutputMetrics:
    """The figures of one output. times: (N,) in s; values: (N,) and target in SI."""
    first, way = float(values[0]), target - float(values[0])
    settled, rise = 0.0, math.nan
    if way != 0.0:
        progress = (values - first) / way
        settled = float(last_entry(times, np.abs(progress - 1.0), BAND))
        begun, done = _first_reach(times, progress, 0.1), _first_reach(times, progress, 0.9)
        rise = done - begun if math.isfinite(done) else math.inf
    found = output_figures(
        target, first, float(values[-1]), values.min(), values.max(), settled, math.isfinite(settled)
    )
    return OutputMetrics(
        rise_time=rise,
        overshoot=float(found.overshoot),
        settling_time=math.nan if way == 0.0 else settled,
        steady_error=float(found.steady_error),
        peak_error=float(found.peak_error),
    )


def input_metrics(times: np.ndarray, values: np.ndarray) -> InputMetrics:
    """The effort on one input. times: (N,) in s; values: (N,) in SI."""
    mean_square = float(np.trapezoid(np.square(values), times)) / float(times[-1] - times[0])
    return InputMetrics(peak=float(np.abs(values).max()), rms=math.sqrt(mean_square))


def _first_reach(times: np.ndarray, progress: np.ndarray, level: float) -> float:
    reached = np.flatnonzero(progress >= level)
    if not len(reached):
        return math.inf
    after = int(reached[0])
    return float(times[0]) if after == 0 else crossing(times, progress, after - 1, level)
