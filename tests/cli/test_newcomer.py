"""A newcomer with a plant of her own: what is typed first, at 80 columns and on a narrow terminal."""

from __future__ import annotations

import re
import shlex

import pytest
from terminal import answered, parse, refused, ulna
from typer.testing import CliRunner

from ulna.cli.completion import QUESTIONS, complete_plant, complete_question, plant_names
from ulna.cli.main import COMMANDS, app
from ulna.design import analyse
from ulna.plants import model, models

SEESAW = '''
name = "seesaw"
[parameters]
half_length_of_the_board = { value = 1.3, unit = "m" }
mass_of_the_ball = { value = 0.35, unit = "kg" }
g = { value = 9.81, unit = "m/s^2" }
inertia_of_the_board = { value = 0.4, unit = "kg*m^2" }
[states]
tilt = { unit = "rad", equation = "rate" }
rate = { unit = "rad/s", equation = """
(u - mass_of_the_ball*g*x*cos(tilt) - 2*mass_of_the_ball*x*v*rate)/(mass_of_the_ball*x**2 + inertia_of_the_board)""" }
x = { unit = "m", equation = "v" }
v = { unit = "m/s", equation = "x*rate**2 - g*sin(tilt)" }
[inputs]
u = { unit = "N*m" }
[outputs]
y = { unit = "m", equation = "x" }
'''


def narrow(columns: int, *arguments: str) -> str:
    done = CliRunner().invoke(app, list(arguments), env={"COLUMNS": str(columns)})
    assert done.exit_code == 0, done.output
    return done.stdout


@pytest.fixture(scope="module")
def seesaw(tmp_path_factory):
    path = tmp_path_factory.mktemp("own") / "seesaw.toml"
    path.write_text(SEESAW)
    return str(path)


def test_a_new_plant_file_is_analysed_and_simulated(tmp_path):
    path = str(tmp_path / "pole.toml")
    assert "ulna analyse" in ulna("new", path).stdout
    assert answered("analyse", path, "--question", "linearizable_at_point") == {
        "linearizable_at_point": {"verdict": "proved", "value": True}
    }
    run = answered("simulate", path, "--best", "--initial", "0.5,0", "--settle", "y")
    assert run["settling"][0]["time"] is not None
    assert "it is there already" in refused("new", path)
    assert "does not end in .toml" in refused("new", str(tmp_path / "pole"))
    assert "cannot be written" in refused("new", str(tmp_path / "nowhere" / "pole.toml"))


@pytest.mark.parametrize("columns", [48, 80])
def test_an_analysis_fits_and_cuts_no_name(seesaw, columns):
    wide, shown = narrow(400, "analyse", seesaw), narrow(columns, "analyse", seesaw)
    assert max(len(line) for line in shown.splitlines() if not line.startswith("    ulna ")) <= columns
    words = set(re.findall(r"[A-Za-z_]\w+", wide))
    assert {w for w in re.findall(r"[A-Za-z_]\w+", shown) if w not in words} == set()


def test_an_analysis_begins_with_what_it_is_what_is_in_the_way_and_what_comes_next(seesaw):
    said = " ".join(narrow(80, "analyse", seesaw).split("at the point")[0].split())
    assert said.startswith("seesaw (4 states, 1 input, 1 output) cannot be linearised as a whole by static feedback")
    assert "In the way: the input fields are not involutive" in said
    assert said.endswith(f"ulna design {seesaw}")


@pytest.mark.parametrize(
    ("plant", "words"),
    [
        ("one_link_arm", ("through its output y", "Nothing stands in the way")),
        ("unicycle", ("it is flat", "--extend")),
        ("lorenz", ("has no input", "there is no input")),
        ("pvtol", ("lets the rest diverge",)),
        ("khalil_sine_chain", ("linearised as a whole",)),
    ],
)
def test_each_kind_of_plant_has_its_sentences_and_its_next_command_works(plant, words):
    said = narrow(100, "analyse", plant)
    head = " ".join(said.split("at the point")[0].split())
    assert all(word in head for word in words), head
    command = next(line.strip() for line in said.splitlines() if line.startswith("    ulna "))
    assert ulna(*shlex.split(command)[1:]).exit_code == 0, command


def test_one_question_is_answered_alone_and_a_wrong_one_is_refused(seesaw):
    assert list(answered("analyse", seesaw, "--question", "involutive")) == ["involutive"]
    assert "Did you mean involutive" in refused("analyse", seesaw, "--question", "involutivity")
    assert list(analyse(model("duffing"), questions=["T", "relative_degree"])) == ["relative_degree", "T"]


def test_a_plant_rests_wherever_a_state_is_free_though_its_input_there_is_no_decimal(tmp_path):
    cylinder = tmp_path / "cylinder.toml"
    cylinder.write_text(
        '[states]\nx = "v"\nv = "p - v - 2"\np = "u*sqrt(5 - p) - p"\n[inputs]\nu = {}\n[outputs]\ny = "x"\n'
    )
    [point] = answered("analyse", str(cylinder), "--question", "rest_points")["rest_points"]["value"]
    assert {name: round(value, 9) for name, value in point["states"].items()} == {"x": 0, "v": 0, "p": 2}


