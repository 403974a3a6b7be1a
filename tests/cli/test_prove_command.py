"""`ulna prove` and `ulna check`, as typed."""

from __future__ import annotations

from pathlib import Path

import pytest
from terminal import answered, refused, ulna, written

PLANT = """
name = "swing"
[states]
q = "p"
p = "-sin(q) + u"
[inputs]
u = {}
[outputs]
y = "q"
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
    proof.write_text(text.replace('"8"', '"3/2"'))
    changed = ulna("check", str(proof))
    assert changed.exit_code == 1
    assert "refuted" in changed.output


def test_a_verdict_is_no_mistake(plant: str) -> None:
    shown = ulna("prove", plant, *LAW, "--within", "q=40", "--patience", "2")
    assert shown.exit_code == 0, shown.output
    assert "proved:" not in shown.output


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ([*LAW, "--period", "1e-3"], "there is no theorem here yet for a loop on a processor"),
        ([*LAW, "--out", "nowhere/proof.json"], "--out 'nowhere/proof.json': its folder does not exist"),
        (["--limit", "8"], "no controller commands what they limit"),
        ([*LAW, "--within", "angle=1"], "the loop has no such state. Known: q, p"),
        ([*LAW, "--set-point", "--reference", "y=sin(t)"], "it moves, and the proof is about rest"),
    ],
)
def test_mistakes_are_one_line(plant: str, options: list[str], reason: str) -> None:
    assert reason in refused("prove", plant, *options)


def test_a_file_that_is_no_certificate_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.json").write_text("{")
    assert "not JSON" in refused("check", str(tmp_path / "x.json"))
    assert "a pipe or a device" in refused("check", "/dev/zero")
