"""Documents: the README's Python runs, links lead somewhere, no file knows the machine it was written on."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PYTHON_BLOCKS = re.findall(r"^```python\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "changelog.d").glob("*.md")])
TEXT = {
    ".cfg",
    ".css",
    ".html",
    ".in",
    ".ipynb",
    ".j2",
    ".js",
    ".json",
    ".md",
    ".py",
    ".toml",
    ".txt",
    ".yaml",
    ".yml",
    "",
}
HOME = re.compile(r"(?<![\w.])/(?:home|root|Users|work|tmp)/[\w.]")


def test_the_readme_shows_python() -> None:
    assert PYTHON_BLOCKS


def test_the_readmes_python_runs_from_top_to_bottom(tmp_path: Path) -> None:
    program = tmp_path / "readme.py"
    program.write_text("\n".join(PYTHON_BLOCKS), encoding="utf-8")
    result = subprocess.run(
        [sys.executable, "-W", "error", program], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_between_documents_lead_somewhere(document: Path) -> None:
    links = re.findall(r"\]\((?!https?:|#)([^)#\s]+)", document.read_text(encoding="utf-8"))
    assert [link for link in links if not (document.parent / link).exists()] == []


def test_no_file_names_a_folder_of_the_machine_it_was_written_on() -> None:
    listing = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],  # noqa: S607 (git is on every path)
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    files = [ROOT / name for name in listing.stdout.split("\0") if name and Path(name).suffix in TEXT]
    assert [
        str(path.relative_to(ROOT))
        for path in files
        if path.is_file() and path != Path(__file__) and HOME.search(path.read_text(encoding="utf-8"))
    ] == []


@pytest.mark.parametrize("text", ["/home/somebody/ulna", 'open("/tmp/x")', "see /root/.cache"])
def test_a_folder_of_a_machine_is_noticed(text: str) -> None:
    assert HOME.search(text)


@pytest.mark.parametrize("text", ["https://example.org/home/page", "docs/work/flow", "a / b"])
def test_other_slashes_are_left_alone(text: str) -> None:
    assert not HOME.search(text)
