"""Figures 1 to 3."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ulna.plot import svg_text
from ulna.studies.paper.schematics import arm_schematic, circuit_schematic, forearm_schematic

DRAWINGS = (forearm_schematic, arm_schematic, circuit_schematic)


@pytest.mark.parametrize("draw", DRAWINGS)
def test_no_word_runs_over_another_or_off_the_page(draw: Callable[[], Figure]) -> None:
    figure = draw()
    renderer = FigureCanvasAgg(figure).get_renderer()
    boxes = [text.get_window_extent(renderer) for text in figure.axes[0].texts if text.get_text()]
    page = figure.bbox
    assert all(page.x0 <= b.x0 and b.x1 <= page.x1 and page.y0 <= b.y0 and b.y1 <= page.y1 for b in boxes)
    overlapping = [(a, b) for i, a in enumerate(boxes) for b in boxes[:i] if a.overlaps(b)]
    assert overlapping == []


@pytest.mark.parametrize("draw", DRAWINGS)
def test_a_drawing_is_the_same_on_every_run(draw: Callable[[], Figure]) -> None:
    assert svg_text(draw()) == svg_text(draw())


def test_the_forearm_counts_its_angle_upward_and_the_arm_downward() -> None:
    def load_height(figure: Figure) -> float:
        weights = [text for text in figure.axes[0].texts if text.get_text() == "$m_2 g$"]
        return float(weights[0].get_position()[1])

    assert load_height(forearm_schematic()) > 0 > load_height(arm_schematic())
