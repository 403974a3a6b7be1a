"""`plot_phase`: two states of a plant in the plane: its field, where each rate vanishes, and where it rests."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ulna.base import PlantError, UlnaError
from ulna.plants import PlantLike, as_plant
from ulna.plot.style import INK, MUTED, axis_label, colour, dress, new_figure, set_legend
from ulna.program import to_numpy
from ulna.sim import Trajectory
from ulna.symbolic.compiling import kernel
from ulna.system import (
    Equilibrium,
    Signal,
    System,
    declared_range,
    equilibria,
    equilibrium,
    linearise,
    require_continuous,
)

_GRID, _FINE = 24, 160
_ROOM = 1.6
"""The picture is so much larger than what stands in it."""

Range = tuple[float, float]


def plot_phase(
    plant: PlantLike,
    states: Sequence[str] = (),
    within: Mapping[str, Range] | None = None,
    *,
    inputs: Mapping[str, float] | None = None,
    runs: Sequence[Trajectory] = (),
    title: str = "",
    width: float = 6.4,
) -> Figure:
    """Return the phase plane of two states: stream lines of the field, nullclines, equilibria, and runs if given.

    Other states stay at the operating point. Filled equilibria are stable, hollow ones not; with other states than the
    two, those are drawn where all rates vanish.

    Args:
        plant: in continuous time; a system, its name or file, or a closed loop. All parameters need values.
        states: names of the horizontal and the vertical one; the first two if left out.
        within: (lower, upper) by state, SI; left out the declared range, an angle one turn, else what holds the
            equilibria and runs with some room.
        inputs: SI by name, held; left out what they are at the operating point.
        runs: drawn over the field.
        title: stands over the axes. width: of the figure, in inches.

    Raises:
        PlantError: fewer than two states, an unknown name, a parameter without a value, a plant in discrete time.
        UlnaError: an empty range.

    Examples:
        >>> figure = ulna.plot_phase("duffing", within={"x1": (-2, 2), "x2": (-2, 2)})
        >>> [figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()]
        ['x1', 'x2']
    """
    system = as_plant(plant).with_values()
    require_continuous(system)
    shown = _shown(system, states)
    point = equilibrium(system)
    held = {s.name: point[s.name] for s in (*system.states, *system.inputs)} | dict(inputs or {})
    asked = dict(within or {})
    unknown = [name for name in asked if name not in {s.name for s in system.states}]
    if unknown:
        raise PlantError(f"the phase plane of '{system.name}'", f"it has no state {', '.join(unknown)}.")
    rest = _rest(system, asked, held)
    box = [asked.get(s.name) or _range(s, rest, runs) for s in shown]
    for signal, (lower, upper) in zip(shown, box, strict=True):
        if not lower < upper:
            raise UlnaError(f"the range of '{signal.name}'", f"({lower:g}, {upper:g}) is empty.", "Swap the two.")
    figure = new_figure(width, 0.85 * width)
    axes = figure.subplots()
    dress(axes)
    axes.grid(visible=False)
    _draw_field(axes, system, shown, box, held)
    _draw_rest(axes, shown, rest)
    for run in runs:
        axes.plot(run[shown[0].name], run[shown[1].name], color=INK, linewidth=1.7, zorder=4)
        axes.plot(run[shown[0].name][:1], run[shown[1].name][:1], "o", color=INK, markersize=4, zorder=4)
    axes.set_xlim(*box[0])
    axes.set_ylim(*box[1])
    axes.set_xlabel(axis_label(shown[0].name, shown[0].unit), fontsize=10, color=INK)
    axes.set_ylabel(axis_label(shown[1].name, shown[1].unit), fontsize=10, color=INK)
    set_legend(figure, axes, title or system.name)
    return figure


def _shown(system: System, names: Sequence[str]) -> tuple[Signal, Signal]:
    known = {s.name: s for s in system.states}
    chosen = list(names or known)[:2] if len(known) > 1 else []
    asked = f"the phase plane of '{system.name}'"
    if len(chosen) != 2 or len(names) not in (0, 2) or len(set(chosen)) != 2:
        hint = "Name two of its states." if len(known) > 1 else "Plot its states over time: run.plot()."
        raise PlantError(asked, f"states {', '.join(names) or ', '.join(known)}.", hint)
    unknown = [name for name in chosen if name not in known]
    if unknown:
        raise PlantError(asked, f"it has no state {', '.join(unknown)}.", f"Known: {', '.join(known)}.")
    return known[chosen[0]], known[chosen[1]]


def _rest(system: System, within: Mapping[str, Range], held: Mapping[str, float]) -> tuple[Equilibrium, ...]:
    """The equilibria with the inputs held; none where they cannot be looked for."""
    try:
        return equilibria(system, within, {s.name: held[s.name] for s in system.inputs}, seconds=2.0).points
    except UlnaError:
        return ()


def _range(signal: Signal, rest: Sequence[Equilibrium], runs: Sequence[Trajectory]) -> Range:
    declared = declared_range(signal)
    if declared is not None and all(map(math.isfinite, declared)):
        return declared
    marks = [p[signal.name] for p in rest] + [
        float(v) for run in runs for v in (run[signal.name].min(), run[signal.name].max())
    ]
    lower, upper = min(marks, default=0.0), max(marks, default=0.0)
    least = math.pi if signal.unit == "rad" else 1.0
    half = max(least, _ROOM * (upper - lower) / 2)
    return (lower + upper) / 2 - half, (lower + upper) / 2 + half


def _draw_field(
    axes: Axes, system: System, shown: Sequence[Signal], box: Sequence[Range], held: Mapping[str, float]
) -> None:
    symbols = [*system.state_symbols, *system.input_symbols]
    place = {s.name: e for s, e in zip(system.states, system.inline(system.rates), strict=True)}
    evaluate = to_numpy(kernel(f"field of {system.name}", symbols, {s.name: place[s.name] for s in shown}))

    def rates(count: int) -> tuple[Any, Any, list[np.ndarray]]:
        across, up = (np.linspace(*sides, count) for sides in box)
        plane = dict(zip((s.name for s in shown), np.meshgrid(across, up), strict=True))
        values = evaluate(*(plane.get(s.name, held[s.name]) for s in symbols))
        return across, up, [np.ma.masked_invalid(each) for each in values]

    across, up, flow = rates(_GRID)
    axes.streamplot(across, up, *flow, color=MUTED, linewidth=0.7, density=1.2, arrowsize=0.8, zorder=1)
    across, up, levels = rates(_FINE)
    for k, (signal, level) in enumerate(zip(shown, levels, strict=True)):
        if level.min() < 0 < level.max():
            axes.contour(across, up, level, levels=[0.0], colors=[colour(k)], linewidths=1.8, zorder=3)
            axes.add_line(Line2D([], [], color=colour(k), linewidth=1.8, label=f"{signal.name}' = 0"))


def _draw_rest(axes: Axes, shown: Sequence[Signal], rest: Sequence[Equilibrium]) -> None:
    told = set()
    for point in rest:
        stable = linearise(point).stable
        label = "stable equilibrium" if stable else "equilibrium, not shown stable"
        axes.plot(
            [point[shown[0].name]],
            [point[shown[1].name]],
            "o",
            markersize=8,
            markeredgewidth=1.8,
            markeredgecolor=INK,
            markerfacecolor=INK if stable else "white",
            linestyle="none",
            label="_nolegend_" if label in told else label,
            zorder=5,
        )
        told.add(label)
