"""`ulna design` beyond poles: weights, references, integral action, outputs only, other observers, and refusals."""

from __future__ import annotations

import json
import subprocess
import sysconfig
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ulna.cli.main import app

UNOBSERVED = """
format = 1
name = "pendulum without a sensor"
[states]
theta = { equation = "omega" }
omega = { equation = "-sin(theta) + u" }
[inputs]
u = {}
"""


def design(*arguments: str):
    return CliRunner().invoke(app, ["design", *arguments])


def made(*arguments: str) -> dict:
    done = design(*arguments, "--json")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def test_weights_take_the_place_of_poles():
    # s² + √3 s + 1: the textbook answer for a double integrator with weights 1, 1 and 1.
    gains = made("duffing", "--lqr", "1,1:1")["law"]["gains"][0]
    assert [float(g.partition("/")[0]) / float(g.partition("/")[2] or 1) for g in gains] == pytest.approx([1, 3**0.5])


def test_a_law_takes_a_set_point_a_reference_and_integral_action():
    plain = made("duffing", "--controller-poles", "-1,-2")
    held = made("duffing", "--controller-poles", "-1,-2", "--set-point")
    followed = made("duffing", "--controller-poles", "-1,-2", "--track")
    summed = made("duffing", "--controller-poles", "-1,-2,-3", "--integral")
    (law,) = (set(plain["law"]) - {"gains"},)
    (name,) = law
    assert "_ref" not in plain["law"][name]
    assert "_ref" in held["law"][name]
    assert "_ref_d2" in followed["law"][name]
    assert "e1_int" in summed["law"][name]


def test_outputs_alone_are_linearised_with_a_warning_where_the_rest_runs_away():
    program = Path(sysconfig.get_path("scripts")) / "ulna"
    asked = [str(program), "design", "cart_pole", "--controller-poles", "-1,-2", "--input-output"]
    done = subprocess.run(asked, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("warning: the zero dynamics of")
    assert "are unstable" in done.stderr
    stable = design("isidori_zero_dynamics", "--controller-poles", "-1,-2", "--input-output", "--json")
    assert stable.exit_code == 0, stable.output


@pytest.mark.parametrize(
    "other", [("--observer-poles", "-1,-2,-3,-4", "--high-gain", "0.1"), ("--kalman", "1,1,1,1:0.01")]
)
def test_a_plant_without_observer_form_is_offered_other_observers(other):
    refused = design("ball_and_beam", "--observer-poles", "-1,-2,-3,-4")
    assert refused.exit_code == 2
    assert "Add --high-gain 0.1, or replace --observer-poles by --kalman 1,1,1,1:0.01." in refused.stderr
    states = made("ball_and_beam", *other)["observer"]["system"]["states"]
    assert {"x1_hat", "x2_hat", "x3_hat", "x4_hat"} <= set(states)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--controller-poles", "-1,-2", "--lqr", "1"], "they exclude each other"),
        (["--controller-poles", "-1,-2", "--track", "--set-point"], "they exclude each other"),
        (["--observer-poles", "-1,-2", "--kalman", "1,1:1"], "they exclude each other"),
        (["--high-gain", "0.1"], "it needs the poles of the error"),
        (["--observer-poles", "-1,-2", "--integral"], "there is no law to add it to"),
        (["--lqr", "1,1:1,2"], "2 weights of the new input"),
        (["--lqr", "-1:1"], "must be positive"),
        (["--lqr", "1e400,1:1"], "all finite"),
        (["--kalman", "1,1"], "two lists divided by ':' are due"),
        (["--kalman", "1:1"], "1 numbers given, 2 needed"),
        (["--observer-poles", "-1,-2", "--high-gain", "0"], "no positive number"),
    ],
)
def test_options_that_do_not_go_together_are_one_clear_error(arguments, reason):
    done = design("duffing", *arguments)
    assert done.exit_code == 2, done.output
    assert reason in done.stderr
    assert done.stderr.startswith("error: ")


def test_an_observer_of_a_plant_without_output_is_refused_for_that(tmp_path):
    path = tmp_path / "plant.toml"
    path.write_text(UNOBSERVED)
    done = design(str(path), "--observer-poles", "-1,-2")
    assert done.exit_code == 2
    assert "the plant has no output to observe" in done.stderr
