"""Figures of curves over time."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import same_color, to_rgb

from ulna.base import UlnaError
from ulna.plot import Curve, Panel, plot_curves, plot_panels
from ulna.plot.style import PALETTE, axis_label, colour

TIMES = np.linspace(0.0, 2.0, 21)


def _curve(label: str = "run", hue: int = 0, dash: int = 0) -> Curve:
    return Curve(label=label, times=TIMES, values=np.cos(TIMES), hue=hue, dash=dash)


def test_a_curve_is_drawn_with_its_own_numbers() -> None:
    figure = plot_curves([_curve()], quantity="angle", unit="rad")
    line = figure.axes[0].get_lines()[0]
    assert np.array_equal(line.get_xdata(), TIMES)
    assert np.array_equal(line.get_ydata(), np.cos(TIMES))


def test_axes_carry_quantity_and_unit() -> None:
    figure = plot_curves([_curve()], quantity="current", unit="A")
    assert figure.axes[0].get_ylabel() == "current (A)"
    assert figure.axes[0].get_xlabel() == "time (s)"


def test_a_quantity_without_unit_has_no_brackets() -> None:
    assert axis_label("gear ratio", "") == "gear ratio"


def test_angles_get_a_second_scale_in_degrees() -> None:
    figure = plot_curves([_curve()], quantity="angle", unit="rad")
    figure.draw_without_rendering()
    degrees = figure.axes[0].child_axes[0]
    assert degrees.get_ylabel() == "degrees"
    assert np.allclose(degrees.get_ylim(), np.degrees(figure.axes[0].get_ylim()))


def test_other_quantities_get_no_second_scale() -> None:
    assert plot_curves([_curve()], quantity="voltage", unit="V").axes[0].child_axes == []


def test_curves_of_one_hue_share_colour_and_differ_in_dashes() -> None:
    figure = plot_curves([_curve("exact"), _curve("printed", dash=1)], quantity="angle", unit="rad")
    first, second = figure.axes[0].get_lines()
    assert same_color(first.get_color(), second.get_color())
    assert first.get_linestyle() != second.get_linestyle()


def test_one_legend_names_every_curve_once() -> None:
    figure = plot_curves([_curve("a"), _curve("b", hue=1)], quantity="angle", unit="rad", title="Runs")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["a", "b"]
    assert figure.legends[0].get_title().get_text() == "Runs"


def test_a_single_curve_needs_no_legend() -> None:
    figure = plot_curves([_curve()], quantity="angle", unit="rad", title="Run")
    assert figure.legends == []
    assert figure.axes[0].get_title(loc="left") == "Run"


def test_panels_stand_below_one_another_over_one_time_axis() -> None:
    panels = [Panel(quantity=name, unit="V", curves=(_curve(),)) for name in ("u", "v", "w")]
    figure = plot_panels(panels)
    assert [axes.get_ylabel() for axes in figure.axes] == ["u (V)", "v (V)", "w (V)"]
    assert [axes.get_xlabel() for axes in figure.axes] == ["", "", "time (s)"]


def test_the_palette_stays_apart_in_grey() -> None:
    grey = [float(np.dot(to_rgb(ink), (0.299, 0.587, 0.114))) for ink in PALETTE[:3]]
    assert colour(len(PALETTE)) == colour(0)
    assert min(abs(a - b) for i, a in enumerate(grey) for b in grey[:i]) > 0.1


def test_nothing_to_draw_is_refused() -> None:
    with pytest.raises(UlnaError, match="nothing to draw"):
        plot_panels([])
    with pytest.raises(UlnaError, match="nothing to draw"):
        plot_curves([], quantity="angle", unit="rad")


def test_times_and_values_of_different_length_are_refused() -> None:
    short = Curve(label="short", times=TIMES, values=TIMES[:-1])
    with pytest.raises(UlnaError, match=r"'short'.*\(21,\).*\(20,\)"):
        plot_curves([short], quantity="angle", unit="rad")
