"""Documents: the README's Python runs, links lead somewhere, no file knows the machine it was written on."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```python\n(.*?)^```$", flags=re.MULTILINE | re.DOTALL)
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


def _python_of(document: Path) -> list[str]:
    return BLOCK.findall(document.read_text(encoding="utf-8"))


def _executed(blocks: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """The blocks run in order as one program in an empty folder, warnings being errors."""
    program = folder / "page.py"
    program.write_text("\n".join(blocks), encoding="utf-8")
    command = [sys.executable, "-W", "error", program]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


SHOWING = [document for document in DOCUMENTS if _python_of(document)]


def test_the_readme_shows_python() -> None:
    assert ROOT / "README.md" in SHOWING


def _told(blocks: list[str]) -> list[str]:
    """What a page says is printed: the comment lines right below a line that prints."""
    below = re.findall(r"^print\(.*\)\n((?:#.*\n)+)", "\n".join(blocks), flags=re.MULTILINE)
    return [re.sub("^# ?", "", each, flags=re.MULTILINE) for each in below]


@pytest.mark.parametrize("document", SHOWING, ids=lambda path: str(path.relative_to(ROOT)))
def test_the_python_of_a_page_runs_from_top_to_bottom_and_prints_what_it_says(document: Path, tmp_path: Path) -> None:
    blocks = _python_of(document)
    done = _executed(blocks, tmp_path)
    assert done.returncode == 0, done.stderr
    assert [text for text in _told(blocks) if text not in done.stdout] == []


def test_what_a_page_says_is_printed_is_found() -> None:
    assert _told(["print(1)\n# 1\n#  u = 2\nx = 1\n# not printed\n", "print(x)  # in the line\n"]) == ["1\n u = 2\n"]


def test_a_page_whose_python_does_not_run_is_noticed(tmp_path: Path) -> None:
    assert "law" in _executed(["import math\n", "print(law)\n"], tmp_path).stderr


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
