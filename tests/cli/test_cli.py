"""The program as a whole: entry point, plants by file and name, refusals, exit status."""

from __future__ import annotations

import json

import pytest
from terminal import answered, entry_point, refused, ulna

ARM_POLES = ["--controller-poles", "-2+3.46j,-2-3.46j,-8", "--observer-poles", "-9,-10,-11"]
PLANT = """
format = 1
name = "pendulum"
[parameters]
l = { value = 0.5 }
[states]
theta = "omega"
omega = "-9.81/l*sin(theta) + u"
[inputs]
u = {}
[outputs]
y = "theta"
"""


@pytest.fixture
def plant(tmp_path):
    path = tmp_path / "pendulum.toml"
    path.write_text(PLANT)
    return path


def test_models_are_listed_for_people_and_machines():
    assert "one_link_arm" in ulna("models").output
    assert {"name", "text", "teaches", "source", "states", "inputs", "outputs", "linearisable"} == set(
        answered("models")[0]
    )


def test_a_plant_file_is_analysed_through_the_real_entry_point(plant):
    done = entry_point("analyse", str(plant), "--json")
    assert done.returncode == 0, done.stderr
    answers = json.loads(done.stdout)
    assert answers["full_state_linearizable"] == {"verdict": "proved", "value": True}
    assert answers["relative_degree"]["value"] == [2]
    assert answers["T"]["value"] == ["theta", "omega"]
    assert all(set(entry) == {"verdict", "value"} for entry in answers.values())
    told = answered("analyse", str(plant), "--evidence")
    assert all(set(entry) == {"verdict", "value", "evidence"} for entry in told.values())


def test_a_plant_is_analysed_with_other_values(plant):
    found = answered("analyse", str(plant), "--set", "l=2")
    assert found["relative_degree"]["value"] == [2]
    assert "there is no parameter 'k'. Known: l." in refused("analyse", str(plant), "--set", "k=2")


def test_the_papers_compensator_is_designed_from_the_catalogue(tmp_path):
    out = tmp_path / "compensator.toml"
    made = answered("design", "one_link_arm", *ARM_POLES, "--out", str(out))
    assert made["observer_form"]["gains"] == [["990"], ["299"], ["30"]]
    assert made["observer"]["gains"] == [["20"], ["(4049 - 1764*sin(theta_hat))/51"], ["-100"]]
    assert made["compensator"]["inputs"].keys() == {"y"}
    # The controller is a file like a plant's.
    assert "is not affine in the input y" in refused("analyse", str(out))


def test_a_closed_loop_is_simulated_drawn_and_written(tmp_path):
    drawn, written = tmp_path / "run.svg", tmp_path / "run.nc"
    command = ["simulate", "one_link_arm", *ARM_POLES, "--initial", "-1,0,0"]
    data = answered(*command, "--plot", str(drawn), "--out", str(written))
    assert drawn.read_text().lstrip().startswith("<?xml")
    assert written.stat().st_size > 1000
    assert data["outcome"] == "finished"
    assert abs(data["signals"]["theta"][-1]) < 1e-3


ARM = ["simulate", "one_link_arm"]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["analyse", "nowhere.toml"], "cannot be read"),
        (["analyse", "one_link_arn"], "Did you mean one_link_arm"),
        (["design", "one_link_arm", "--controller-poles", "-1,-2"], "2 given (-1, -2), 3 needed"),
        (["design", "one_link_arm", "--controller-poles", "-1+2j,-2,-3"], "conjugate"),
        (["design", "one_link_arm", "--controller-poles", "-1,,-3"], "an entry is empty"),
        (["design", "one_link_arm", "--controller-poles", "-1,__import__('os'),-3"], "not a finite number"),
        (["design", "forearm", "--controller-poles", "-1,-2"], "there are no inputs"),
        ([*ARM, "--horizon", "-1"], "--horizon -1: expected a positive time"),
        ([*ARM, "--horizon", "nan"], "--horizon nan: expected a positive time"),
        ([*ARM, "--horizon", "inf"], "--horizon inf: expected a positive time"),
        ([*ARM, "--period", "1e-3"], "there is no controller to be sampled"),
        ([*ARM, "--out", "run.xls"], "neither .csv nor .nc"),
        ([*ARM, "--out", "no/such/folder/run.csv"], "cannot be written"),
        ([*ARM, "--out", "no/such/folder/run.nc"], "written"),
        ([*ARM, "--plot", "no/such/folder/run.png"], "no/such/folder"),
    ],
)
def test_a_users_mistake_is_one_clear_error_with_status_2(arguments, reason, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert reason in refused(*arguments)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ('omega = "-9.81/l*sin(thet) + u"', "Did you mean 'theta'"),
        ("omega = \"__import__('os').system('true')\"", "unknown function '__import__'"),
        ('omega = "theta.real"', "not part of a formula"),
        ('omega = "9**9**9"', "too large"),
        ('omega = "u**2"', "not affine"),
        ('omega = "-9.81/(l - 0.5)*sin(theta) + u"', "divides by zero"),
        ('omega = "omega', "Line 8"),
        ("", "unknown symbol 'omega'"),
    ],
)
def test_a_broken_plant_file_is_one_clear_error(line, reason, tmp_path):
    path = tmp_path / "broken.toml"
    path.write_text(PLANT.replace('omega = "-9.81/l*sin(theta) + u"', line))
    assert reason in refused("analyse", str(path))


def test_unstable_poles_are_allowed_with_a_plain_warning():
    done = entry_point("design", "one_link_arm", "--controller-poles", "1,-2,-3")
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("warning: poles 1 are not in the open left half-plane")


@pytest.mark.filterwarnings("default::ulna.base.UlnaWarning")
def test_a_plant_without_the_form_answers_why():
    asked = ["design", "ball_and_beam", "--controller-poles", "-1,-2,-3,-4"]
    done = ulna(*asked)
    assert done.exit_code == 0
    assert "exact: it has no controller form: [g, ad_f g] leaves span{g, ad_f g" in " ".join(done.stderr.split())


def test_a_usage_error_has_status_2_too():
    assert ulna("simulate").exit_code == 2
    assert ulna("simulate", "one_link_arm", "--time", "5").exit_code == 2
    assert ulna("simulate", "one_link_arm", "--seed", "-1").exit_code == 2
    assert ulna("frobnicate").exit_code == 2
