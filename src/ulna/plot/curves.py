"""Curves over time: one panel for each quantity, one curve for each run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from numpy.typing import ArrayLike

from ulna.base import UlnaError
from ulna.plot.style import INK, MUTED, axis_label, colour, dashes, dress, new_figure, set_legend


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """One curve over time.

    Attributes:
        label: what the legend says; empty for a curve without an entry.
        times: shape (k,), in s.
        values: shape (k,), in the unit of the panel it stands in.
        hue: number of its colour, counted from zero; curves that belong together share one.
        dash: number of its line style, counted from zero; 0 is solid.
        steps: each value is held until the next time, as a processor holds its outputs.
    """

    label: str
    times: ArrayLike
    values: ArrayLike
    hue: int = 0
    dash: int = 0
    steps: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """One set of axes: a quantity, its unit, and its curves; `levels` are drawn as faint horizontal lines."""

    quantity: str
    unit: str
    curves: tuple[Curve, ...]
    levels: tuple[float, ...] = ()


def plot_panels(panels: Sequence[Panel], *, title: str = "", width: float = 7.2, height: float = 0.0) -> Figure:
    """Return a figure with the panels below one another over a common time axis, and one legend above.

    Args:
        panels: at least one, each with at least one curve.
        title: stands over the first panel.
        width: of the figure, in inches.
        height: of the figure, in inches; 0 takes what the number of panels needs.

    Raises:
        UlnaError: no panel, no curve, or a curve whose times and values differ in length.
    """
    _check(panels)
    figure = new_figure(width, height or 1.2 + (2.9 if len(panels) == 1 else 1.65 * len(panels)))
    rows = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, panel in zip(rows, panels, strict=True):
        _draw(axes, panel)
    rows[-1].set_xlabel(axis_label("time", "s"), fontsize=10, color=INK)
    figure.align_ylabels(list(rows))
    set_legend(figure, rows[0], title, list(rows[1:]))
    return figure


def plot_curves(
    curves: Sequence[Curve],
    *,
    quantity: str,
    unit: str,
    title: str = "",
    levels: Sequence[float] = (),
    width: float = 7.2,
    height: float = 3.9,
) -> Figure:
    """Return one panel of curves over time; angles in rad also get a scale in degrees on the right.

    Args:
        curves: at least one.
        quantity: name on the vertical axis.
        unit: unit of the values; `"rad"` brings the second scale.
        title: stands over the axes.
        levels: values marked by faint horizontal lines (a target, an equilibrium).
        width: of the figure, in inches.
        height: of the figure, in inches.

    Raises:
        UlnaError: as `plot_panels`.
    """
    panel = Panel(quantity=quantity, unit=unit, curves=tuple(curves), levels=tuple(levels))
    figure = plot_panels((panel,), title=title, width=width, height=height)
    if unit == "rad":
        _add_degrees(figure.axes[0])
    return figure


def _check(panels: Sequence[Panel]) -> None:
    if not panels or any(not panel.curves for panel in panels):
        raise UlnaError(
            "a figure of curves over time", "there is nothing to draw.", "Give at least one curve for each panel."
        )
    for panel in panels:
        for curve in panel.curves:
            times, values = np.shape(curve.times), np.shape(curve.values)
            if times != values or len(times) != 1:
                raise UlnaError(
                    f"the curve '{curve.label}' of {panel.quantity}",
                    f"its times have shape {times} and its values {values}.",
                    "Give both the same length.",
                )


def _draw(axes: Axes, panel: Panel) -> None:
    dress(axes)
    for level in panel.levels:
        axes.axhline(level, color=MUTED, linewidth=0.9, linestyle=(0, (2, 3)), zorder=1)
    for curve in panel.curves:
        axes.plot(
            np.asarray(curve.times),
            np.asarray(curve.values),
            color=colour(curve.hue),
            linestyle=dashes(curve.dash),
            drawstyle="steps-post" if curve.steps else "default",
            linewidth=1.9 if curve.dash == 0 else 1.6,
            label=curve.label or "_nolegend_",
            solid_capstyle="round",
            zorder=3 - 0.1 * curve.dash,
        )
    last = max(float(np.asarray(curve.times)[-1]) for curve in panel.curves)
    first = min(float(np.asarray(curve.times)[0]) for curve in panel.curves)
    if last > first:
        axes.set_xlim(first, last)
    axes.margins(y=0.08)
    axes.set_ylabel(axis_label(panel.quantity, panel.unit), fontsize=10, color=INK)


def _add_degrees(axes: Axes) -> None:
    right = axes.secondary_yaxis("right", functions=(np.degrees, np.radians))
    low, high = axes.get_ylim()
    span = math.degrees(abs(high - low))
    step = next((s for s in (1, 2, 5, 10, 15, 30, 45, 90, 180, 360, 720) if span / s <= 8), 1440)
    if span >= 4:
        right.yaxis.set_major_locator(MultipleLocator(step))
    right.set_ylabel("degrees", fontsize=10, color=MUTED)
    right.tick_params(colors=MUTED, labelsize=9, length=3.5, width=0.8)
    right.spines["right"].set_visible(False)
