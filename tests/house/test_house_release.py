"""A release: the changelog is made of its fragments, and the wheel works without the tree."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from datetime import date
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def release() -> ModuleType:
    spec = importlib.util.spec_from_file_location("release", ROOT / ".ci" / "release.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_section_holds_the_fragments_by_kind(release, tmp_path) -> None:
    (tmp_path / "b.fixed.md").write_text("A fault was\nmended.\n")
    (tmp_path / "a.added.md").write_text("A thing was added.\n")
    (tmp_path / "README.md").write_text("how to")
    text = release.section("0.2.0", date(2026, 1, 2), release.read_fragments(tmp_path))
    assert text == "## 0.2.0 (2026-01-02)\n\n### Added\n\n- A thing was added.\n\n### Fixed\n\n- A fault was mended.\n"


def test_a_fragment_may_be_a_list(release, tmp_path) -> None:
    (tmp_path / "a.added.md").write_text("- One thing was\n  added.\n- So was a - b.\n")
    assert release.read_fragments(tmp_path)["added"] == ["One thing was added.", "So was a - b."]


def test_a_kind_that_is_not_known_is_refused_by_name(release, tmp_path) -> None:
    (tmp_path / "a.improved.md").write_text("It was improved.\n")
    with pytest.raises(SystemExit, match="'improved' is not a kind of change"):
        release.read_fragments(tmp_path)


def test_a_new_section_stands_before_the_older_ones(release) -> None:
    text = release.with_section(
        "# Changelog\n\nWords.\n\n## 0.1.0 (2025-01-01)\n\nOld.\n", "## 0.2.0 (2026-01-01)\n\nNew.\n"
    )
    assert text == "# Changelog\n\nWords.\n\n## 0.2.0 (2026-01-01)\n\nNew.\n\n## 0.1.0 (2025-01-01)\n\nOld.\n"


@pytest.mark.parametrize(("version", "current", "after"), [("0.10.0", "0.9.9", True), ("0.1.0", "0.1.0", False)])
def test_versions_are_compared_as_numbers(release, version, current, after) -> None:
    assert release.newer(version, current) is after


def test_the_fragments_of_this_tree_are_all_of_a_known_kind(release) -> None:
    # The README of the folder has no kind, so it is no fragment.
    assert (
        sum(map(len, release.read_fragments(ROOT / "changelog.d").values()))
        >= len(list((ROOT / "changelog.d").glob("*.md"))) - 1
    )


def test_the_wheel_works_outside_the_tree(tmp_path) -> None:
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", tmp_path, ROOT]
    subprocess.run(build, check=True, cwd=tmp_path)
    (wheel,) = tmp_path.glob("ulna-*.whl")
    home = tmp_path / "installed"
    unpack = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", home, wheel]
    subprocess.run(unpack, check=True, cwd=tmp_path)
    code = "import ulna; print(ulna.__file__); from ulna.cli.main import app; app(['analyse', 'duffing'])"
    environment = {**os.environ, "PYTHONPATH": str(home)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(str(home))
    assert "proved" in done.stdout
