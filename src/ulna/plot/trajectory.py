"""Trajectories as figures: a panel for every signal, a curve for every run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from ulna.base import UlnaError
from ulna.plot.curves import Curve, Panel, plot_panels
from ulna.sim import Trajectory
from ulna.system import Signal


def plot_trajectory(trajectory: Trajectory, signals: Sequence[str] = (), *, title: str = "") -> Figure:
    """Return the signals of one run, one panel each; see `plot_trajectories`."""
    return plot_trajectories({"": trajectory}, signals, title=title or trajectory.system.name)


def plot_trajectories(runs: Mapping[str, Trajectory], signals: Sequence[str] = (), *, title: str = "") -> Figure:
    """Return the signals of several runs, one panel for each signal, one colour for each run.

    Args:
        runs: label → run; all of systems that have the signals.
        signals: names of states, outputs or inputs, from the top; none means every state and input of the first run,
            and every output that is not a state.
        title: stands over the first panel.

    Raises:
        UlnaError: no run.
        SimulationError: a run without one of the signals.
    """
    if not runs:
        raise UlnaError("a figure of trajectories", "there is no run to draw.")
    first = next(iter(runs.values()))
    names = tuple(signals) or _all_signals(first)
    panels = [
        Panel(
            quantity=name,
            unit=_unit(first, name),
            curves=tuple(
                Curve(label=label, times=run.times, values=run[name], hue=hue)
                for hue, (label, run) in enumerate(runs.items())
            ),
        )
        for name in names
    ]
    return plot_panels(panels, title=title)


def _signals(run: Trajectory) -> tuple[Signal, ...]:
    return (*run.system.states, *run.system.outputs, *run.system.inputs)


def _all_signals(run: Trajectory) -> tuple[str, ...]:
    """Every signal once; an output that only repeats a state is left out."""
    states = {signal.name for signal in run.system.states}
    repeated = {
        output.name
        for output, readout in zip(run.system.outputs, run.system.readouts, strict=True)
        if str(readout) in states
    }
    return tuple(dict.fromkeys(signal.name for signal in _signals(run) if signal.name not in repeated))


def _unit(run: Trajectory, name: str) -> str:
    return next((signal.unit or "" for signal in _signals(run) if signal.name == name), "")
