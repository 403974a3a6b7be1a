"""`study_prosthesis`: the comparison on the presets asked for, as a folder with a page and its data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.table import Table as TextTable

from ulna.plants import preset, presets
from ulna.plot.save import svg_text
from ulna.report import output_folder, render_page, results_text
from ulna.studies.prosthesis.comparison import Comparison, compare, plain_results
from ulna.studies.prosthesis.demonstration import demonstrate
from ulna.studies.prosthesis.emg_recording import read_recording
from ulna.studies.prosthesis.emg_signal import Recording
from ulna.studies.prosthesis.figures import demonstration_figure, spread_figure, task_figure
from ulna.studies.prosthesis.live import drive_blocks, muscle_blocks
from ulna.studies.prosthesis.page import COLUMNS, document
from ulna.studies.prosthesis.plant import Bench, bench_of

PLANTS = 200
"""Plants of each arm in the full comparison."""
QUICK_PLANTS = 12
QUICK_PRESET = "transhumeral_elbow"
CURVES = ("reach", "follow", "pick_up", "push")
"""Tasks whose curves are drawn."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProsthesisStudy:
    """The result of `study_prosthesis`: comparisons, the same as plain data, the folder and its page."""

    found: tuple[Comparison, ...]
    results: Mapping[str, Any]
    folder: Path
    page: Path


def study_prosthesis(
    out: str | Path,
    *,
    names: Sequence[str] = (),
    quick: bool = False,
    recording: Recording | str | Path | None = None,
    calibration: Recording | str | Path | None = None,
    mains: float = 50.0,
) -> ProsthesisStudy:
    """The comparison of the controllers, with `index.html`, which needs nothing else, and `results.json` in a folder.

    Args:
        out: the folder; new, empty, or an earlier output, which is replaced.
        names: presets; all where left out, with `quick` the elbow alone.
        quick: few plants.
        recording: muscle signals for the section on intent, or their file; synthetic ones where left out.
        calibration: the same muscles at their greatest contraction; see `demonstrate`.
        mains: frequency that the notch takes out of the muscle signals, Hz.

    Raises:
        UlnaError: an unknown preset, one that cannot lift its load, a recording or folder that cannot be used.
    """
    chosen = [preset(name) for name in names] or ([preset(QUICK_PRESET)] if quick else list(presets()))
    benches = [bench_of(each) for each in chosen]
    shown = demonstrate(benches[0], _read(recording), calibration=_read(calibration), mains=mains)
    folder = Path(out)
    with output_folder(folder) as place:
        found, pictures = _compared(benches, QUICK_PLANTS if quick else PLANTS)
        pictures["muscles"] = svg_text(demonstration_figure(shown), prefix="muscles-")
        results = {
            "quick": quick,
            "muscles": shown.said,
            "presets": {each.bench.preset.name: plain_results(each) for each in found},
        }
        (place / "results.json").write_text(results_text(results), encoding="utf-8")
        live = {each.bench.preset.name: drive_blocks(each) for each in found} | {"muscles": muscle_blocks(found[0])}
        page = render_page(document(found, pictures, shown.said, live))
        (place / "index.html").write_text(page, encoding="utf-8")
    return ProsthesisStudy(found=found, results=results, folder=folder, page=folder / "index.html")


def summary_table(study: ProsthesisStudy) -> TextTable:
    """A table for the terminal: the best contender of every measure, by arm."""
    table = TextTable(title="Best at what 95 of 100 plants stay below", title_justify="left")
    table.add_column("measure")
    for each in study.found:
        table.add_column(each.bench.preset.name)
    for task, measure, heading in COLUMNS:
        cells = []
        for each in study.found:
            best = each.best(task, measure, 0.95)
            value = "" if best is None else f" {each.entries[best.key, task].quantile(measure, 0.95):.3g}"
            cells.append("nobody" if best is None else f"{best.title}{value}")
        table.add_row(f"{task.replace('_', ' ')}: {heading.split(': ')[-1]}", *cells)
    return table


def _read(recording: Recording | str | Path | None) -> Recording | None:
    return read_recording(recording) if isinstance(recording, str | Path) else recording


def _compared(benches: Sequence[Bench], count: int) -> tuple[tuple[Comparison, ...], dict[str, str]]:
    """The comparisons and their pictures; one arm is drawn while the next one runs."""
    with ThreadPoolExecutor(max_workers=1) as drawing:
        found, drawn = [], []
        for bench in benches:
            found.append(compare(bench, count=count))
            drawn.append(drawing.submit(_pictures, found[-1]))
        return tuple(found), {name: text for each in drawn for name, text in each.result().items()}


def _pictures(found: Comparison) -> dict[str, str]:
    """Every figure of an arm as SVG text by name."""
    name = found.bench.preset.name
    pictures = {
        f"{name}-spread": svg_text(spread_figure(found), prefix=f"{name}-spread-"),
    }
    for key in CURVES:
        pictures[f"{name}-{key}"] = svg_text(task_figure(found, key), prefix=f"{name}-{key}-")
    return pictures
