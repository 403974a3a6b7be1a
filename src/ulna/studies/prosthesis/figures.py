"""The figures of the comparison."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from ulna.plot import Curve, Panel, plot_panels
from ulna.plot.style import INK, MUTED, colour, dress, new_figure
from ulna.studies.prosthesis.comparison import Comparison
from ulna.studies.prosthesis.demonstration import Demonstration
from ulna.studies.prosthesis.tasks import Task
from ulna.studies.prosthesis.trial import ANGLE, CURRENT

_EVERY = 10
SHOWN_ERROR = 2.0
"""Degrees at which curves of error are cut, so that one lost controller does not hide the others."""


def task_figure(found: Comparison, key: str) -> Figure:
    """Angle, error and current of every contender at one task on the nominal plant; errors are cut at `SHOWN_ERROR`."""
    task = next(t for t in found.tasks if t.key == key)
    times = task.times[::_EVERY]
    angles = [Curve(label="wanted", times=times, values=_degrees(task.reference[0]), hue=6, dash=2)]
    errors, currents = [], []
    for hue, contender in enumerate(found.contenders):
        run = found.entries[contender.key, key].nominal
        dash = 0 if contender.proposed else 1
        angles.append(Curve(label=contender.title, times=times, values=_degrees(run[ANGLE][0]), hue=hue, dash=dash))
        error = np.clip(_degrees(run[ANGLE][0] - task.reference[0]), -SHOWN_ERROR, SHOWN_ERROR)
        errors.append(Curve(label="", times=times, values=error, hue=hue, dash=dash))
        currents.append(Curve(label="", times=times, values=run[CURRENT][0, ::_EVERY], hue=hue, dash=dash))
    return plot_panels(
        (
            Panel(quantity="angle", unit="deg", curves=tuple(angles)),
            Panel(quantity="error", unit="deg", curves=tuple(errors)),
            Panel(quantity="current", unit="A", curves=tuple(currents)),
        ),
        height=7.2,
    )


def spread_figure(found: Comparison) -> Figure:
    """RMS error of every contender at every task: median to 95 of 100 plants as a line, nominal as a ring."""
    figure = new_figure(7.2, 1.0 + 0.22 * len(found.contenders) * math.ceil(len(found.tasks) / 2))
    rows = figure.subplots(math.ceil(len(found.tasks) / 2), 2, sharex=True, sharey=True, squeeze=False)
    for axes, task in zip(rows.ravel(), found.tasks, strict=False):
        _draw_spread(found, task, axes)
    for axes in rows[-1]:
        axes.set_xlabel("RMS error (deg)", fontsize=9, color=INK)
    return figure


def demonstration_figure(shown: Demonstration) -> Figure:
    """Muscle signals, activations, and the angle wanted and reached."""
    times = shown.times
    names = ("flexor", "extensor")
    scale, unit = (1e3, "mV") if shown.unit == "V" else (1.0, "")
    raw = [Curve(label=name, times=times, values=scale * shown.samples[:, k], hue=k) for k, name in enumerate(names)]
    active = [Curve(label="", times=times, values=shown.activation[:, k], hue=k) for k in range(2)]
    wanted = Curve(label="", times=times, values=np.degrees(shown.wanted), hue=6, dash=2)
    reached = Curve(label="", times=times, values=np.degrees(shown.reached), hue=2)
    return plot_panels(
        (
            Panel(quantity="muscles", unit=unit, curves=tuple(raw)),
            Panel(quantity="activation", unit="", curves=tuple(active)),
            Panel(quantity="angle", unit="deg", curves=(wanted, reached)),
        )
    )


def _degrees(values: np.ndarray) -> np.ndarray:
    return np.degrees(values[::_EVERY])


def _draw_spread(found: Comparison, task: Task, axes) -> None:  # noqa: ANN001 (Matplotlib's axes)
    dress(axes)
    titles = [c.title for c in found.contenders]
    for row, contender in enumerate(found.contenders):
        entry = found.entries[contender.key, task.key]
        low, high = (max(1e-3, entry.quantile("rms_error", share)) for share in (0.5, 0.95))
        axes.plot([low, high], [row, row], color=colour(row), linewidth=3.5, solid_capstyle="round")
        nominal = max(1e-3, entry.nominal_value("rms_error"))
        axes.plot([nominal], [row], "o", markersize=5, markerfacecolor="white", color=colour(row))
    axes.set_xscale("log")
    # No ticks between the decades: they cost most of the drawing time.
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_yticks(range(len(titles)), titles, fontsize=8)
    axes.invert_yaxis() if not axes.yaxis_inverted() else None
    axes.set_title(task.title, loc="left", fontsize=9, color=MUTED)