def test_rest_points_are_looked_for_where_it_is_said():
    near = answered("analyse", "duffing", "--question", "rest_points", "--within", "x1=0.5:2")
    assert all(0.5 <= point["states"]["x1"] <= 2 for point in near["rest_points"]["value"])
    assert "lower one first" in refused("analyse", "duffing", "--within", "x1=2:1")


def test_evidence_comes_on_demand_and_never_reads_as_its_opposite():
    assert len(ulna("analyse", "cart_pole", "--json").stdout) < 20_000
    told = answered("analyse", "cart_pole", "--evidence")
    assert "because" not in told["full_state_linearizable"]["evidence"]
    assert told["full_state_linearizable"]["evidence"]["claim"]
    assert told["linearizing_outputs"]["evidence"]["fails"] == "G_2 is involutive"


def test_typed_poles_stay_and_fractions_come_on_demand():
    arm = ["design", "one_link_arm", "--controller-poles=-2+3.46j,-2-3.46j,-8"]
    said = narrow(80, *arm)
    assert "(127.773, 47.9716, 12)" in said
    assert "-2-3.46j, -2+3.46j, -8" in said
    assert not re.search(r"\d{7}", said)
    assert "79858/625" in narrow(80, *arm, "--exact")


def test_the_catalogue_is_searched_and_copied(tmp_path):
    assert [row["name"] for row in answered("models", "cart", "force")] == ["cart_pole"]
    two = answered("models", "--linearisable", "--inputs", "2")
    assert two
    assert all(row["linearisable"] and row["inputs"] == 2 for row in two)
    path = tmp_path / "mine.toml"
    assert ulna("models", "cart-pole", "--export", str(path)).exit_code == 0
    assert "[catalogue" not in path.read_text()
    assert answered("analyse", str(path), "--question", "relative_degree")["relative_degree"]["value"] == [2]
    assert "plants are left" in refused("models", "--linearisable", "--export", str(tmp_path / "b.toml"))
    assert "No plant of the catalogue" in ulna("models", "zeppelin").stdout


def test_help_is_shown_as_it_is_written():
    said = narrow(80, "analyse", "--help")
    assert narrow(80, "analyse", "-h") == said
    assert "--within NAME=LOW:HIGH" in said
    assert "output[=target]" in narrow(80, "simulate", "-h").lower()
    assert max(map(len, narrow(80, "simulate", "--help").splitlines())) <= 80


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_can_be_asked_for_help(name):
    assert narrow(80, name, "-h").startswith(f"Usage: ulna {name}")


@pytest.mark.parametrize("name", ["", "new", "models", "analyse", "design", "simulate"])
def test_examples_of_the_help_can_be_typed(name):
    said = narrow(80, *([name] if name else []), "-h")
    shown = [line.strip() for line in said.replace("\\\n", "").splitlines() if line.startswith("  ulna ")]
    assert shown
    for command in shown:
        parse(command.removeprefix("ulna "))


def test_plants_files_and_questions_complete(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("cart.toml", "notes.txt"):
        (tmp_path / name).write_text("")
    (tmp_path / "cases").mkdir()
    assert complete_plant("ca") == [n for n in plant_names() if n.startswith("ca")] + ["cart.toml", "cases/"]
    assert complete_plant("./ca") == ["./cart.toml", "./cases/"]
    assert complete_plant("nowhere/") == []
    assert complete_question("invo") == ["involutive"]
    assert set(QUESTIONS) == set(analyse(model("duffing")))
    assert set(plant_names()) == {entry.name for entry in models()}


def test_a_run_says_how_far_over_how_fast_and_at_what_effort():
    arm = ["simulate", "one_link_arm", "--controller-poles=-4,-5,-6", "--initial", "1,0,0"]
    said = narrow(80, *arm)
    assert re.search(r"y to 0 rad: settles \(2 %\) in \d\.\d+ s, overshoot [\d.]+ %", said)
    assert re.search(r"u: effort [\d.]+ V RMS, at most [\d.]+ V", said)
    assert max(map(len, said.splitlines())) <= 80
    assert "e-1" not in said  # no dust
    figures = answered(*arm)["figures"]
    assert figures["outputs"]["y"]["target"] == 0.0
    assert figures["inputs"]["u"]["peak"] > 0
    follows = answered("simulate", "one_link_arm", "--controller-poles=-4,-5,-6", "--track", "--reference", "y=sin(t)")
    assert abs(follows["figures"]["following"]["y"]["last"]) < 1e-6
    assert "figures" not in answered("simulate", "one_link_arm", "--initial", "1,0,0")


def test_a_held_point_is_the_target_where_no_reference_is_given():
    tank = answered("simulate", "quadruple_tank", "--best", "--horizon", "20")
    assert all(each["target"] != 0.0 for each in tank["figures"]["outputs"].values())
