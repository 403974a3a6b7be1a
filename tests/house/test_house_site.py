"""The documentation site: it builds, its links lead somewhere, it asks the network for nothing."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# Scripts, styles, fonts and pictures that a browser would fetch by itself; a link that somebody clicks is no request.
FETCHED = re.compile(r"""<(?:script|img|iframe|source)[^>]*\ssrc=["']?https?:|<link[^>]*\shref=["']?https?:""")


def _build(folder: Path, pages: Path | None = None) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mkdocs", "build", "--site-dir", folder]
    given = {**os.environ, "ULNA_GALLERY": "duffing", "NO_MKDOCS_2_WARNING": "1"}
    if pages is not None:
        settings = pages.parent / "mkdocs.yml"
        settings.write_text("site_name: x\nstrict: true\nvalidation: {links: {not_found: warn}}\n", encoding="utf-8")
        command += ["--config-file", settings]
    return subprocess.run(command, cwd=ROOT, env=given, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    done = _build(folder)
    assert done.returncode == 0, done.stderr
    return folder


def test_the_site_has_a_page_for_every_document(site: Path) -> None:
    written = [p.relative_to(ROOT / "docs").with_suffix(".html") for p in (ROOT / "docs").rglob("*.md")]
    assert [str(page) for page in written if not (site / page).exists()] == []
    assert (site / "gallery" / "duffing.html").exists()


def test_formulas_are_set_without_a_script(site: Path) -> None:
    text = (site / "theory" / "bracket.html").read_text(encoding="utf-8")
    assert text.count("<math") > 15
    assert "arithmatex" not in text


def test_the_reference_shows_every_public_name_and_command(site: Path) -> None:
    import ulna

    names = "".join(page.read_text(encoding="utf-8") for page in (site / "reference" / "python").glob("*.html"))
    assert [name for name in ulna.__all__ if name != "__version__" and f".{name}" not in names] == []
    commands = (site / "reference" / "command-line.html").read_text(encoding="utf-8")
    assert all(f"ulna {word}" in commands for word in ("analyse", "simulate", "export c", "study prosthesis"))


def test_no_page_asks_the_network_for_anything(site: Path) -> None:
    pages = list(site.rglob("*.html"))
    assert len(pages) > 20
    assert [str(p.relative_to(site)) for p in pages if FETCHED.search(p.read_text(encoding="utf-8"))] == []


@pytest.mark.parametrize(
    "text", ['<script src="https://example.org/x.js">', "<link rel=stylesheet href=https://example.org/a.css>"]
)
def test_a_request_is_noticed(text: str) -> None:
    assert FETCHED.search(text)


def test_a_link_that_leads_nowhere_stops_the_build(tmp_path: Path) -> None:
    pages = tmp_path / "docs"
    pages.mkdir()
    (pages / "index.md").write_text("[there](nowhere.md)\n", encoding="utf-8")
    done = _build(tmp_path / "site", pages)
    assert done.returncode != 0
    assert "nowhere.md" in done.stdout + done.stderr
