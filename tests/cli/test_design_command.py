"""`ulna design` beyond poles: weights, references, integral action, outputs only, other observers, and refusals."""

from __future__ import annotations

import math

import pytest
from terminal import MASS, answered, entry_point, refused, ulna, written

from ulna.design import Poles, controller_form, state_feedback
from ulna.plants import model
from ulna.symbolic.formulas import formula
from ulna.system import read_system

UNOBSERVED = """
format = 1
name = "pendulum without a sensor"
[states]
theta = { equation = "omega" }
omega = { equation = "-sin(theta) + u" }
[inputs]
u = {}
"""


def made(*arguments: str) -> dict:
    return answered("design", *arguments)


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
    done = entry_point("design", "cart_pole", "--controller-poles", "-1,-2", "--input-output")
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("warning: the zero dynamics of")
    assert "are unstable" in done.stderr
    made("isidori_zero_dynamics", "--controller-poles", "-1,-2", "--input-output")
    unlinearisable = refused("design", "cart_pole", "--controller-poles", "-1,-2")
    assert "local: 2 given, 4 needed." in unlinearisable
    assert "Add --input-output to linearise the outputs only" in unlinearisable


@pytest.mark.parametrize(
    "other", [("--observer-poles", "-1,-2,-3,-4", "--high-gain", "0.1"), ("--kalman", "1,1,1,1:0.01")]
)
def test_a_plant_without_observer_form_has_other_observers(other):
    states = made("ball_and_beam", *other)["observer"]["system"]["states"]
    assert {"x1_hat", "x2_hat", "x3_hat", "x4_hat"} <= set(states)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--controller-poles", "-1,-2", "--lqr", "1"], "they exclude each other"),
        (["--controller-poles", "-1,-2", "--track", "--set-point"], "they exclude each other"),
        (["--controller-poles", "-1,-2", "--best"], "they exclude each other"),
        (["--input-output", "--local", "--best"], "they exclude each other"),
        (["--controller-poles", "-1,-2", "--catch", "x=1"], "it is an option of a swing-up"),
        (["--controller-poles", "-1,-2", "--push", "3"], "it is an option of a swing-up"),
        (["--controller-poles", ""], "its value is empty"),
        (["--observer-poles", "-1,-2", "--kalman", "1,1:1"], "they exclude each other"),
        (["--high-gain", "0.1"], "it needs the poles of the error"),
        (["--observer-poles", "-1,-2", "--integral"], "there is no law to add it to"),
        (["--lqr", "1,1:1,2"], "2 weights of the inputs given (1, 2), 1 needed"),
        (["--lqr", "-1:1"], "must be positive"),
        (["--lqr", "1e400,1:1"], "all finite"),
        (["--kalman", "1,1"], "expected two lists separated by ':'"),
        (["--kalman", "1:1"], "1 numbers given, 2 needed"),
        (["--observer-poles", "-1,-2", "--high-gain", "0"], "not a positive number"),
    ],
)
def test_options_that_do_not_go_together_are_one_clear_error(arguments, reason):
    assert reason in refused("design", "duffing", *arguments)


def test_what_a_command_reads_is_not_written_over(tmp_path):
    file = written(MASS, tmp_path / "mass.toml")
    for option in ("--out", "--plot"):
        assert "this file is read by the same command" in refused("design", file, "--best", option, file)
    assert (tmp_path / "mass.toml").read_text() == MASS


def test_an_observer_of_a_plant_without_output_is_refused_for_that(tmp_path):
    path = tmp_path / "plant.toml"
    path.write_text(UNOBSERVED)
    assert "the plant has no output to observe" in refused("design", str(path), "--observer-poles", "-1,-2")


def test_other_values_are_designed_for():
    arm = model("one_link_arm").with_parameters({"m2": 0}).with_values()
    law = state_feedback(controller_form(arm), Poles(-1, -2, -3))
    found = made("one_link_arm", "--controller-poles", "-1,-2,-3", "--set", "m2=0 kg")["law"]["u"]
    assert found == formula(law.expressions[0])
    assert found != made("one_link_arm", "--controller-poles", "-1,-2,-3")["law"]["u"]
    misspelt = refused("design", "one_link_arm", "--controller-poles", "-1,-2,-3", "--set", "m22=0 kg")
    assert "there is no parameter 'm22'. Did you mean m2" in misspelt


