"""Parts of technical drawings, on axes with equal scales: arrows, dimensions, joints, gears, circuit parts.

All lengths are in the units of the drawing; every function adds to the axes it is given and returns nothing.
"""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrowPatch, Rectangle

from ulna.plot.style import INK, MUTED, SURFACE, new_figure

Point = tuple[float, float]


def new_drawing(low: Point, high: Point, *, scale: float = 0.9) -> tuple[Figure, Axes]:
    """An empty drawing from corner `low` to corner `high`, `scale` inches a unit, without axes."""
    figure = new_figure(scale * (high[0] - low[0]), scale * (high[1] - low[1]))
    figure.set_layout_engine("none")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.axis("off")
    return figure, axes


def along(start: Point, angle: float, distance: float) -> Point:
    """The point `distance` from `start` in the direction `angle` (rad, counted counter-clockwise)."""
    return start[0] + distance * math.cos(angle), start[1] + distance * math.sin(angle)


def add_text(
    axes: Axes, at: Point, text: str, *, ink: str = INK, size: float = 12.0, align: str = "center", turn: float = 0.0
) -> None:
    """Write `text` (mathematics between dollar signs) centred in height at a point; `turn` in degrees."""
    axes.text(
        *at,
        text,
        color=ink,
        fontsize=size,
        ha=align,
        va="center",
        rotation=turn,
        rotation_mode="anchor",
        math_fontfamily="stix",
        zorder=9,
    )


def add_line(axes: Axes, *points: Point, ink: str = INK, width: float = 1.4, dashed: bool = False) -> None:
    """A line through the points."""
    xs, ys = zip(*points, strict=True)
    style = (0, (4, 3)) if dashed else "solid"
    axes.plot(xs, ys, color=ink, linewidth=width, linestyle=style, solid_capstyle="round", zorder=3)


def add_arrow(axes: Axes, tail: Point, head: Point, *, ink: str = INK, width: float = 2.0, both: bool = False) -> None:
    """A straight arrow with its point exactly at `head`; with `both`, a point at each end."""
    size = 5.5 + 4.5 * width
    style = "<|-|>" if both else "-|>"
    axes.add_patch(
        FancyArrowPatch(
            tail,
            head,
            arrowstyle=style,
            mutation_scale=size,
            color=ink,
            linewidth=width,
            shrinkA=0,
            shrinkB=0,
            zorder=7,
        )
    )


def add_arc_arrow(
    axes: Axes, centre: Point, radius: float, begin: float, end: float, *, ink: str = INK, width: float = 1.5
) -> None:
    """An arc from angle `begin` to angle `end` (rad), with an arrow's point at its end."""
    angles = np.linspace(begin, end, 60)
    xs, ys = centre[0] + radius * np.cos(angles), centre[1] + radius * np.sin(angles)
    axes.plot(xs[:-3], ys[:-3], color=ink, linewidth=width, zorder=6, solid_capstyle="butt")
    axes.add_patch(
        FancyArrowPatch(
            (xs[-6], ys[-6]),
            (xs[-1], ys[-1]),
            arrowstyle="-|>",
            mutation_scale=6.0 + 5.0 * width,
            color=ink,
            linewidth=0.0,
            shrinkA=0,
            shrinkB=0,
            zorder=7,
        )
    )


def add_dimension(
    axes: Axes, begin: Point, end: Point, text: str, *, away: float, gap: float = 0.24, size: float = 12.0
) -> None:
    """A dimension between two points, moved sideways by `away` (to the left of begin → end if positive).

    The text stands another `gap` further out.
    """
    angle = math.atan2(end[1] - begin[1], end[0] - begin[0])
    side = angle + math.pi / 2
    first, last = along(begin, side, away), along(end, side, away)
    outward = math.copysign(1.0, away)
    for point, corner in ((begin, first), (end, last)):
        add_line(axes, along(point, side, 0.12 * outward), along(corner, side, 0.08 * outward), ink=MUTED, width=0.8)
    add_arrow(axes, first, last, ink=MUTED, width=0.9, both=True)
    middle = ((first[0] + last[0]) / 2, (first[1] + last[1]) / 2)
    add_text(axes, along(middle, side, gap * outward), text, ink=INK, size=size)


def add_bar(axes: Axes, begin: Point, end: Point, width: float, *, fill: str = SURFACE, order: float = 2.0) -> None:
    """A bar with round ends, its axis from `begin` to `end`."""
    angle = math.atan2(end[1] - begin[1], end[0] - begin[0])
    bend = np.linspace(math.pi / 2, 3 * math.pi / 2, 30)
    ring = [along(begin, angle + a, width / 2) for a in bend] + [
        along(end, angle + a + math.pi, width / 2) for a in bend
    ]
    xs, ys = zip(*ring, strict=True)
    axes.fill(xs, ys, facecolor=fill, edgecolor=INK, linewidth=1.4, zorder=order)


def add_disc(axes: Axes, centre: Point, radius: float, *, fill: str = "white", order: float = 5.0) -> None:
    """A filled disc with an outline."""
    axes.add_patch(Circle(centre, radius, facecolor=fill, edgecolor=INK, linewidth=1.4, zorder=order))


