"""Figures of poles."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ulna.base import UlnaError
from ulna.plot import plot_poles

PAIR = (-2 + 3.4j, -2 - 3.4j, -8 + 0j)


def test_every_pole_is_in_view_and_in_its_place() -> None:
    figure = plot_poles({"loop": PAIR, "observer": (-9, -10, -11)})
    axes = figure.axes[0]
    left, right = axes.get_xlim()
    bottom, top = axes.get_ylim()
    drawn = {
        complex(x, y)
        for line in axes.get_lines()
        if line.get_label() in {"loop", "observer"}
        for x, y in np.asarray(line.get_xydata())
    }
    assert drawn == {*PAIR, -9 + 0j, -10 + 0j, -11 + 0j}
    assert all(left < p.real < right and bottom < p.imag < top for p in drawn)


def test_the_unstable_half_is_in_view() -> None:
    left, right = plot_poles({"loop": PAIR}).axes[0].get_xlim()
    assert left < 0 < right


@pytest.mark.parametrize("poles", [(0j,), (3 + 40j, 3 - 40j), (1e-6,), (-1e5, -1.0)])
def test_extreme_poles_can_be_drawn(poles: tuple[complex, ...]) -> None:
    figure = plot_poles({"loop": poles})
    figure.draw_without_rendering()
    left, right = figure.axes[0].get_xlim()
    assert all(left < complex(p).real < right for p in poles)


@pytest.mark.parametrize("groups", [{}, {"loop": ()}, {"loop": (math.nan,)}, {"loop": (complex(0, math.inf),)}])
def test_no_pole_or_an_infinite_one_is_refused(groups: dict[str, tuple[complex, ...]]) -> None:
    with pytest.raises(UlnaError, match="a figure of poles"):
        plot_poles(groups)
