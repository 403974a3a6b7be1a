"""`ulna study prosthesis` through its entry point: a page that needs nothing else, and one line for every mistake."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

PROGRAM = Path(sys.executable).with_name("ulna")


def _study(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [str(PROGRAM), "study", "prosthesis", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_the_quick_study_on_counts_of_a_converter_writes_a_page_that_needs_nothing_else_and_its_data(
    tmp_path: Path,
) -> None:
    recording = tmp_path / "adc.txt"
    noise = np.random.default_rng(1).standard_normal((4000, 2))
    effort = np.where(np.arange(4000) > 2500, 80.0, 2.0)[:, None] * [1, 0.02] + 1
    counts = np.clip(np.round(512 + effort * noise), 0, 1023).astype(int)
    rows = (f"{2 * k}\t{a}\t{b}" for k, (a, b) in enumerate(counts.tolist()))
    recording.write_text("\n".join(["ms\tbiceps\ttriceps", *rows]), encoding="utf-8")
    out = tmp_path / "study"
    result = _study("--quick", "--emg", recording, "--mains", "60", "--out", out)
    assert result.returncode == 0, result.stderr
    said = result.stdout.splitlines()[0]
    assert said.startswith("adc.txt: 2 muscles (biceps, triceps) at 500 Hz; ms")
    for words in ("tabs", "offset 512 removed", "band 20 to 225 Hz", "triceps never contracts"):
        assert words in said
    assert json.loads((out / "results.json").read_text(encoding="utf-8"))["muscles"] == said
    assert "index.html" in result.stdout
    page = (out / "index.html").read_text(encoding="utf-8")
    assert (
        page.count("<iframe") == 2
    )  # the arms to drive by hand and the muscles, apart from the page and standing still
    assert '"paused":true' in page
    assert not re.search(r"<(?:script|animate)", re.sub(r"srcdoc='[^']*'", "", page))
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


def test_a_recording_of_three_channels_is_one_line_before_anything_runs(tmp_path: Path) -> None:
    recording = tmp_path / "three.csv"
    lines = ["time [ms],a,b\x1b[2J,c", *(f"{k},0.1,{k % 7},{k % 5 - 2}" for k in range(1, 100))]
    recording.write_bytes("\n".join(lines).replace("\x1b[2J", "\x85\x9b2J").encode())
    result = _study("--quick", "--emg", recording, "--muscles", "a,d", "--out", tmp_path / "study")
    assert result.returncode == 2
    assert "--muscles 'a," in result.stderr
    assert "\x9b" not in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "study").exists()


def test_options_of_a_recording_without_one_are_refused(tmp_path: Path) -> None:
    result = _study("--quick", "--rate", "1000", "--out", tmp_path / "study")
    assert result.returncode == 2
    assert "--emg FILE" in result.stderr
