"""`reproduce`: the whole study of the paper, from the plant to the folder with the report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table as TextTable

from ulna.plot import save_figure
from ulna.plot.save import svg_text
from ulna.report import output_folder, render_page, results_text
from ulna.sim import Trajectory
from ulna.studies.paper.carry import check_chain
from ulna.studies.paper.chain import number_chain
from ulna.studies.paper.convergence import convergence
from ulna.studies.paper.exact import exact_design, known_results, paper_choices
from ulna.studies.paper.figures import draw
from ulna.studies.paper.judge import count, judge, judge_claims
from ulna.studies.paper.live import free_blocks, loop_blocks
from ulna.studies.paper.loops import Controller, controllers
from ulna.studies.paper.notation import read_formula
from ulna.studies.paper.page import Findings, document
from ulna.studies.paper.passive import Passive, passive_forearm
from ulna.studies.paper.printed import Paper, paper
from ulna.studies.paper.runs import ANGLE, Loop, causes, loops, uncontrolled
from ulna.studies.paper.tables import results
from ulna.system import equilibria

_TURNS = (-2.0 * np.pi, 2.0 * np.pi)
_DOTS_PER_INCH = 130.0
_HOLDS = ("index.html", "results.json", "figures/*.svg", "figures/*.png", "trajectories/*.nc")


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """The result of `reproduce`.

    Attributes:
        findings: everything that was found.
        results: the same as plain data, as in `results.json`.
        folder: where the report lies; page: its `index.html`.
    """

    findings: Findings
    results: Mapping[str, Any]
    folder: Path
    page: Path


def reproduce(out: str | Path) -> Study:
    """Recompute the paper and write the report into a folder, whole or not at all.

    In the folder: `index.html` (needs nothing else), `results.json`, `figures/*.svg` and `*.png`, `trajectories/*.nc`.

    Args:
        out: the folder; it must be new, empty, or an earlier output, which is replaced.

    Raises:
        UlnaError: a folder that cannot be written or holds something else. Nothing is changed then.
    """
    folder = Path(out)
    with output_folder(folder, holds=_HOLDS) as place:
        found, free, bad = _find(paper())
        angles = _initial_angles(found.paper)
        data = results(
            found.paper,
            found.exact,
            found.judged,
            found.claims,
            found.loops,
            found.convergence,
            found.causes,
            found.rests,
            found.passive,
        )
        (place / "results.json").write_text(results_text(data), encoding="utf-8")
        _write_trajectories(place / "trajectories", found.loops, free, found.passive)
        figures = draw({loop.key: loop for loop in found.loops}, free, found.rests, found.passive)
        pictures = _write_figures(place / "figures", figures)
        live = {"free": free_blocks(angles), "loop": loop_blocks(found.exact, bad, angles)}
        (place / "index.html").write_text(render_page(document(found, pictures, live)), encoding="utf-8")
    return Study(findings=found, results=data, folder=folder, page=folder / "index.html")


def summary_table(study: Study) -> TextTable:
    """A table for the terminal: how the equations stand, and where each loop ends."""
    table = TextTable(title="The paper, equation by equation", title_justify="left")
    table.add_column("")
    table.add_column("", justify="right")
    for finding, number in count(study.findings.judged).items():
        table.add_row(f"equations: {finding.value}", str(number))
    table.add_section()
    for loop in study.findings.loops:
        error = loop.steady_error_degrees
        table.add_row(f"steady error: {loop.title}", f"{0.0 if abs(error) < 1e-6 else error:.2f}°")
    return table


def _find(printed: Paper) -> tuple[Findings, tuple[Trajectory, ...], Controller]:
    """What is found, the runs without voltage, and the controller as it is printed."""
    choices = paper_choices(printed)
    exact = exact_design(choices)
    chain = check_chain(
        number_chain(
            printed,
            exact.named(exact.view.f),
            exact.named(exact.view.g),
            choices=choices,
            known=known_results(exact),
        )
    )
    good, bad = controllers(chain)
    angles = _initial_angles(printed)
    ran = loops(exact, good, bad, angles)
    rests = equilibria(exact.plant, {ANGLE: _TURNS})
    found = Findings(
        paper=printed,
        exact=exact,
        judged=judge(printed, exact, chain),
        claims=judge_claims(printed, exact, rests, ran),
        loops=ran,
        convergence=convergence(exact, ran),
        causes=causes(exact, good, bad),
        rests=rests,
        passive=passive_forearm(),
    )
    return found, uncontrolled(exact, angles), bad


def _initial_angles(printed: Paper) -> tuple[float, ...]:
    return tuple(float(read_formula(str(angle))) for angle in printed.entry("initial_angles", "angles"))


def _write_figures(place: Path, figures: Mapping[str, Figure]) -> dict[str, str]:
    """Write every figure as SVG and PNG; return the SVG texts by name."""
    place.mkdir()
    pictures: dict[str, str] = {}
    for name, figure in figures.items():
        pictures[name] = svg_text(figure, prefix=f"{name}-")
        figure.set_layout_engine("none")  # laid out once, by the first drawing
        (place / f"{name}.svg").write_text(pictures[name], encoding="utf-8")
        save_figure(figure, place / f"{name}.png", dots_per_inch=_DOTS_PER_INCH)
    return pictures


def _write_trajectories(place: Path, ran: tuple[Loop, ...], free: tuple[Trajectory, ...], passive: Passive) -> None:
    place.mkdir()
    for run in free:
        run.to_netcdf(place / f"uncontrolled_from_{run[ANGLE][0]:g}_rad.nc")
    for loop in ran:
        for entry in loop.runs:
            entry.trajectory.to_netcdf(place / f"{loop.key}_from_{entry.angle:g}_rad.nc")
    for release in passive.releases:
        release.nonlinear.to_netcdf(place / f"forearm_from_{release.degrees:g}_degrees.nc")
        release.linear.to_netcdf(place / f"forearm_linear_from_{release.degrees:g}_degrees.nc")