def add_box(axes: Axes, centre: Point, width: float, height: float, *, fill: str = SURFACE, order: float = 5.5) -> None:
    """A filled upright rectangle with an outline."""
    corner = (centre[0] - width / 2, centre[1] - height / 2)
    axes.add_patch(Rectangle(corner, width, height, facecolor=fill, edgecolor=INK, linewidth=1.2, zorder=order))


def add_joint(axes: Axes, centre: Point, radius: float = 0.13) -> None:
    """A pivot: a ring with a dot."""
    add_disc(axes, centre, radius, order=6.0)
    add_disc(axes, centre, 0.22 * radius, fill=INK, order=6.1)


def add_wall(axes: Axes, begin: Point, end: Point, *, depth: float = 0.22, pitch: float = 0.16) -> None:
    """Fixed ground: a line from `begin` to `end` with hatching to its left."""
    length = math.hypot(end[0] - begin[0], end[1] - begin[1])
    angle = math.atan2(end[1] - begin[1], end[0] - begin[0])
    strokes = max(2, round(length / pitch))
    for index in range(strokes):
        foot = along(begin, angle, (index + 0.15) * length / strokes)
        add_line(axes, foot, along(foot, angle + math.pi / 4, depth), ink=MUTED, width=0.9)
    add_line(axes, begin, end, width=1.8)


def add_spindle(axes: Axes, begin: Point, end: Point, width: float, *, fill: str) -> None:
    """A muscle: tendons at both ends, a belly `width` across between them."""
    angle = math.atan2(end[1] - begin[1], end[0] - begin[0])
    length = math.hypot(end[0] - begin[0], end[1] - begin[1])
    part = np.linspace(0.0, 1.0, 60)
    half = 0.5 * width * (0.14 + 0.86 * np.sin(math.pi * np.clip((part - 0.12) / 0.76, 0.0, 1.0)) ** 1.4)
    left = [along(along(begin, angle, p * length), angle + math.pi / 2, h) for p, h in zip(part, half, strict=True)]
    right = [along(along(begin, angle, p * length), angle - math.pi / 2, h) for p, h in zip(part, half, strict=True)]
    xs, ys = zip(*(left + right[::-1]), strict=True)
    axes.fill(xs, ys, facecolor=fill, edgecolor=INK, linewidth=1.1, zorder=2.5)


def add_gear(axes: Axes, centre: Point, radius: float, teeth: int, *, phase: float = 0.0, fill: str = SURFACE) -> None:
    """A spur gear: pitch circle of the given radius, `phase` (rad) the direction of a tooth."""
    height = 0.5 * math.pi * radius / teeth
    corners = ((-0.29, -1.0), (-0.15, 1.0), (0.15, 1.0), (0.29, -1.0))
    ring = [
        along(centre, phase + 2 * math.pi * (tooth + turn) / teeth, radius + out * height)
        for tooth in range(teeth)
        for turn, out in corners
    ]
    xs, ys = zip(*ring, strict=True)
    axes.fill(xs, ys, facecolor=fill, edgecolor=INK, linewidth=1.2, joinstyle="round", zorder=4)


def add_resistor(axes: Axes, begin: Point, end: Point, *, width: float = 0.28) -> None:
    """A resistor (a box) in the middle of a wire."""
    angle = math.atan2(end[1] - begin[1], end[0] - begin[0])
    length = math.hypot(end[0] - begin[0], end[1] - begin[1])
    box = min(0.9, 0.6 * length)
    first, last = along(begin, angle, (length - box) / 2), along(begin, angle, (length + box) / 2)
    add_line(axes, begin, first)
    add_line(axes, last, end)
    side = angle + math.pi / 2
    corners = [along(first, side, width / 2), along(last, side, width / 2), along(last, side, -width / 2)]
    corners.append(along(first, side, -width / 2))
    xs, ys = zip(*corners, strict=True)
    axes.fill(xs, ys, facecolor=SURFACE, edgecolor=INK, linewidth=1.4, joinstyle="round", zorder=3)


def add_inductor(axes: Axes, begin: Point, end: Point, *, turns: int = 4) -> None:
    """An inductor (a row of half circles to the left of the wire) in the middle of a wire."""
    angle = math.atan2(end[1] - begin[1], end[0] - begin[0])
    length = math.hypot(end[0] - begin[0], end[1] - begin[1])
    coil = min(1.1, 0.7 * length)
    radius = coil / (2 * turns)
    start = along(begin, angle, (length - coil) / 2)
    points = [begin, start]
    for turn in range(turns):
        middle = along(start, angle, (2 * turn + 1) * radius)
        points += [along(middle, angle + a, radius) for a in np.linspace(math.pi, 0.0, 24)]
    add_line(axes, *points, end)


def add_source(axes: Axes, centre: Point, *, radius: float = 0.34) -> None:
    """A voltage source in a vertical wire, plus on top."""
    add_disc(axes, centre, radius)
    add_text(axes, (centre[0], centre[1] + 0.45 * radius), "+", size=11)
    add_text(axes, (centre[0], centre[1] - 0.48 * radius), "−", size=11)
