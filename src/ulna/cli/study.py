"""`ulna study`: studies beyond the paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ulna.cli.options import AsJson
from ulna.cli.terminal import UlnaGroup, console, print_json, progress

app = typer.Typer(cls=UlnaGroup, help="Studies beyond the paper.", no_args_is_help=True)


@app.command()
def prosthesis(
    preset: Annotated[list[str] | None, typer.Option(help="An arm; again for more. All where left out.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="One arm, few plants.")] = False,
    emg: Annotated[
        Path | None, typer.Option(help="A recording of two muscles: CSV of time in s, flexor and extensor in V.")
    ] = None,
    emg_calibration: Annotated[
        Path | None,
        typer.Option(help="The same muscles at their greatest contraction; else the strongest tenth of --emg counts."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for the page and its data.")] = Path("prosthesis"),
    as_json: AsJson = False,
) -> None:
    """Compare controllers on arms with real drives and unknown loads, and write a page."""
    from ulna.studies.prosthesis import study_prosthesis, summary_table

    with progress("comparing controllers"):
        study = study_prosthesis(out, names=preset or (), quick=quick, recording=emg, calibration=emg_calibration)
    if as_json:
        print_json(study.results)
        return
    console().print(summary_table(study))
    typer.echo(f"page: {study.page}")


@app.callback()
def _studies() -> None:
    """Studies beyond the paper."""
