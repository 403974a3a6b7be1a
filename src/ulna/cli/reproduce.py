"""`ulna reproduce`: the paper, equation by equation."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ulna.cli.options import AsJson
from ulna.cli.terminal import console, print_json, progress


def reproduce(
    out: Annotated[Path, typer.Option(help="Folder for the report, its data and figures.")] = Path("reproduction"),
    as_json: AsJson = False,
) -> None:
    """Recompute every numbered equation of the paper, compare it with what is printed, and write a report."""
    from ulna.studies.paper import reproduce as run
    from ulna.studies.paper import summary_table

    with progress("reproducing the paper"):
        study = run(out)
    if as_json:
        print_json(study.results)
        return
    console().print(summary_table(study))
    typer.echo(f"report: {study.page}")
