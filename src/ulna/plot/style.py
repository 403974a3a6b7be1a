"""One look for every figure: colours, weights, axes; set on the objects, never in Matplotlib's global state."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

PALETTE: Final = ("#0B4F9E", "#E36A0E", "#1E8A5B", "#A8478A", "#B8860B", "#4C5FC0", "#5A5A5A")
"""Line colours, for every common colour blindness; the first three differ in lightness too, for grey print."""

DASHES: Final = ("solid", (0, (5, 2)), (0, (1.2, 1.6)), (0, (5, 1.6, 1.2, 1.6)))
"""Line styles: what colour says is said a second time by the dashes where colours run out."""

INK: Final = "#1F2933"
"""Text and strong outlines."""
MUTED: Final = "#66727F"
"""Ticks, dimensions, secondary text."""
RULE: Final = "#DDE3E8"
"""Grid and faint rules."""
SURFACE: Final = "#F4F6F8"
"""Fill of bodies and of bands."""

TITLE_SIZE: Final = 11.5
LABEL_SIZE: Final = 10.0
TICK_SIZE: Final = 9.0

_DOTS: Final = 96
"""Of an inch on a page."""

_UNIT_TEXT: Final = {"": "", "1": "", "dimensionless": ""}


def colour(index: int) -> str:
    """The line colour of curve number `index`, counted from zero; starts again after the last."""
    return PALETTE[index % len(PALETTE)]


def dashes(index: int) -> str | tuple[float, tuple[float, ...]]:
    """The line style of curve number `index`, counted from zero; starts again after the last."""
    return DASHES[index % len(DASHES)]


def axis_label(quantity: str, unit: str) -> str:
    """`quantity (unit)`, or the quantity alone where there is no unit: what stands on an axis."""
    shown = _UNIT_TEXT.get(unit, unit)
    return f"{quantity} ({shown})" if shown else quantity


def new_figure(width: float, height: float) -> Figure:
    """An empty white figure of `width` × `height` inches that lays out its axes by itself and belongs to no window."""
    layout = ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.06)
    return _Shown(figsize=(width, height), layout=layout, facecolor="white")


class _Shown(Figure):
    """A figure that a notebook shows by itself, without pyplot and its state."""

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """The picture at twice the pixels that it takes on the page, for sharp screens."""
        with BytesIO() as buffer:
            self.savefig(buffer, format="png", dpi=2 * _DOTS)
            return buffer.getvalue(), {"width": round(self.get_figwidth() * _DOTS)}


def dress(axes: Axes) -> None:
    """Give axes the common look: two spines, a light grid behind the curves, quiet ticks."""
    axes.set_axisbelow(True)
    axes.grid(visible=True, color=RULE, linewidth=0.8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(MUTED)
        axes.spines[side].set_linewidth(0.8)
    axes.tick_params(colors=MUTED, labelsize=TICK_SIZE, labelcolor=INK, length=3.5, width=0.8)
    for label in (axes.xaxis.label, axes.yaxis.label):
        label.set_color(INK)
        label.set_fontsize(LABEL_SIZE)


def set_title(axes: Axes, title: str) -> None:
    """Put a left-aligned title over the axes; nothing for an empty one."""
    if title:
        axes.set_title(title, loc="left", fontsize=TITLE_SIZE, color=INK, fontweight="bold", pad=10)


def set_legend(figure: Figure, axes: Axes, title: str, further: Sequence[Axes] = ()) -> None:
    """Put title and legend above the axes, outside them, where no curve can run under them.

    What only `further` axes show is named, too.

    A figure with a single labelled curve needs no legend and gets the title alone.
    """
    named: dict[str, Any] = {}
    for each in (axes, *further):
        for handle, label in zip(*each.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    handles, labels = list(named.values()), list(named)
    if len(labels) < 2:
        set_title(axes, title)
        return
    legend = figure.legend(
        handles,
        labels,
        loc="outside upper left",
        ncols=min(len(labels), 3),
        frameon=False,
        fontsize=9.5,
        labelcolor=INK,
        handlelength=2.4,
        columnspacing=1.8,
        title=title or None,
        title_fontproperties={"weight": "bold", "size": TITLE_SIZE},
        alignment="left",
    )
    legend.get_title().set_color(INK)
