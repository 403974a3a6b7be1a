"""`ulna simulate`: values, starts and signals as people write them, and what the exit status says."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.linalg import expm
from terminal import answered, entry_point, refused, ulna

import ulna as library
from ulna.loop import Loop
from ulna.sim import simulate

POLES = ["--controller-poles", "-2+3.46j,-2-3.46j,-8"]
OBSERVER = ["--observer-poles", "-9,-10,-11"]
ARM = ["simulate", "one_link_arm"]
TIMES = np.linspace(0.0, 2.0, 501)


def signals(*arguments: str) -> dict[str, np.ndarray]:
    """The signals of a run of 2 s."""
    return {name: np.array(row) for name, row in answered(*arguments, "--horizon", "2")["signals"].items()}


def test_a_parameter_is_set_with_its_unit_and_the_controller_does_not_know():
    arm = library.model("one_link_arm")
    law = library.state_feedback(arm.with_values(), library.Poles("-2+3.46j", "-2-3.46j", -8))
    loop = Loop(plant=arm.with_parameters({"m2": 4}).with_values(), controller=law)
    expected = simulate(loop, [1, 0, 0], TIMES)
    found = signals(*ARM, *POLES, "--initial", "1,0,0", "--set", "m2=4000 g")
    assert found["theta"] == pytest.approx(expected["theta"], abs=1e-12)
    assert abs(found["theta"] - signals(*ARM, *POLES, "--initial", "1,0,0")["theta"]).max() > 0.1


def test_a_parameter_without_a_value_gets_one_and_the_design_knows_it(tmp_path):
    path = tmp_path / "mass.toml"
    path.write_text(MASS.replace("m = { value = 2 }", "m = {}"))
    found = signals("simulate", str(path), "--set", "m=2", "--initial", "x=1", "--controller-poles", "-3,-4")
    assert found["x"] == pytest.approx(4 * np.exp(-3 * TIMES) - 3 * np.exp(-4 * TIMES), abs=1e-12)
    assert "parameters without a value: m. Add --set m=1" in refused("simulate", str(path))


def test_initial_values_go_by_order_or_by_name_with_units():
    ordered = signals(*ARM, *POLES, "--initial", "pi/6,0,0")
    named = signals(*ARM, *POLES, "--initial", "i=0 mA, theta=30deg")
    assert all(np.array_equal(named[name], ordered[name]) for name in ordered)


def test_what_is_left_out_starts_where_the_file_has_its_operating_point():
    found = signals("simulate", "magnetic_levitation", "--input", "u=2")
    assert [found[name][0] for name in ("x", "s", "i")] == [0.01, 0.0, 1.0]


def test_estimates_start_where_they_are_told():
    found = signals(*ARM, *POLES, *OBSERVER, "--initial", "theta=1, theta_hat=0.5, i_hat=20 mA")
    assert [found[name][0] for name in ("theta", "theta_hat", "omega_hat", "i_hat")] == [1.0, 0.5, 0.0, 0.02]


def test_an_input_is_a_formula_of_time():
    found = signals(*ARM, "--input", "u=0.5*sin(3*t) + 1")
    assert found["u"] == pytest.approx(0.5 * np.sin(3 * TIMES) + 1, abs=1e-12)


def test_a_tracked_reference_brings_its_derivatives():
    found = signals(*ARM, *POLES, "--track", "--reference", "y=0.5*sin(2*t)", "--initial", "0,1,0")
    assert found["y_ref_d2"] == pytest.approx(-2 * np.sin(2 * TIMES), abs=1e-12)
    assert found["y_ref_d3"] == pytest.approx(-4 * np.cos(2 * TIMES), abs=1e-12)
    assert abs(found["y"] - found["y_ref"])[-1] < 0.02 < abs(found["y"] - found["y_ref"]).max()


def test_a_set_point_has_a_unit():
    found = signals(*ARM, *POLES, "--set-point", "--reference", "y=30 deg", "--horizon", "2")
    assert found["y_ref"][0] == pytest.approx(np.pi / 6, abs=1e-15)


@pytest.mark.parametrize(
    ("design", "run", "ending"),
    [
        ([*POLES], [], "toml"),
        ([*POLES, "--set-point"], ["--reference", "y=0.3"], "json"),
        ([*POLES, *OBSERVER], ["--limit", "20"], "toml"),
        (["--lqr", "1", "--kalman", "1,1,1:0.01"], [], "json"),
    ],
)
def test_a_written_controller_runs_as_the_designed_one(design, run, ending, tmp_path):
    out = tmp_path / f"controller.{ending}"
    assert ulna("design", "one_link_arm", *design, "--out", str(out)).exit_code == 0
    run = [*run, "--initial", "0.5,0,0"]
    expected, found = signals(*ARM, *design, *run), signals(*ARM, "--controller", str(out), *run)
    assert expected.keys() == found.keys()
    for name, row in expected.items():
        assert found[name] == pytest.approx(row, abs=1e-9), name


MASS = """
name = "mass"
[parameters]
m = { value = 2 }
[states]
x = "v"
v = "u/m"
[inputs]
u = {}
[outputs]
x = "x"
"""
PID = """
name = "PID of a user"
[parameters]
kp = { value = 26, range = [0, 100] }
ki = { value = 24 }
kd = { value = 9 }
tau = { value = 0.05 }
[states]
sum = "x_ref - x"
slow = "(x - slow)/tau"
[inputs]
x = {}
x_ref = {}
[outputs]
u = "2*(kp*(x_ref - x) + ki*sum - kd*(x - slow)/tau)"
[operating_point]
sum = 0.5
"""


@pytest.fixture
def written(tmp_path):
    """A mass and a PID, as files."""
    for name, text in (("mass.toml", MASS), ("pid.toml", PID)):
        (tmp_path / name).write_text(text)
    return [str(tmp_path / "mass.toml"), "--controller", str(tmp_path / "pid.toml")]


def test_a_users_own_controller_closes_the_loop(written):
    found = signals("simulate", *written, "--reference", "x=1", "--initial", "x=0.2", "--set", "kp=30")
    # (x, v, ∫e, filtered x, 1)' = A (…), by hand.
    A = np.zeros((5, 5))
    A[0, 1], A[2, [0, 4]], A[3, [0, 3]] = 1, (-1, 1), (20, -20)
    A[1] = [-30 - 9 * 20, 0, 24, 9 * 20, 30]
    steps = np.array([expm(A * t) @ [0.2, 0, 0.5, 0, 1] for t in TIMES[::100]])
    for column, name in enumerate(("x", "v", "sum", "slow")):
        assert found[name][::100] == pytest.approx(steps[:, column], abs=1e-11), name


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--set", "mm=1"], "there is no parameter 'mm'. Did you mean m? Known: kp, ki, kd, tau, m."),
        (["--set", "m 1"], "expected a name and its value"),
        (["--set", "kp=101"], "its range is [0, 100]"),
        (["--initial", "x=1, vv=0"], "there is no state 'vv'. Did you mean v? Known: sum, slow, x, v."),
        (["--initial", "1,0,0"], "3 numbers, 2 states (x, v)"),
        (["--initial", "1,a"], "unknown symbol 'a'"),
        (["--initial", "x=1e400"], "its value is inf"),
        (["--input", "w=1"], "there is no input 'w'. Known: x_ref."),
        (["--reference", "y=1"], "there is no reference 'y'. Known: x."),
        (["--reference", "x=sin(x)"], "unknown symbol 'x'"),
        (["--reference", "x=__import__('os')"], "unknown function"),
        ([], "the reference 'x_ref': the controller reads it, and neither the plant nor an option gives it"),
        (["--controller-poles", "-1,-2"], "both a file and a design are asked for"),
        (["--track"], "there is no law to add it to"),
    ],
)
def test_what_does_not_fit_the_loop_is_refused(written, arguments, reason):
    assert reason in refused("simulate", *written, *arguments)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--controller", "nowhere.toml"], "it cannot be read"),
        (["--reference", "y=1"], "the loop follows no reference. Add --set-point or --track"),
        ([*POLES, "--track", "--reference", "y=abs(sin(t))"], "derivative 2 of it does not exist"),
        (["--set", "m2=4 m"], "'m' measures length, expected mass. Write it in kg."),
        (["--initial", "theta=1 kg"], "'kg' measures mass, expected a pure number or an angle"),
        (["--input", "u=2 t"], "no operator between"),
    ],
)
def test_units_and_formulas_that_do_not_fit_are_refused(arguments, reason):
    assert reason in refused(*ARM, *arguments)


def test_a_missing_controller_is_named_by_its_option(tmp_path):
    said = refused(*ARM, "--controller", str(tmp_path / "none.toml"))
    assert said.startswith("error: --controller '")
    assert "none.toml': it cannot be read (No such file or directory). Check the path." in said


def test_a_static_law_is_no_plant(tmp_path):
    out = tmp_path / "law.toml"
    assert ulna("design", "duffing", "--controller-poles", "-1,-2", "--out", str(out)).exit_code == 0
    assert "it has no states" in refused("simulate", str(out))


@pytest.mark.parametrize(
    ("equation", "outcome"), [("x^2", "blew_up"), ("sign(x - 1)", "ambiguous"), ("-1/(2*sqrt(x))", "edge")]
)
def test_a_run_that_fails_is_printed_and_has_status_1(equation, outcome, tmp_path):
    path = tmp_path / "failing.toml"
    path.write_text(f'name = "failing"\n[states]\nx = "{equation}"\n')
    done = ulna("simulate", str(path), "--initial", "1", "--horizon", "3", "--json")
    assert done.exit_code == 1
    assert f'"outcome": "{outcome}"' in done.stdout


def test_sticking_is_printed_and_has_status_0(tmp_path):
    path = tmp_path / "block.toml"
    path.write_text('name = "block"\n[states]\nx = "v"\nv = "-sign(v)"\n')
    arguments = ("simulate", str(path), "--initial", "0,0.5", "--horizon", "2")
    done = ulna(*arguments)
    assert done.exit_code == 0
    assert "sticks at t = 0.5 s (v = 0)" in done.stdout
    modes = json.loads(ulna(*arguments, "--json").stdout)["modes"]
    assert [(mode["held"], mode["end"]) for mode in modes] == [([], 0.5), (["v = 0"], 2.0)]


def test_a_run_says_which_declared_range_it_leaves(tmp_path):
    path = tmp_path / "cart.toml"
    path.write_text(
        '[states]\nx = { unit = "m", equation = "v", range = [-2, 2] }\nv = { unit = "m/s", equation = "u" }\n'
        '[inputs]\nu = { unit = "m/s^2", range = [-10, 10] }\n'
    )
    fast = ["simulate", str(path), "--controller-poles=-20,-21", "--initial", "x=1", "--horizon", "2"]
    said = "u leaves its declared range: u = -420 m/s^2, its range is [-10, 10] m/s^2."
    assert answered(*fast)["ranges_left"] == [said]
    assert said in ulna(*fast).stdout
    slow = ["simulate", str(path), "--controller-poles=-1,-2", "--initial", "x=1", "--horizon", "2"]
    assert answered(*slow)["ranges_left"] == []


def test_the_exit_status_of_the_program():
    assert entry_point(*ARM, "--initial", "1,0,0", "--until", "theta-1.2").returncode == 0
    failed = entry_point(*ARM, "--input", "u=log(t-1)", "--json")
    assert failed.returncode == 1
    assert json.loads(failed.stdout)["outcome"] == "edge"  # and nothing else on standard output
