"""Trajectories as figures: a panel for every signal, a curve for every run."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from ulna.base import UlnaError, UlnaWarning
from ulna.plot.curves import Curve, Panel, plot_panels
from ulna.sim import Held, Trajectory
from ulna.system import Signal


def plot_trajectory(
    trajectory: Trajectory,
    signals: Sequence[str] = (),
    *,
    title: str = "",
    levels: Mapping[str, Sequence[float]] | None = None,
) -> Figure:
    """Return the signals of one run, one panel each; see `plot_trajectories`.

    Examples:
        >>> run = ulna.simulate(ulna.model("duffing"), [1, 0], np.linspace(0, 10, 101))
        >>> [axes.get_ylabel() for axes in ulna.plot_trajectory(run, ["x1", "x2"]).axes]
        ['x1', 'x2']
    """
    return plot_trajectories({"": trajectory}, signals, title=title or trajectory.system.name, levels=levels)


def plot_trajectories(
    runs: Mapping[str, Trajectory],
    signals: Sequence[str] = (),
    *,
    title: str = "",
    levels: Mapping[str, Sequence[float]] | None = None,
) -> Figure:
    """Return the signals of several runs, one panel for each signal, one colour for each run.

    Args:
        runs: label → run; all of systems that have the signals.
        signals: names of states, outputs or inputs, from the top; none means every state and input of the first run,
            and every output that is not a state. The estimate of a state (`theta_hat`) and the reference of an output
            (`y_ref`) stand in its panel, dashed; what a processor holds is drawn as steps.
        title: stands over the first panel.
        levels: by signal, values marked by faint horizontal lines: a set point, limits.

    Raises:
        UlnaError: no run.
        SimulationError: a run without one of the signals.

    Examples:
        >>> spring, times = ulna.model("mass_spring_damper").with_values(), np.linspace(0, 9, 181)
        >>> runs = {f"from {start} m": ulna.simulate(spring, [start, 0], times) for start in (1, 2)}
        >>> figure = ulna.plot_trajectories(runs, ["y"])
    """
    if not runs:
        raise UlnaError("a figure of trajectories", "there is no run to draw.")
    first = next(iter(runs.values()))
    if any(len(run.times) == 2 and run.outcome.finished for run in runs.values()):
        warnings.warn(
            "the run keeps its start and its end only, and between them a straight line is drawn. Give the instants to "
            "be kept: simulate(loop, initial, np.linspace(0, 5, 501)).",
            UlnaWarning,
            stacklevel=2,
        )
    names = tuple(signals) or _all_signals(first)
    panels = [
        Panel(
            quantity=name,
            unit=_unit(first, name),
            curves=tuple(c for hue, (label, run) in enumerate(runs.items()) for c in _curves(run, name, label, hue)),
            levels=tuple((levels or {}).get(name, ())),
        )
        for name in names
    ]
    return plot_panels(panels, title=title)


def _curves(run: Trajectory, name: str, label: str, hue: int) -> Iterator[Curve]:
    """The signal, then its estimate and its reference where the run has them."""
    beside = _beside(run, name)
    own = label or ("run" if beside else "")
    held = run.drive.get(name)
    if isinstance(held, Held):
        end = run.times[-1]
        kept = held.times <= end
        times, values = np.append(held.times[kept], end), np.append(held.values[kept], held.values[kept][-1])
        yield Curve(label=own, times=times, values=values, hue=hue, steps=True)
    else:
        yield Curve(label=own, times=run.times, values=run[name], hue=hue)
    for dash, (each, what) in enumerate(beside.items(), start=1):
        told = f"{label}, {what}" if label else what
        yield Curve(label=told, times=run.times, values=run[each], hue=hue, dash=dash)


def _beside(run: Trajectory, name: str) -> dict[str, str]:
    """What else stands in the panel of a signal, and what the legend calls it."""
    known = {signal.name for signal in _signals(run)} | run.further.keys()
    wanted = {f"{name}_hat": "estimate", f"{name}_ref": "reference"}
    wanted |= {f"{output}_ref": "reference" for output, state in _repeated(run).items() if state == name}
    return {each: what for each, what in wanted.items() if each in known}


def _repeated(run: Trajectory) -> dict[str, str]:
    """Outputs that only repeat a state, and that state."""
    states = {signal.name for signal in run.system.states}
    readouts = zip(run.system.outputs, run.system.readouts, strict=True)
    return {output.name: str(readout) for output, readout in readouts if str(readout) in states}


def _signals(run: Trajectory) -> tuple[Signal, ...]:
    return (*run.system.states, *run.system.outputs, *run.system.inputs)


def _all_signals(run: Trajectory) -> tuple[str, ...]:
    """Every signal once; not what stands in another panel, nor slopes of a reference."""
    names = dict.fromkeys(signal.name for signal in _signals(run))
    left_out = {each for name in names for each in _beside(run, name)} | _repeated(run).keys()
    slopes = re.compile(r"_ref_d\d+$")
    return tuple(name for name in names if name not in left_out and not slopes.search(name))


def _unit(run: Trajectory, name: str) -> str:
    return next((signal.unit or "" for signal in _signals(run) if signal.name == name), "")
