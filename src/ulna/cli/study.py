"""`ulna study`: studies beyond the paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ulna.base import DesignError
from ulna.cli.help import UlnaTyper
from ulna.cli.options import AsJson
from ulna.cli.terminal import UlnaGroup, console, print_json, progress

app = UlnaTyper("Studies beyond the paper.", cls=UlnaGroup)


@app.command()
def prosthesis(
    preset: Annotated[list[str] | None, typer.Option(help="An arm. Repeatable. Left out: all.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="One arm, few plants.")] = False,
    emg: Annotated[
        Path | None,
        typer.Option(help="A recording of one or two muscles: text (times in s or ms, or none), EDF, BDF, XDF."),
    ] = None,
    emg_calibration: Annotated[
        Path | None,
        typer.Option(help="The same muscles at their greatest contraction; else the strongest tenth of --emg counts."),
    ] = None,
    rate: Annotated[float | None, typer.Option(help="Samples a second of --emg, where it does not say them.")] = None,
    muscles: Annotated[
        str, typer.Option(help="Columns of --emg, by name or number: flexor,extensor. Found by name where left out.")
    ] = "",
    envelope: Annotated[
        bool | None, typer.Option("--envelope/--raw", help="Whether --emg is an envelope; found out where left out.")
    ] = None,
    mains: Annotated[float, typer.Option(help="Frequency that the notch takes out of --emg, Hz.")] = 50.0,
    out: Annotated[Path, typer.Option(help="Folder for the page and its data.")] = Path("prosthesis"),
    as_json: AsJson = False,
) -> None:
    """Compare controllers on arms with real drives and unknown loads, and write a page."""
    from ulna.studies.prosthesis import Recording, read_recording, study_prosthesis, summary_table

    def read(place: Path | None) -> Recording | None:
        named = tuple(each.strip() for each in muscles.split(",") if each.strip())
        return None if place is None else read_recording(place, rate=rate, muscles=named, envelope=envelope)

    if emg is None and (rate is not None or muscles or envelope is not None):
        raise DesignError("options of a recording", "there is no recording.", "Give its file: --emg FILE.")
    recording, calibration = read(emg), read(emg_calibration)
    with progress("comparing controllers"):
        study = study_prosthesis(
            out, names=preset or (), quick=quick, recording=recording, calibration=calibration, mains=mains
        )
    if as_json:
        print_json(study.results)
        return
    if emg is not None:
        typer.echo(study.results["muscles"])
    console().print(summary_table(study))
    typer.echo(f"page: {study.page}")


@app.callback()
def _studies() -> None:
    """Studies beyond the paper."""
