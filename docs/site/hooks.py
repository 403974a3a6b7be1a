"""What MkDocs asks of us: pages made from the package itself, pages that live at the root, formulas as MathML."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from api import api_pages
from command_line import command_line_page
from gallery import gallery_pages
from mkdocs.structure.files import File, Files

from ulna.base import mathml

ROOT = Path(__file__).parents[2]
# Pages of the repository that the site shows as well, and what their links into docs/ become there.
ROOT_PAGES = {"project/contributing.md": "CONTRIBUTING.md", "project/changelog.md": "CHANGELOG.md"}
_SHIM = re.compile(r"https://[^\"']*/iframe-worker/shim")
_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[\[(](.*?)\\[\])]</\1>', flags=re.DOTALL)


def on_files(files: Files, *, config: Any) -> Files:
    """Add the pages that nobody writes by hand."""
    for place, text in _pages():
        files.append(File.generated(config, place, content=text))
    return files


def _pages() -> Iterator[tuple[str, str]]:
    for place, source in ROOT_PAGES.items():
        yield place, _moved((ROOT / source).read_text(encoding="utf-8"))
    yield "reference/command-line.md", command_line_page()
    yield from api_pages()
    yield from gallery_pages()


def _moved(text: str) -> str:
    """The text of a page at the root as it stands in project/: links into docs/ go up, others become plain text."""
    text = re.sub(r"\]\(docs/([^)]+\.md[^)]*)\)", r"](../\1)", text)
    return re.sub(r"\[([^\]]+)\]\((?!https?:|\.\./|#)[^)]+\)", r"\1", text)


def on_page_markdown(markdown: str, *, page: Any, config: Any, files: Files) -> str:
    """Links from docs/ to files of the repository that are no page become plain text."""
    del page, config, files
    return re.sub(r"\[([^\]]+)\]\((?:\.\./)+(?:benchmarks|src|tests|changelog\.d)/[^)]*\)", r"\1", markdown)


def on_page_content(html: str, *, page: Any, config: Any, files: Files) -> str:
    """Formulas in LaTeX become MathML, which browsers set without a script and without network."""
    del page, config, files
    return _FORMULA.sub(lambda found: mathml(_unescaped(found[2]), display=found[1] == "div"), html)


def _unescaped(text: str) -> str:
    return text.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&").strip()


def on_post_page(output: str, *, page: Any, config: Any) -> str:
    """The script that makes the search work in pages opened from a folder comes with the site, not from elsewhere."""
    del config
    return _SHIM.sub("../" * page.url.count("/") + "site/iframe-worker.js", output)


def on_post_template(output_content: str, *, template_name: str, config: Any) -> str:
    """The same for the page that says that there is none."""
    del template_name, config
    return _SHIM.sub("site/iframe-worker.js", output_content)
