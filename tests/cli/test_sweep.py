"""`ulna sweep` and `ulna replay`, as typed."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from terminal import MASS, answered, refused, ulna, written

from ulna.campaign import DaskWorkers, Replay

POLES = ["--controller-poles", "-2,-3", "--observer-poles", "-9,-10"]


@pytest.fixture
def plant(tmp_path: Path) -> str:
    return written(MASS, tmp_path / "mass.toml")


def test_a_sweep_answers_draws_goes_on_and_is_replayed(plant: str, tmp_path: Path) -> None:
    folder, drawn = tmp_path / "runs", tmp_path / "figures"
    command = ["sweep", plant, *POLES, "--vary", "m=uniform(0.9,1.1)", "--vary", "x=normal(1,0.1,0.5,1.5)"]
    command += ["--runs", "40", "--out", str(folder), "--batch-size", "16", "--horizon", "6", "--plot", str(drawn)]
    data = answered(*command)
    assert data["settled"]["count"] == data["runs"] == 40
    assert data["outcomes"] == {"finished": 40}
    assert sorted(path.name for path in drawn.iterdir()) == ["fan_x.svg", "settled_map.svg", "worst.svg"]
    assert answered(*command) == data
    worst = data["worst"][0]
    run = answered("replay", str(folder), "--run", str(worst["run"]), "--plot", str(tmp_path / "run.svg"))
    assert run["identical"]
    assert run["varied"] == worst["varied"]
    assert run["signals"]["x"][-1] == pytest.approx(worst["value"], abs=1e-12)
    page = tmp_path / "run.html"
    assert str(page) in ulna("studio", "--replay", str(folder), "--run", str(worst["run"]), "--out", str(page)).output
    assert '"kind":"replay"' in page.read_text(encoding="utf-8")
    assert "Leave them out" in refused("studio", "--replay", str(folder), "--run", "1", "--alone")
    assert "one of them is missing" in refused("studio", "--run", "1")
    shown = ulna("replay", str(folder), "--run", "0")
    assert "identical with the stored run, bit for bit" in shown.output
    other = refused(*[entry if entry != "40" else "41" for entry in command])
    assert "holds another campaign; other there: plan.runs (40, not 41)" in other


def test_a_sampled_sweep_over_a_grid_is_printed_for_people(plant: str, tmp_path: Path) -> None:
    done = ulna(
        *["sweep", plant, "--controller-poles", "-2,-3", "--vary", "m=steps(0.5,1.5,3)", "--vary", "x=values(-1,2)"],
        *["--out", str(tmp_path / "runs"), "--period", "0.01", "--limit", "5", "--horizon", "6"],
    )
    assert done.exit_code == 0, done.output
    assert "6 runs of 'mass' over m, x" in done.output
    assert "outcomes: 6 finished" in done.output
    assert "confidence" not in done.output  # a grid draws nothing by chance


def test_a_sweep_runs_a_written_controller_on_a_heavier_plant_that_follows_a_reference(
    plant: str, tmp_path: Path
) -> None:
    law, out = tmp_path / "law.json", tmp_path / "runs"
    assert ulna("design", plant, "--controller-poles", "-2,-3", "--track", "--out", str(law)).exit_code == 0
    asked = ["--set", "m=2 ", "--reference", "x=sin(t)", "--horizon", "3"]
    answered("sweep", plant, "--controller", str(law), *asked, "--vary", "x=values(0.5,1)", "--out", str(out))
    again = answered("replay", str(out), "--run", "1")
    assert again["identical"]
    alone = answered("simulate", plant, "--controller", str(law), *asked, "--initial", "x=1")
    assert again["signals"]["x"][-1] == pytest.approx(alone["signals"]["x"][-1], abs=1e-10)


def test_a_run_that_is_not_what_is_stored_has_status_1(plant: str, tmp_path: Path, monkeypatch) -> None:
    out = tmp_path / "runs"
    answered("sweep", plant, "--vary", "x=values(1,2)", "--out", str(out))
    monkeypatch.setattr(Replay, "differing", ("final_x",))
    done = ulna("replay", str(out), "--run", "0")
    assert done.exit_code == 1
    assert "NOT identical with the stored run: final_x" in done.output


def test_a_sweep_varies_a_set_point(plant: str, tmp_path: Path) -> None:
    asked = ["--controller-poles", "-2,-3", "--set-point", "--vary", "x_ref=values(1,2,3)", "--initial", "x=0.5"]
    data = answered("sweep", plant, *asked, "--out", str(tmp_path / "runs"), "--horizon", "9")
    assert data["settled"]["count"] == 3


def test_a_sweep_draws_from_what_a_fit_left_open(plant: str, tmp_path: Path) -> None:
    assert "Fit them to a record" in refused(
        "sweep", plant, *POLES, "--vary", "posterior", "--out", str(tmp_path / "a")
    )
    text = MASS.replace("value = 1,", "value = 1, std = 0.02,").replace("u/m", "k*u/m")
    text = text.replace("[states]", "k = { value = 1, std = 0.02 }\n[states]") + "[correlation]\nm = { k = 0.9 }\n"
    fitted = written(text, tmp_path / "fitted.toml")
    typed = ["--vary", "posterior", "--vary", "x=uniform(0.5,1.5)", "--runs", "32", "--horizon", "6"]
    data = answered("sweep", fitted, *POLES, *typed, "--out", str(tmp_path / "runs"))
    assert data["settled"]["count"] == 32
    assert answered("replay", str(tmp_path / "runs"), "--run", "3")["identical"]


def test_sobol_indices_are_printed(plant: str, tmp_path: Path) -> None:
    done = ulna(
        *["sweep", plant, *POLES, "--vary", "m=uniform(0.9,1.1)", "--vary", "x=uniform(0.5,2)", "--runs", "16"],
        *["--sampling", "indices", "--out", str(tmp_path / "runs")],
    )
    assert done.exit_code == 0, done.output
    assert "peak_error_x depends on" in done.output
    assert "(95% limits)" in done.output


def test_where_there_are_no_sobol_indices_the_reason_is_said_and_the_rest_answered(tmp_path: Path) -> None:
    plant = tmp_path / "runaway.toml"
    plant.write_text('name = "runaway"\n[states]\nx = "-x + x^2"\n[outputs]\ny = "x"\n')
    command = ["sweep", str(plant), "--vary", "x=uniform(0.5,3)", "--runs", "8", "--sampling", "indices"]
    done = ulna(*command, "--out", str(tmp_path / "runs"), "--worst-by", "settling_time_y")
    assert done.exit_code == 0, done.output
    assert "no Sobol indices of settling_time_y: it is not a finite number in" in done.output
    assert "blew up" in done.output


@pytest.mark.parametrize("folder", ["runs", "my runs"])
def test_the_command_for_the_worst_run_can_be_copied(plant: str, tmp_path: Path, monkeypatch, folder: str) -> None:
    monkeypatch.chdir(tmp_path)
    command = ["sweep", plant, *POLES, "--vary", "x=uniform(-1,1)", "--vary", "m=uniform(0.9,1.1)", "--runs", "9"]
    done = ulna(*command, "--out", folder, "--worst-by", "peak_u", "--map", "m,x", "--plot", "figures")
    assert done.exit_code == 0, done.output
    line = done.output.splitlines()[-1].removeprefix("the worst run again: ulna ")
    stored = answered(*shlex.split(line))["stored"]["peak_u"]
    from ulna.campaign import open_campaign

    assert stored == open_campaign(folder)["peak_u"].max()


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--vary", "mm=uniform(1,2)"], "Did you mean m"),
        (["--vary", "m=uniform(0,2)"], "its range is [0.5, 3]"),
        (["--vary", "m=uniform(2,1)"], "low is not below high"),
        (["--vary", "m=uniform(2)"], "1 numbers, uniform takes 2"),
        (["--vary", "m=cauchy(1,2)"], "'cauchy' is unknown"),
        (["--vary", "m 1 2"], "it cannot be read"),
        (["--vary", "m=uniform(1,2)", "--vary", "m=uniform(1,2)"], "is given twice"),
        (["--vary", "m=uniform(1,2)", "--vary", "x=steps(0,1,3)"], "it is random, while others are on a grid"),
        (["--vary", "m=uniform(1,2)", "--runs", "0"], "at least one"),
        (["--vary", "m=uniform(1,2)", "--horizon", "0"], "--horizon 0: expected a positive time"),
        (["--vary", "m=uniform(1,2)", "--period", "-1"], "positive time"),
        (["--vary", "m=uniform(1,2)", "--period", "99"], "longer than the run"),
        (["--vary", "m=uniform(1,2)", "--delay", "3"], "Give --period"),
        (["--vary", "m=uniform(1,2)", "--initial", "1"], "1 numbers, 2 states"),
        (["--vary", "m=uniform(1,2)", "--reference", "x=1"], "the loop follows no reference"),
        (["--vary", "m=uniform(1,2)", "--set", "m=9"], "its range is [0.5, 3]"),
        (["--vary", "m=uniform(1,2)", "--scheduler", "tcp://127.0.0.1:1"], "nothing answers there"),
        (["--vary", "m=uniform(1,2)", "--scheduler", "nowhere"], "this is not an address"),
        (["--vary", "m=steps(1,2,1e9)"], "not a number of steps from 1 to 100000"),
        (["--vary", "m=uniform(1,2)", "--batch-size", "0"], "at least one run"),
        (["--vary", "m=uniform(1,2)", "--map", "m,x"], "expected two of the varied quantities; varied: m"),
        (["--vary", "m=uniform(1,2)", "--runs", "5", "--worst-by", "peak_y"], "no such figure"),
    ],
)
def test_a_users_mistake_is_one_clear_error(
    plant: str, tmp_path: Path, arguments: list[str], reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(DaskWorkers.__init__.__kwdefaults__ or {}, "timeout", 1.0)  # s that nobody needs to wait here
    assert reason in refused("sweep", plant, *POLES, "--out", str(tmp_path / "runs"), *arguments)


@pytest.mark.parametrize(("folder", "reason"), [("nowhere", "no campaign.json"), (".", "no campaign.json")])
def test_a_folder_without_a_sweep_cannot_be_replayed(tmp_path: Path, folder: str, reason: str) -> None:
    assert reason in refused("replay", str(tmp_path / folder), "--run", "0")
