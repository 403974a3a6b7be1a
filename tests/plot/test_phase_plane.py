"""The phase plane of a plant, and the responses of its linearisation by python-control."""

from __future__ import annotations

import doctest
import sys

import numpy as np
import pytest

import ulna
from ulna.base import OptionalDependencyError, PlantError, SimulationError, UlnaError
from ulna.plants import model
from ulna.plot import bode, plot_phase, step_response
from ulna.system import linearise


def test_the_field_the_nullclines_and_the_equilibria_are_drawn() -> None:
    figure = plot_phase("duffing", within={"x1": (-2, 2), "x2": (-3, 3)})
    axes = figure.axes[0]
    assert (axes.get_xlim(), axes.get_ylim()) == ((-2, 2), (-3, 3))
    labels = axes.get_legend_handles_labels()[1]
    assert labels[:2] == ["x1' = 0", "x2' = 0"]
    assert any("equilibrium" in label for label in labels)


@pytest.mark.parametrize(
    ("states", "within", "found"),
    [(("x1",), {}, "Name two"), (("x1", "q"), {}, "no state q"), ((), {"q": (0, 1)}, "no state q")],
)
def test_what_is_no_plane_is_refused(
    states: tuple[str, ...], within: dict[str, tuple[float, float]], found: str
) -> None:
    with pytest.raises(PlantError, match=found):
        plot_phase("duffing", states, within)


def test_an_empty_range_is_refused() -> None:
    with pytest.raises(UlnaError, match="Swap the two"):
        plot_phase("duffing", within={"x1": (2, 1), "x2": (-1, 1)})


def test_the_responses_are_those_of_the_transfer_function() -> None:
    linear = linearise(model("mass_spring_damper"))
    A, B, C, D = (linear.numbers(name) for name in "ABCD")
    at = np.array([0.1, 1.0, 10.0])
    expected = [(C @ np.linalg.solve(1j * w * np.eye(len(A)) - A, B) + D)[0, 0] for w in at]
    np.testing.assert_allclose(bode(linear, at).magnitude, np.abs(expected), rtol=1e-9)
    _, y = step_response(linear, 200.0)
    assert y[-1] == pytest.approx((D - C @ np.linalg.solve(A, B))[0, 0], rel=1e-3)


def test_a_system_without_inputs_has_no_response() -> None:
    with pytest.raises(SimulationError, match="no inputs"):
        bode(
            model("van_der_pol")
            if not model("van_der_pol").inputs
            else ulna.close_loop("mass_spring_damper", ulna.controller_for("mass_spring_damper", law=[-1, -2]))
        )


def test_without_python_control_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(OptionalDependencyError, match="control"):
        bode(model("mass_spring_damper"))


@pytest.mark.parametrize("name", ["plot_phase", "bode", "step_response"])
def test_the_example_in_the_help_shows_what_it_says(name: str) -> None:
    [example] = doctest.DocTestFinder(recurse=False).find(getattr(ulna, name), name, globs={"ulna": ulna})
    assert doctest.DocTestRunner(verbose=False).run(example).failed == 0
    assert example.examples
