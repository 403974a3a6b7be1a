"""The notebook runs in a kernel of its own, and what its values show is looked at in a browser."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nbformat
import pytest
from browser import Opened, chromium
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).parents[2] / "docs" / "first-loop.ipynb"
CUT = "[...document.querySelectorAll('td')].filter(cell => cell.scrollWidth > cell.clientWidth + 1).length"
"""How many cells of tables hide a part of what they hold."""


@pytest.fixture(scope="module")
def shown() -> list[Any]:
    """The outputs of the executed cells, in order; an exception of a cell is one of the test."""
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(notebook)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert not any(cell.outputs for cell in cells), "the notebook is kept without outputs"
    NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    return [output for cell in cells for output in cell.outputs]


@pytest.fixture(scope="module")
def opened(shown: list[Any], tmp_path_factory: pytest.TempPathFactory) -> Iterator[Opened]:
    tables = "".join(f"<section>{each.data['text/html']}</section>" for each in shown if "text/html" in each.data)
    page = tmp_path_factory.mktemp("notebook") / "page.html"
    head = '<!doctype html><html lang="en"><meta charset="utf-8"><title>notebook</title>'
    page.write_text(f'{head}<body class="ready" style="width:800px">{tables}', encoding="utf-8")
    with chromium() as browser:
        yield Opened(browser, page)


def test_every_cell_shows_a_formula_a_table_or_a_figure_and_no_warning(shown: list[Any]) -> None:
    assert {each.output_type for each in shown} == {"execute_result"}
    kinds = [set(each.data) - {"text/plain"} for each in shown]
    assert all(kinds)
    assert {"text/latex", "text/html", "image/png"} <= set().union(*kinds)


def test_formulas_are_complete_for_a_notebook(shown: list[Any]) -> None:
    for each in shown:
        text = each.data.get("text/latex", "$$")
        assert text.count("$") % 2 == 0
        assert text.count(r"\begin") == text.count(r"\end")


def test_tables_are_seen_whole_in_a_browser(opened: Opened) -> None:
    """No cell is empty of ink, none is wider than the page or cut, and formulas in them are drawn."""
    assert opened.complaints == []
    assert opened.value("document.querySelectorAll('table').length") >= 6
    empty = "[...document.querySelectorAll('th, td')].filter(c => c.getBoundingClientRect().height < 5).length"
    assert opened.value(empty) == 0
    assert opened.value(CUT) == 0
    assert opened.value("Math.min(...[...document.querySelectorAll('math')].map(m => m.clientWidth))") > 3


def test_what_tables_say_is_what_the_values_are(opened: Opened) -> None:
    told = opened.value("document.body.innerText")
    assert "reached the final time" in told
    assert "G_1 is involutive" in told
    assert "poles = (0, -2.6779, -7.3221)" in told  # the tilt of the arm at rest is exactly none
    assert "undefined" not in told
    assert "Matrix(" not in told


def test_a_table_that_is_cut_is_noticed(opened: Opened) -> None:
    opened.value("document.querySelector('td').style.cssText = 'display:block; width:3px; overflow:hidden'")
    assert opened.value(CUT) >= 1
