"""`ulna studio`, as typed."""

from __future__ import annotations

from pathlib import Path

from terminal import ulna, written

from ulna.cli.asked_run import LONGEST


def test_a_plant_without_a_controller_is_shown_with_the_reason_in_one_line(tmp_path: Path) -> None:
    plant = written('name="p"\n[states]\nx="-x"\n[inputs]\nu={}\n[outputs]\ny="x"\n', tmp_path / "p.toml")
    done = ulna("studio", plant, "--out", str(tmp_path / "p.html"))
    line = next(each for each in done.output.splitlines() if each.startswith("no controller: "))
    assert len(line) <= LONGEST + len("no controller: ")
    assert (tmp_path / "p.html").is_file()
