"""The gallery: a page for each plant of the catalogue, made from its file: equations, answers, a run, a live loop.

`ULNA_GALLERY=cart_pole,duffing make docs` builds the pages of these plants only: seconds instead of minutes.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from html import escape
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import sympy as sp

import ulna
from ulna.base import FormulaError, UlnaError, mathml
from ulna.page import studio_text
from ulna.plot import svg_text

ANSWERS = {
    "relative_degree": "relative degree of the outputs",
    "full_state_linearizable": "linearisable by feedback",
    "linearizable_at_point": "… at the operating point",
    "flat_output_found": "flat output",
    "observability_rank": "observability rank",
    "observer_form": "observer form",
    "minimum_phase": "zero dynamics",
    "involutive": "involutive",
}
LONGEST = 160  # letters of a value on the page; the whole is in `ulna analyse NAME --json`


def gallery_pages() -> Iterator[tuple[str, str]]:
    """The overview, the page of each plant and its live page, by their places."""
    asked = [name for name in os.environ.get("ULNA_GALLERY", "").split(",") if name]
    plants = [model for model in ulna.models() if not asked or model.name in asked]
    rows = [f"| [`{m.name}`]({m.name}.md) | {_cell(m.text)} | {_cell(m.teaches)} |" for m in plants]
    head = ["# Gallery", "", "Every plant of the catalogue, with what ulna finds out about it by itself.", ""]
    yield "gallery/index.md", "\n".join([*head, "| plant | what it is | what it shows |", "|---|---|---|", *rows, ""])
    sys.path.insert(0, str(Path(__file__).parent))  # where the other processes find this file
    with ProcessPoolExecutor(max_workers=2, mp_context=get_context("spawn")) as crew:
        for model, (page, live) in zip(plants, crew.map(plant_pages, [m.name for m in plants]), strict=True):
            yield f"gallery/{model.name}.md", page
            if live:
                yield f"gallery/{_live(model.name)}", live


def _live(name: str) -> str:
    return f"{name}-live.html"


def plant_pages(name: str) -> tuple[str, str]:
    """The page of one plant in Markdown, and the page that drives it as HTML, empty where no controller is found."""
    model = next(m for m in ulna.models() if m.name == name)
    plant = ulna.model(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ulna.UlnaWarning)
        lines, live = _controller(name, plant)
        parts = [
            [f"# {name}", "", f"{escape(_sentence(model.text))} {escape(model.teaches)}", ""],
            [escape(_sentence(f"source: {model.source}")), ""] if model.source else [],
            ["## Equations", "", _equations(plant), "", _parameters(plant), ""],
            ["## What ulna finds", "", *_answers(plant), ""],
            ["## Controller", "", *lines, ""],
        ]
    return "\n".join(line for part in parts for line in part), live


def _equations(plant: ulna.System) -> str:
    try:
        formulas = mathml(plant._repr_latex_().strip("$"), display=True)
    except FormulaError:
        return f"```text\n{plant}\n```"
    return f'<div class="gallery-formulas">{formulas}</div>'


def _parameters(plant: ulna.System) -> str:
    signals = [("state", s) for s in plant.states] + [("input", s) for s in plant.inputs]
    rows = [f"| `{s.name}` | {kind} | {_cell(s.unit)} | {_cell(s.text)} | |" for kind, s in signals]
    for p in plant.parameters:
        rows.append(f"| `{p.name}` | parameter | {_cell(p.unit)} | {_cell(p.text)} | {_number(p.value)} |")
    return "\n".join(["| name | is a | unit | meaning | value |", "|---|---|---|---|---|", *rows])


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:].rstrip('.')}."


def _number(value: object) -> str:
    return "" if value is None else f"{float(str(sp.N(value))):.6g}"


def _answers(plant: ulna.System) -> list[str]:
    analysis = ulna.analyse(plant)
    rows = []
    for key, label in ANSWERS.items():
        if key in analysis:
            answer = analysis[key]
            rows.append(f"| {label} | {answer.verdict.status.value} | {_cell(_short(answer.value))} |")
    return ["| question | verdict | answer |", "|---|---|---|", *rows]


def _short(value: object) -> str:
    text = "–" if value is None else str(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} …"


def _controller(name: str, plant: ulna.System) -> tuple[list[str], str]:
    """What stands about the controller, and the live page."""
    try:
        made = ulna.controller_for(plant)
        lines = ["```text", str(made.law), *(f"not {kind}: {why}" for kind, why in made.passed.items()), "```", ""]
    except UlnaError as error:
        return ["No law is found by itself:", "", f"```text\n{error}\n```"], ""
    live = _driven(plant, made)
    link = f"**[Drive it]({_live(name)})**: the loop in your browser; the same as `ulna studio {name}`." if live else ""
    try:
        picture = _run(plant, made)
    except UlnaError:
        return [*lines, link], live
    shown = [f'<div class="gallery-formulas">{picture}</div>', "", f"`ulna simulate {name} --best`", "", link]
    return [*lines, *shown], live


def _driven(plant: ulna.System, made: ulna.Controller) -> str:
    """The page on which the loop is driven by hand, with a set point where it takes one; empty where there is none."""
    with suppress(UlnaError):  # else it holds its operating point
        made = ulna.controller_for(plant, reference=ulna.SetPoint())
    try:
        return studio_text(ulna.Loop(plant=plant, controller=made), paused=True)
    except UlnaError:
        return ""


def _run(plant: ulna.System, made: ulna.Controller) -> str:
    """A run of the loop from a point a little off the operating point, drawn."""
    numbers = plant.with_values()
    loop = ulna.close_loop(numbers, made)
    rest = ulna.equilibrium(numbers)
    start = [float(rest.values[s]) + 0.02 * max(1.0, abs(float(rest.values[s]))) for s in numbers.state_symbols]
    run = ulna.simulate(loop, start, np.linspace(0.0, 10.0, 401))
    return svg_text(ulna.plot_trajectory(run), prefix="run")


def _cell(text: str) -> str:
    return escape(text).replace("|", "&#124;").replace("\n", " ")
