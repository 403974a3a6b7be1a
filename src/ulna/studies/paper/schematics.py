"""Figures 1 to 3 of the paper, redrawn: the forearm, the driven arm, the motor's circuit.

The angle is drawn the way the equations beside each figure count it: upward in (1) to (12), downward from (13) on.
"""

from __future__ import annotations

import math
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ulna.plot.drawing import (
    Point,
    add_arc_arrow,
    add_arrow,
    add_bar,
    add_box,
    add_dimension,
    add_disc,
    add_gear,
    add_inductor,
    add_joint,
    add_line,
    add_resistor,
    add_source,
    add_spindle,
    add_text,
    add_wall,
    along,
    new_drawing,
)
from ulna.plot.style import INK, MUTED, PALETTE

_BLUE, _RED, _GREEN = PALETTE[0], PALETTE[1], PALETTE[2]
_BONE: Final = "#EEF1F4"
_LOAD: Final = "#CBD5DE"
_MUSCLE: Final = "#F0C9B5"


def forearm_schematic() -> Figure:
    """Return Figure 1: forearm with biceps, triceps and load; the angle is counted upward, as in (1) to (12)."""
    figure, axes = new_drawing((-2.45, -2.2), (5.9, 4.15))
    pivot = (0.0, 0.0)
    angle = math.radians(16.0)
    reach, behind, front = 5.0, 0.85, 1.15
    hand, middle = along(pivot, angle, reach), along(pivot, angle, reach / 2)
    triceps, biceps = along(pivot, angle, -behind), along(pivot, angle, front)

    add_wall(axes, (-0.7, 3.68), (0.7, 3.68))
    add_bar(axes, (0.0, 3.45), (0.0, 0.12), 0.46, fill=_BONE)
    add_spindle(axes, triceps, (-0.36, 3.35), 0.46, fill=_MUSCLE)
    add_spindle(axes, biceps, (0.36, 3.35), 0.56, fill=_MUSCLE)
    add_bar(axes, along(pivot, angle, -1.02), hand, 0.4, fill=_BONE, order=3.2)
    add_line(axes, (0.35, 0.0), (5.5, 0.0), ink=MUTED, width=1.0, dashed=True)
    add_disc(axes, hand, 0.42, fill=_LOAD)
    add_joint(axes, pivot, 0.15)
    for point in (triceps, biceps):
        add_disc(axes, point, 0.055, fill=INK, order=6.0)
    _draw_forearm_forces(axes, triceps, biceps, middle, hand)
    add_arc_arrow(axes, pivot, 3.5, 0.0, angle, ink=_BLUE)
    add_text(axes, along(pivot, angle / 2, 3.82), r"$\theta_P$", ink=_BLUE, size=14)
    add_text(axes, (-0.2, -0.46), r"$O$", size=13)
    add_dimension(axes, triceps, pivot, r"$a_1$", away=-0.8, gap=0.27)
    add_dimension(axes, pivot, biceps, r"$a_2$", away=-0.8, gap=0.27)
    add_dimension(axes, pivot, hand, r"$b$", away=-1.55, gap=0.26, size=14)
    add_text(axes, (-1.0, 2.15), "triceps", ink=MUTED, size=10, turn=82)
    add_text(axes, (1.22, 2.25), "biceps", ink=MUTED, size=10, turn=-76)
    return figure


def _draw_forearm_forces(axes: Axes, triceps: Point, biceps: Point, middle: Point, hand: Point) -> None:
    """The two muscle forces and the two weights."""
    add_arrow(axes, triceps, (triceps[0], triceps[1] + 1.15), ink=_RED)
    add_text(axes, (triceps[0] - 0.18, triceps[1] + 1.0), r"$F_1 = c_1 a_1 \dot{\theta}_P$", ink=_RED, align="right")
    add_arrow(axes, biceps, (biceps[0], biceps[1] + 1.25), ink=_RED)
    add_text(axes, (biceps[0] + 0.2, biceps[1] + 1.12), r"$F_2 = -c_2\,\theta_P$", ink=_RED, align="left")
    _draw_weights(axes, middle, hand, side=-1.0)


def _draw_weights(axes: Axes, middle: Point, hand: Point, *, side: float) -> None:
    """The weights of forearm and load, named to their left (side −1) or right (side 1)."""
    align = "left" if side > 0 else "right"
    for point, name, length in ((middle, r"$m_1 g$", 1.15), (hand, r"$m_2 g$", 1.15)):
        add_arrow(axes, point, (point[0], point[1] - length), ink=_GREEN)
        add_text(axes, (point[0] + 0.16 * side, point[1] - length + 0.18), name, ink=_GREEN, align=align)
    add_disc(axes, middle, 0.055, fill=INK, order=6.0)


