"""`ulna study prosthesis` through its entry point: a page that needs nothing else, and one line for every mistake."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(sys.executable).with_name("ulna")


def _study(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [str(PROGRAM), "study", "prosthesis", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_the_quick_study_writes_a_page_that_needs_nothing_else_and_its_data(tmp_path: Path) -> None:
    out = tmp_path / "study"
    result = _study("--quick", "--out", out)
    assert result.returncode == 0, result.stderr
    assert "index.html" in result.stdout
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "animateTransform" in page
    assert "<script" not in page
    assert not re.search(r"(?:src|href)=\"https?:", page)
    results = json.loads((out / "results.json").read_text(encoding="utf-8"))
    assert list(results["presets"]) == ["transhumeral_elbow"]
    assert set(results["presets"]["transhumeral_elbow"]["tasks"]) == {
        "reach",
        "hold",
        "follow",
        "pick_up",
        "drop",
        "push",
    }


def test_an_unknown_preset_is_one_line(tmp_path: Path) -> None:
    result = _study("--preset", "human_scal", "--out", tmp_path / "study")
    assert result.returncode == 2
    assert "human_scale" in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "study").exists()


def test_a_recording_of_one_channel_is_one_line_before_anything_runs(tmp_path: Path) -> None:
    recording = tmp_path / "one.csv"
    recording.write_text("\n".join(f"{k / 1000},0.1" for k in range(100)), encoding="utf-8")
    result = _study("--quick", "--emg", recording, "--out", tmp_path / "study")
    assert result.returncode == 2
    assert "one channel" in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "study").exists()
