import json
import subprocess
import sysconfig
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ulna.cli.main import app

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


def ulna(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


def entry_point(*arguments: str) -> subprocess.CompletedProcess[str]:
    program = Path(sysconfig.get_path("scripts")) / "ulna"
    return subprocess.run([str(program), *arguments], capture_output=True, text=True, check=False)


@pytest.fixture
def plant(tmp_path):
    path = tmp_path / "pendulum.toml"
    path.write_text(PLANT)
    return path


def test_models_are_listed_for_people_and_machines():
    assert "one_link_arm" in ulna("models").output
    rows = json.loads(ulna("models", "--json").output)
    assert {"name", "text", "teaches", "source"} == set(rows[0])


def test_a_plant_file_is_analysed_through_the_real_entry_point(plant):
    done = entry_point("analyse", str(plant), "--json")
    assert done.returncode == 0, done.stderr
    answers = json.loads(done.stdout)
    assert answers["full_state_linearizable"] == {
        "verdict": "proved",
        "value": True,
        "evidence": answers["full_state_linearizable"]["evidence"],
    }
    assert answers["relative_degree"]["value"] == [2]
    assert answers["T"]["value"] == ["theta", "omega"]
    assert all(set(entry) == {"verdict", "value", "evidence"} for entry in answers.values())


def test_the_papers_compensator_is_designed_from_the_catalogue(tmp_path):
    out = tmp_path / "compensator.toml"
    done = ulna("design", "one_link_arm", *ARM_POLES, "--json", "--out", str(out))
    assert done.exit_code == 0, done.output
    made = json.loads(done.stdout)
    assert made["observer_form"]["gains"] == [["990"], ["299"], ["30"]]
    assert made["observer"]["gains"] == [["20"], ["(4049 - 1764*sin(theta_hat))/51"], ["-100"]]
    assert made["compensator"]["inputs"].keys() == {"y"}
    assert out.exists()
    # The controller is a plant file like any other.
    refused = ulna("analyse", str(out))
    assert "is not affine in the input y" in refused.stderr


def test_a_closed_loop_is_simulated_drawn_and_written(tmp_path):
    drawn, written = tmp_path / "run.svg", tmp_path / "run.nc"
    done = ulna(
        "simulate", "one_link_arm", *ARM_POLES, "--initial", "-1,0,0", "--plot", str(drawn), "--out", str(written)
    )
    assert done.exit_code == 0, done.output
    assert drawn.read_text().lstrip().startswith("<?xml")
    assert written.stat().st_size > 1000
    data = json.loads(ulna("simulate", "one_link_arm", *ARM_POLES, "--initial", "-1,0,0", "--json").stdout)
    assert data["outcome"] == "finished"
    assert abs(data["signals"]["theta"][-1]) < 1e-3


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["analyse", "nowhere.toml"], "cannot be read"),
        (["analyse", "one_link_arn"], "Did you mean one_link_arm"),
        (["design", "one_link_arm"], "neither a law nor an observer is asked for"),
        (["design", "one_link_arm", "--controller-poles", "-1,-2"], "2 given (-1, -2), 3 needed"),
        (["design", "one_link_arm", "--controller-poles", "-1+2j,-2,-3"], "conjugate"),
        (["design", "one_link_arm", "--controller-poles", "-1,,-3"], "an entry is empty"),
        (["design", "one_link_arm", "--controller-poles", "-1,__import__('os'),-3"], "not a finite number"),
        (["design", "forearm", "--controller-poles", "-1,-2"], "there are no inputs"),
        (["simulate", "one_link_arm", "--initial", "1,0"], "2 numbers, 3 states (theta, omega, i)"),
        (["simulate", "one_link_arm", "--initial", "1,0,x"], "unknown symbol 'x'"),
        (["simulate", "one_link_arm", "--initial", "1,0,0", "--time", "-1"], "positive --time"),
        (["simulate", "one_link_arm", "--initial", "1,0,0", "--time", "nan"], "positive --time"),
        (["simulate", "one_link_arm", "--initial", "1,0,0", "--input", "v=1"], "inputs are: u"),
        (
            ["simulate", "one_link_arm", "--initial", "1,0,0", "--observer-poles", "-1,-2,-3"],
            "an observer is asked for without a law",
        ),
        (["simulate", "one_link_arm", "--initial", "1,0,0", "--out", "run.xls"], "neither .csv nor .nc"),
        (["simulate", "one_link_arm", "--initial", "1,0,0", "--out", "no/such/folder/run.csv"], "cannot be written"),
        (["simulate", "one_link_arm", "--initial", "1,0,0", "--out", "no/such/folder/run.nc"], "written"),
        (["simulate", "one_link_arm", "--initial", "1,0,0", "--plot", "no/such/folder/run.png"], "no/such/folder"),
    ],
)
def test_a_users_mistake_is_one_clear_error_with_status_2(arguments, reason, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = ulna(*arguments)
    assert done.exit_code == 2, done.output
    assert reason in done.stderr
    assert done.stderr.startswith("error: ")
    assert "Traceback" not in done.output
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ('omega = "-9.81/l*sin(thet) + u"', "Did you mean 'theta'"),
        ("omega = \"__import__('os').system('true')\"", "unknown function '__import__'"),
        ('omega = "theta.real"', "no part of a formula"),
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
    done = ulna("analyse", str(path))
    assert done.exit_code == 2, done.output
    assert reason in done.stderr
    assert "Traceback" not in done.output


def test_unstable_poles_are_allowed_with_a_plain_warning():
    done = entry_point("design", "one_link_arm", "--controller-poles", "1,-2,-3")
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("warning: poles 1 are not in the open left half-plane")


def test_a_plant_without_the_form_answers_why():
    done = ulna("design", "ball_and_beam", "--controller-poles", "-1,-2,-3,-4")
    assert done.exit_code == 2
    assert "leaves span{g, ad_f g, ad_f^2 g}" in done.stderr


def test_a_usage_error_has_status_2_too():
    assert ulna("simulate", "one_link_arm").exit_code == 2
    assert ulna("frobnicate").exit_code == 2
