"""Figures: a value in, a Matplotlib figure out. Nothing here keeps state or opens a window."""

from ulna.plot.curves import Curve, Panel, plot_curves, plot_panels
from ulna.plot.fan import plot_fan
from ulna.plot.poles import plot_poles
from ulna.plot.save import FORMATS, save_figure, svg_text
from ulna.plot.settled_map import plot_settled_map
from ulna.plot.trajectory import plot_trajectories, plot_trajectory

__all__ = [
    "FORMATS",
    "Curve",
    "Panel",
    "plot_curves",
    "plot_fan",
    "plot_panels",
    "plot_poles",
    "plot_settled_map",
    "plot_trajectories",
    "plot_trajectory",
    "save_figure",
    "svg_text",
]
