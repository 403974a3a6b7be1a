"""Figures of campaigns."""

from __future__ import annotations

import math

import numpy as np
import pytest
from matplotlib.collections import QuadMesh

from ulna.base import UlnaError
from ulna.campaign import Column, Fan, SettledMap
from ulna.plot import plot_fan, plot_settled_map

TIMES = np.linspace(0, 2, 21)
LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)


def fan_of(values: np.ndarray, levels: tuple[float, ...] = LEVELS, early: int = 0) -> Fan:
    return Fan(signal="y", unit="rad", times=TIMES, levels=levels, values=values, runs=9, early=early)


def map_of(fraction: list[list[float]], runs: list[list[int]]) -> SettledMap:
    axes = {name: Column(name=name, unit=unit, text="", varied=True) for name, unit in (("m", "kg"), ("x", ""))}
    edges = np.array([0.0, 1.0, 3.0])
    return SettledMap(
        x=axes["m"], y=axes["x"], x_edges=edges, y_edges=edges, fraction=np.array(fraction), runs=np.array(runs)
    )


def test_a_fan_draws_each_pair_of_quantiles_and_the_median() -> None:
    values = np.outer(LEVELS, TIMES)
    figure = plot_fan(fan_of(values, early=2), title="spread")
    axes = figure.axes[0]
    assert np.array_equal(np.asarray(axes.get_lines()[0].get_ydata()), values[2])
    outer, inner = (band.get_paths()[0].get_extents() for band in axes.collections)
    assert outer.y1 == pytest.approx(0.95 * 2)
    assert inner.y1 == pytest.approx(0.75 * 2)
    assert {text.get_text() for text in axes.texts} == {"2 of 9 runs ended early"}
    assert axes.get_ylabel() == "y (rad)"
    figure.draw_without_rendering()


def test_the_order_of_the_levels_does_not_matter() -> None:
    values = np.outer(LEVELS, TIMES)
    figure = plot_fan(fan_of(values[::-1], LEVELS[::-1]))
    assert np.array_equal(np.asarray(figure.axes[0].get_lines()[0].get_ydata()), values[2])


def test_a_map_colours_each_cell_and_leaves_empty_ones_out() -> None:
    figure = plot_settled_map(map_of([[0.0, 1.0], [math.nan, 0.5]], [[3, 4], [0, 2]]), title="where")
    mesh = next(c for c in figure.axes[0].collections if isinstance(c, QuadMesh))
    shown = np.ma.asarray(mesh.get_array())
    assert shown.filled(-1).tolist() == [[0.0, 1.0], [-1.0, 0.5]]
    assert mesh.get_clim() == (0.0, 1.0)
    assert [figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()] == ["m (kg)", "x"]
    figure.draw_without_rendering()


@pytest.mark.parametrize(
    "draw",
    [
        lambda: plot_fan(fan_of(np.full((5, 21), math.nan))),
        lambda: plot_fan(fan_of(np.zeros((1, 21)), (0.5,))),
        lambda: plot_settled_map(map_of([[math.nan] * 2] * 2, [[0, 0], [0, 0]])),
    ],
)
def test_what_holds_nothing_to_draw_is_refused(draw) -> None:
    with pytest.raises(UlnaError, match="a fan chart|a map"):
        draw()
