"""A fan chart: how a signal spreads over time in many runs."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ulna.base import UlnaError
from ulna.campaign import Fan
from ulna.plot.style import INK, MUTED, axis_label, colour, dress, new_figure, set_legend


def plot_fan(fan: Fan, *, title: str = "") -> Figure:
    """Return the quantiles of a signal over time: bands between those that belong together, a line for the median.

    Raises:
        UlnaError: fewer than two levels, or a fan without a finite value.
    """
    order = np.argsort(fan.levels)
    levels, rows = np.asarray(fan.levels)[order], fan.values[order]
    if len(levels) < 2 or not np.isfinite(rows).any():
        raise UlnaError(f"a fan chart of '{fan.signal}'", "expected at least two levels and a finite value.")
    figure = new_figure(7.2, 3.9)
    axes = figure.add_subplot()
    dress(axes)
    pairs = len(levels) // 2
    for place in range(pairs):
        low, high = rows[place], rows[-1 - place]
        share = levels[-1 - place] - levels[place]
        axes.fill_between(
            fan.times,
            low,
            high,
            color=colour(0),
            alpha=0.14 + 0.3 * place / pairs,
            linewidth=0,
            label=f"{share:.0%} of the runs",
        )
    if len(levels) % 2:
        middle = len(levels) // 2
        name = "median" if np.isclose(levels[middle], 0.5) else f"quantile {levels[middle]:g}"
        axes.plot(fan.times, rows[middle], color=colour(0), linewidth=1.9, label=name)
    axes.set_xlim(float(fan.times[0]), float(fan.times[-1]))
    axes.set_xlabel(axis_label("time", "s"), color=INK)
    axes.set_ylabel(axis_label(fan.signal, fan.unit), color=INK)
    if fan.early:
        axes.annotate(
            f"{fan.early} of {fan.runs} runs ended early",
            (0.99, 0.02),
            xycoords="axes fraction",
            ha="right",
            fontsize=8.5,
            color=MUTED,
        )
    set_legend(figure, axes, title)
    return figure
