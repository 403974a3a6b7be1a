"""`ulna export c`, as typed."""

from __future__ import annotations

from pathlib import Path

import pytest
from compilers import GCC
from terminal import MASS, answered, refused, ulna, written

POLES = ["--controller-poles", "-2,-3", "--observer-poles", "-9,-10", "--period", "1e-3", "--limit", "5"]


@pytest.fixture
def plant(tmp_path: Path) -> str:
    return written(MASS, tmp_path / "mass.toml")


@pytest.mark.skipif(GCC is None, reason="there is no gcc")
def test_what_is_exported_is_compared_and_verified(plant: str, tmp_path: Path) -> None:
    folder = str(tmp_path / "c")
    data = answered("export", "c", plant, *POLES, "--initial", "x=1", "--out", folder, "--check")
    assert data["comparison"]["equal"] is True
    assert data["comparison"]["samples"] == 100_001
    assert data["number"] == "double"
    assert answered("export", "c", plant, *POLES, "--verify", folder)["belongs"] is True
    other = ulna("export", "c", plant, *POLES, "--delay", "1e-3", "--verify", folder)
    assert other.exit_code == 1
    assert "the design is" in other.output


def test_a_reference_may_stay_open(plant: str, tmp_path: Path) -> None:
    shown = ulna("export", "c", plant, *POLES, "--set-point", "--target", "cortex-m4f", "--out", str(tmp_path / "c"))
    assert shown.exit_code == 0, shown.output
    assert "references to set at each call: x_ref" in shown.output
    assert "operations on float every 0.001 s" in shown.output


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--controller-poles", "-2,-3", "--out", "c"], "the loop has no period. Give --period 1e-3"),
        ([*POLES], "--out and --verify: neither is given."),
        ([*POLES, "--out", "c", "--verify", "c"], "--out and --verify: both are given."),
        ([*POLES, "--out", "c", "--target", "avr"], "target 'avr': it is not known."),
        ([*POLES, "--verify", "nowhere"], "it has no design.json that ulna wrote"),
    ],
)
def test_mistakes_are_one_line(
    plant: str, options: list[str], reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert reason in refused("export", "c", plant, *options)
    assert not (tmp_path / "c").exists()


def test_fmus_are_written_by_part_and_version(plant: str, tmp_path: Path) -> None:
    shown = ulna("export", "fmu", plant, *POLES, "--out", str(tmp_path / "loop.fmu"))
    assert shown.exit_code == 0, shown.output
    assert "FMI 3.0 co-simulation of the loop" in shown.output
    data = answered("export", "fmu", plant, "--part", "plant", "--fmi", "2", "--out", str(tmp_path / "plant.fmu"))
    assert (data["fmi"], data["part"]) == (2, "plant")
    assert "it exists already" in refused("export", "fmu", plant, *POLES, "--out", str(tmp_path / "loop.fmu"))
    reason = "the loop has no period"
    assert reason in refused("export", "fmu", plant, "--controller-poles", "-2,-3", "--out", str(tmp_path / "x.fmu"))