def test_a_written_filter_tells_where_its_covariance_starts(tmp_path):
    out = tmp_path / "filter.toml"
    made("magnetic_levitation", "--kalman", "1,1,1:0.01", "--out", str(out))
    assert out.read_text().startswith("# Written by `ulna design magnetic_levitation`. Read it with: ulna simulate")
    point = {name: float(value) for name, value in read_system(out).operating_point}
    assert (point["x_hat"], point["i_hat"], point["cov_x_x"], point["cov_x_i"]) == (0.01, 1.0, 1.0, 0.0)


def test_a_law_that_would_read_an_output_in_place_of_its_state_is_not_written(tmp_path):
    path = tmp_path / "scaled.toml"
    path.write_text('name = "scaled"\n[states]\nx = "v"\nv = "u"\n[inputs]\nu = {}\n[outputs]\nx = "100*x"\n')
    asked = ["design", str(path), "--controller-poles", "-1,-2", "--out", str(tmp_path / "law.toml")]
    assert "the output 'x' of the plant is not its state of that name" in refused(*asked)
    # Designed on the spot it reads the state: x'' = −3 x' − 2 x.
    run = answered("simulate", *asked[1:4], "--initial", "1,0", "--horizon", "2")["signals"]
    assert run["v"][-1] == pytest.approx(2 * math.exp(-4) - 2 * math.exp(-2), abs=1e-12)


def test_gains_are_scheduled_over_a_range_of_set_points():
    ball = ["simulate", "magnetic_levitation", "--schedule", "y=0.002:0.02:6", "--controller-poles=-20,-25,-30"]
    run = answered(*ball, "--reference", "y=0.003", "--initial", "0.002,0,0.2")
    assert abs(run["signals"]["y"][-1] - 0.003) < 1e-5
    assert "lower end, upper end and number" in refused("design", "magnetic_levitation", *ball[2:3], "y=1", *ball[4:])
    assert "exclude each other" in refused(*ball, "--track", "--reference", "y=0.003")


def test_a_pendulum_is_swung_up_and_caught():
    cart = ["cart_pole", "--swing-up", "om**2/8 + 4.9*(cos(th) - 1)", "--lqr", "1,1,10,1:1"]
    up = ["--pivot", "y", "--hold=-0.5,-0.5", "--catch", "th=0.4"]
    run = answered("simulate", *cart, *up, "--initial", "0,0,pi,0", "--horizon", "60")
    assert math.cos(run["signals"]["th"][-1]) > 0.999
    assert "the region where the local law takes over is missing" in refused("design", *cart)


ROTOR = """
name = "rotor"
[states]
z = "w"
w = "8e-5*n**2 - 9.81"
[inputs]
n = { range = [0, 2000] }
[outputs]
height = "z"
"""


def test_a_function_of_an_input_takes_its_place_and_the_law_is_turned_back(tmp_path):
    rotor, out = tmp_path / "rotor.toml", tmp_path / "law.toml"
    rotor.write_text(ROTOR)
    assert "`ulna design --substitute` makes n**2 the input" in refused("analyse", str(rotor))
    done = ulna("design", str(rotor), "--substitute", "--controller-poles=-1,-2", "--set-point", "--out", str(out))
    assert done.exit_code == 0, done.output
    assert "law for the inputs themselves" in done.stdout
    run = answered("simulate", str(rotor), "--controller", str(out), "--reference", "height=1", "--horizon", "10",
                   "--initial", "0,0")  # fmt: skip
    assert abs(run["signals"]["height"][-1] - 1) < 1e-3
    affine = answered("analyse", str(rotor), "--substitute", "--question", "full_state_linearizable")
    assert affine["full_state_linearizable"]["value"] is True