def arm_schematic() -> Figure:
    """Return Figure 2: one-link arm turned by a motor through a gear; the angle is counted downward, as in (13)."""
    figure, axes = new_drawing((-3.6, -3.35), (5.75, 2.2))
    pivot, motor = (0.0, 0.0), (-1.83, 0.0)
    angle = math.radians(-24.0)
    hand, middle = along(pivot, angle, 4.9), along(pivot, angle, 2.9)

    add_wall(axes, (0.75, -1.75), (-2.6, -1.75))
    for foot in (pivot, motor):
        add_line(axes, (foot[0] - 0.34, -1.75), foot, (foot[0] + 0.34, -1.75), width=1.4)
    add_gear(axes, pivot, 1.3, 26, phase=math.pi, fill="#E6ECF1")
    add_gear(axes, motor, 0.5, 10, phase=math.pi / 10, fill="#E6ECF1")
    add_bar(axes, pivot, hand, 0.4, fill=_BONE, order=4.5)
    add_disc(axes, hand, 0.42, fill=_LOAD)
    add_joint(axes, pivot, 0.15)
    add_joint(axes, motor, 0.12)
    add_line(axes, (1.5, 0.0), (5.4, 0.0), ink=MUTED, width=1.0, dashed=True)
    add_arc_arrow(axes, pivot, 3.8, 0.0, angle, ink=_BLUE)
    add_text(axes, along(pivot, angle / 2, 4.12), r"$\theta_P$", ink=_BLUE, size=14)
    # Meshing gears turn against each other: the arm's sense is down (clockwise), the motor's is counter-clockwise.
    add_arc_arrow(axes, pivot, 1.62, math.radians(125), math.radians(55), ink=_RED, width=2.0)
    add_arc_arrow(axes, motor, 0.82, math.radians(60), math.radians(130), ink=_RED, width=2.0)
    add_text(axes, (0.0, 1.9), r"$T_P = N\,T_m$", ink=_RED, size=13)
    add_text(axes, (-2.2, 1.14), r"$T_m,\ \theta_m$", ink=_RED, size=13)
    add_text(axes, (-2.52, -0.62), "motor", ink=MUTED, size=10, align="right")
    add_text(axes, (-2.52, -0.9), "gear", ink=MUTED, size=10, align="right")
    add_text(axes, (1.2, -1.3), r"gear $N : 1$", ink=MUTED, size=11, align="left")
    _draw_weights(axes, middle, hand, side=1.0)
    add_dimension(axes, pivot, hand, r"$b$", away=1.9, gap=0.26, size=14)
    return figure


def circuit_schematic() -> Figure:
    """Return Figure 3: armature circuit of the DC motor with its gear and arm, as in (14)."""
    figure, axes = new_drawing((-1.1, -0.65), (9.75, 3.1))
    top, bottom, left, right = 2.3, 0.0, 0.0, 4.6
    middle = (top + bottom) / 2
    add_line(axes, (left, middle + 0.34), (left, top), (0.5, top))
    add_resistor(axes, (0.5, top), (2.3, top))
    add_inductor(axes, (2.3, top), (4.1, top))
    add_line(axes, (4.1, top), (right, top), (right, middle + 0.55))
    add_line(axes, (right, middle - 0.55), (right, bottom), (left, bottom), (left, middle - 0.34))
    add_source(axes, (left, middle))
    add_text(axes, (left - 0.62, middle), r"$u$", size=14)
    add_text(axes, (1.4, top + 0.42), r"$R_a$", size=13)
    add_text(axes, (3.2, top + 0.46), r"$L_a$", size=13)
    add_arrow(axes, (1.2, top - 0.42), (2.0, top - 0.42), ink=_BLUE)
    add_text(axes, (2.12, top - 0.42), r"$i_a$", ink=_BLUE, size=13, align="left")
    _draw_machine(axes, (right, middle))
    return figure


def _draw_machine(axes: Axes, motor: Point) -> None:
    """The motor with its back electromotive force, the shaft, the gear pair seen from its edge, and the arm's shaft."""
    x, y = motor
    add_bar(axes, (x + 0.6, y), (x + 2.2, y), 0.12, fill=_LOAD)
    add_disc(axes, motor, 0.62, fill=_BONE)
    for end in (0.55, -0.55):
        add_box(axes, (x, y + end * 1.16), 0.3, 0.2, fill=_LOAD)
    add_text(axes, motor, "M", size=14)
    add_text(axes, (x - 0.85, y), r"$e_b = k_b N \dot{\theta}_P$", ink=_BLUE, size=13, align="right")
    pinion, wheel = x + 2.2, y - 0.9
    add_bar(axes, (pinion, wheel), (pinion + 1.5, wheel), 0.16, fill=_LOAD)
    add_box(axes, (pinion, y), 0.26, 0.5, fill="#E6ECF1")
    add_box(axes, (pinion, wheel), 0.26, 1.3, fill="#E6ECF1")
    add_text(axes, (x + 1.35, y + 0.42), r"$T_m = K_m i_a,\ \theta_m$", ink=_RED, size=13)
    after_gear = r"$T_P = N\,T_m,\ \theta_P = \theta_m / N$"
    add_text(axes, (pinion + 0.25, wheel + 0.38), after_gear, ink=_RED, size=13, align="left")
    add_text(axes, (pinion + 1.62, wheel), "to the arm", ink=MUTED, size=10, align="left")
