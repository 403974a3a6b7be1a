"""Figures of simulated runs."""

from __future__ import annotations

import numpy as np
import pytest

from ulna.base import SimulationError, UlnaError
from ulna.plants import model
from ulna.plot import plot_trajectories, plot_trajectory
from ulna.sim import Trajectory, simulate


@pytest.fixture(scope="module")
def run() -> Trajectory:
    return simulate(model("one-link-arm"), (1.0, 0.0, 0.0), np.linspace(0.0, 0.5, 11))


def test_every_signal_has_its_panel_and_unit_and_a_repeated_state_none(run: Trajectory) -> None:
    figure = plot_trajectory(run)
    assert [axes.get_ylabel() for axes in figure.axes] == ["theta (rad)", "omega (rad/s)", "i (A)", "u (V)"]
    assert np.array_equal(np.asarray(figure.axes[0].get_lines()[0].get_ydata()), run["theta"])


def test_signals_can_be_chosen(run: Trajectory) -> None:
    figure = plot_trajectories({"a": run, "b": run}, ("y",), title="Two")
    assert [axes.get_ylabel() for axes in figure.axes] == ["y (rad)"]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["a", "b"]


def test_an_unknown_signal_or_no_run_is_refused(run: Trajectory) -> None:
    with pytest.raises(SimulationError, match="no such signal"):
        plot_trajectory(run, ("speed",))
    with pytest.raises(UlnaError, match="no run"):
        plot_trajectories({})
