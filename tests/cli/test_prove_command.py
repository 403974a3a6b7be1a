"""`ulna prove` and `ulna check`, as typed."""

from __future__ import annotations

from pathlib import Path

import pytest
from terminal import answered, refused, ulna, written

PLANT = """
name = "swing"
[states]
q = "p"
p = "-sin(q) - drag*p + u"
[inputs]
u = {}
[outputs]
y = "q"
[parameters]
drag = { value = 1, range = [-9, 9] }
"""
LAW = ["--controller-poles", "-2,-3", "--limit", "8"]


@pytest.fixture
def plant(tmp_path: Path) -> str:
    return written(PLANT, tmp_path / "swing.toml")


def test_a_proof_is_written_checked_and_refused_where_it_was_changed(plant: str, tmp_path: Path) -> None:
    proof = tmp_path / "proof.json"
    data = answered("prove", plant, *LAW, "--within", "q=0.3, p=0.2", "--out", str(proof))
    assert data["status"] == "proved"
    assert data["half_axes"]["q"] > 0.3
    assert answered("check", str(proof))["right"] is True
    text = proof.read_text()
    proof.write_text(text.replace('"8"', '"1/4"'))
    changed = ulna("check", str(proof))
    assert changed.exit_code == 1
    assert "refuted" in changed.output


def test_a_loop_on_its_processor_ends_within_what_its_encoder_leaves_open(plant: str, tmp_path: Path) -> None:
    proof = tmp_path / "proof.json"
    typed = [*LAW, "--period", "0.01", "--encoder", "12", "--within", "q=0.1"]
    data = answered("prove", plant, *typed, "--out", str(proof))
    assert data["status"] == "proved"
    assert data["starts_within"] == {"q": 0.1}
    assert data["ends_within"]["q"] < 0.01
    assert answered("check", str(proof))["right"] is True
    slow = answered("prove", plant, *LAW, "--period", "1.2")
    assert slow["status"] == "undecided"
    assert slow["largest_eigenvalue"] > 1


@pytest.mark.parametrize("typed", ["drag=0.5..3", "drag=±40%", "drag = +-0.4", "drag=1/2..3"])
def test_a_range_of_a_parameter_is_proved_as_typed(typed: str, plant: str) -> None:
    data = answered("prove", plant, *LAW, "--over", typed)
    assert data["status"] == "proved"
    assert data["equilibrium"]["q"] == pytest.approx([0, 0], abs=1e-9)


def test_the_box_of_a_fit_is_proved(plant: str, tmp_path: Path) -> None:
    assert "none of them has a standard deviation" in refused("prove", plant, *LAW, "--over", "posterior")
    fitted = written(PLANT.replace("value = 1,", "value = 1, std = 0.1,"), tmp_path / "fitted.toml")
    assert "from 0.8 to 1.2" in answered("prove", fitted, *LAW, "--over", "posterior")["claim"]
    assert "from 0.7 to 1.3" in answered("prove", fitted, *LAW, "--over", "posterior=3")["claim"]
    assert "expected a positive number of standard" in refused("prove", fitted, *LAW, "--over", "posterior=-3")


def test_an_unstable_value_is_told() -> None:
    data = answered(
        "prove", "one_link_arm", "--controller-poles", "-4,-5,-6", "--observer-poles=-20,-21,-22", "--over", "m2=0..5kg"
    )
    assert data["status"] == "refuted"
    assert data["parameters"]["m2"] < 3


def test_what_is_set_is_what_is_proved() -> None:
    """Designed for 5 kg, the loop is unstable without a load."""
    typed = ["prove", "one_link_arm", "--controller-poles=-2+3.46j,-2-3.46j,-8", "--observer-poles=-20,-10+10j,-10-10j"]
    assert answered(*typed, "--global")["status"] == "proved"
    assert answered(*typed, "--global", "--set", "m2=0")["status"] == "refuted"


def test_a_verdict_is_no_mistake(plant: str) -> None:
    shown = ulna("prove", plant, *LAW, "--within", "q=40", "--boxes", "4000")
    assert shown.exit_code == 0, shown.output
    assert "proved:" not in shown.output


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ([*LAW, "--period", "1e-3", "--global"], "--global with --period: of a loop on a processor"),
        ([*LAW, "--out", "nowhere/proof.json"], "--out 'nowhere/proof.json': its folder does not exist"),
        (["--limit", "8"], "no controller commands what they limit"),
        ([*LAW, "--within", "angle=1"], "the loop has no such state. Known: q, p"),
        ([*LAW, "--over", "drag=1"], "--over 'drag=1': it has no bounds. Write --over \"drag=4..5\" or"),
        ([*LAW, "--over", "mass=1..2"], "there is no parameter 'mass'. Known: drag"),
        ([*LAW, "--over", "drag=2..1"], "2 to 1 is not a range of finite numbers"),
        ([*LAW, "--over", "drag=1..20"], "drag"),
        ([*LAW, "--over", "drag=1..2", "--global"], "--global with --over: these are 2 claims"),
        ([*LAW, "--set-point", "--reference", "y=sin(t)"], "it varies, and the proof is about an equilibrium"),
    ],
)
def test_mistakes_are_one_line(plant: str, options: list[str], reason: str) -> None:
    assert reason in refused("prove", plant, *options)


def test_a_file_that_is_no_certificate_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.json").write_text("{")
    assert "not JSON" in refused("check", str(tmp_path / "x.json"))
    assert "a pipe or a device" in refused("check", "/dev/zero")


def test_the_proved_region_is_drawn(plant: str, tmp_path: Path) -> None:
    picture = tmp_path / "region.png"
    done = ulna("prove", plant, *LAW, "--within", "q=0.3", "--plot", str(picture), "--plane", "p, q")
    assert done.exit_code == 0
    assert f"figure: {picture}" in done.output.replace("\n", "")
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("typed", "reason"),
    [
        (["--global", "--plot", "a.png"], "no region"),
        (["--plane", "p,q"], "none is asked for"),
        (["--within", "q=0.3", "--plot", "a.png", "--plane", "p"], "Name two"),
    ],
)
def test_a_figure_of_nothing_is_refused(typed: list[str], reason: str, plant: str) -> None:
    assert reason in refused("prove", plant, *LAW, *typed)
