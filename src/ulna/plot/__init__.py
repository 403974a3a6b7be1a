"""Figures: a value in, a Matplotlib figure out. Nothing here keeps state or opens a window."""

from ulna.plot.curves import Curve, Panel, plot_curves, plot_panels
from ulna.plot.fan import plot_fan
from ulna.plot.linear_response import bode, step_response
from ulna.plot.phase import plot_phase
from ulna.plot.poles import plot_poles
from ulna.plot.region import plot_region
from ulna.plot.save import FORMATS, save_figure, svg_text
from ulna.plot.settled_map import plot_settled_map
from ulna.plot.trajectory import plot_trajectories, plot_trajectory

__all__ = [
    "FORMATS",
    "Curve",
    "Panel",
    "bode",
    "plot_curves",
    "plot_fan",
    "plot_panels",
    "plot_phase",
    "plot_poles",
    "plot_region",
    "plot_settled_map",
    "plot_trajectories",
    "plot_trajectory",
    "save_figure",
    "step_response",
    "svg_text",
]
