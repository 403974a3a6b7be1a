"""A map of where runs settle, over two of the varied quantities."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from ulna.base import UlnaError
from ulna.campaign import Column, SettledMap
from ulna.plot.style import INK, PALETTE, SURFACE, TICK_SIZE, axis_label, dress, new_figure, set_title

# From orange to blue: told apart by every common colour blindness, and by lightness in grey print.
_SHADES = LinearSegmentedColormap.from_list("settled", (PALETTE[1], "#F2E3D5", PALETTE[0]))


def plot_settled_map(found: SettledMap, *, title: str = "") -> Figure:
    """Return the settled part of the runs in each cell as a colour; cells without runs stay grey.

    Raises:
        UlnaError: a map without runs.
    """
    if not found.runs.any():
        raise UlnaError("a map of settled runs", "there is no run in it.")
    figure = new_figure(6.4, 4.8)
    axes = figure.add_subplot()
    dress(axes)
    axes.grid(visible=False)
    axes.set_facecolor(SURFACE)
    shown = np.ma.masked_invalid(found.fraction)
    mesh = axes.pcolormesh(found.x_edges, found.y_edges, shown, cmap=_SHADES, vmin=0.0, vmax=1.0, rasterized=True)
    axes.set_xlabel(_label(found.x), color=INK)
    axes.set_ylabel(_label(found.y), color=INK)
    bar = figure.colorbar(mesh, ax=axes, pad=0.02)
    bar.set_label("settled part of the runs", color=INK)
    bar.ax.tick_params(labelsize=TICK_SIZE, labelcolor=INK)
    set_title(axes, title)
    return figure


def _label(column: Column) -> str:
    return axis_label(column.name, column.unit)
