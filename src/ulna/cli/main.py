"""The entry point of `ulna`. Commands import what they need when they run: help and completion answer at once."""

from __future__ import annotations

from typing import Annotated

import typer

from ulna import __version__
from ulna.cli.analyse import analyse
from ulna.cli.check import check
from ulna.cli.design import design
from ulna.cli.export import app as export
from ulna.cli.list_models import list_models
from ulna.cli.prove import prove
from ulna.cli.replay import replay
from ulna.cli.reproduce import reproduce
from ulna.cli.simulate import simulate
from ulna.cli.study import app as study
from ulna.cli.sweep import sweep
from ulna.cli.terminal import UlnaGroup

app = typer.Typer(
    name="ulna",
    cls=UlnaGroup,
    help="From a nonlinear plant written as equations to a proven output-feedback controller.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
app.command("models")(list_models)
app.command()(analyse)
app.command()(design)
app.command()(simulate)
app.command()(sweep)
app.command()(replay)
app.command()(prove)
app.command()(check)
app.command()(reproduce)
app.add_typer(export, name="export")
app.add_typer(study, name="study")


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"ulna {__version__}")
        raise typer.Exit


@app.callback()
def _main(
    _version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and leave.")
    ] = False,
) -> None:
    """From a nonlinear plant written as equations to a proven output-feedback controller."""
