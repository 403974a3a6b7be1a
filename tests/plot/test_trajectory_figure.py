"""Figures of simulated runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ulna.base import SimulationError, UlnaError, UlnaWarning
from ulna.design import SetPoint, close_loop, controller_for
from ulna.plants import model
from ulna.plot import plot_trajectories, plot_trajectory
from ulna.sim import Held, Outcome, Trajectory, simulate


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


def test_estimate_reference_and_set_point_stand_in_the_panel_of_what_they_are_of() -> None:
    arm = model("one_link_arm").with_values()
    made = controller_for(arm, law=[-4, -5, -6], observer=[-9, -10, -11], reference=SetPoint())
    run = simulate(close_loop(arm, made), [0.2, 0, 0], np.linspace(0, 1, 21), inputs={"y_ref": 0.5})
    figure = plot_trajectory(run, levels={"u": [-24, 24]})
    assert [axes.get_ylabel() for axes in figure.axes] == ["theta (rad)", "omega (rad/s)", "i (A)", "u (V)"]
    drawn = [np.asarray(line.get_ydata()) for line in figure.axes[0].get_lines()]
    assert [
        np.array_equal(values, run[name]) for values, name in zip(drawn, ("theta", "theta_hat", "y_ref"), strict=True)
    ] == [True] * 3
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["run", "estimate", "reference"]
    assert {float(np.asarray(line.get_ydata())[0]) for line in figure.axes[3].get_lines()} >= {-24.0, 24.0}


def test_what_a_processor_holds_is_drawn_as_steps_with_every_value() -> None:
    held = Held(times=np.array([0.0, 0.1, 0.3]), values=np.array([1.0, -1.0, 2.0]))
    run = simulate(model("one_link_arm"), (1.0, 0.0, 0.0), np.linspace(0.0, 0.5, 4), inputs={"u": held})
    line = plot_trajectory(run, ["u"]).axes[0].get_lines()[0]
    assert line.get_drawstyle() == "steps-post"
    assert np.asarray(line.get_xdata()).tolist() == [0.0, 0.1, 0.3, 0.5]
    assert np.asarray(line.get_ydata()).tolist() == [1.0, -1.0, 2.0, 2.0]
    assert plot_trajectory(run, ["theta"]).axes[0].get_lines()[0].get_drawstyle() == "default"


def test_a_run_of_two_instants_says_that_the_line_between_them_is_no_motion() -> None:
    run = simulate(model("duffing"), (1.0, 0.0), 5.0)
    with pytest.warns(UlnaWarning, match="keeps its start and its end only"):
        plot_trajectory(run)
    plot_trajectory(replace(run, outcome=Outcome.EDGE))  # it ended there: all its instants are shown
