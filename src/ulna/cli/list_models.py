"""`ulna models`: what the catalogue holds."""

from __future__ import annotations

from typing import Annotated

import typer

from ulna.cli.session import console, print_json


def list_models(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON for machines.")] = False,
) -> None:
    """List the plants of the catalogue: what each is, what it teaches and where it comes from."""
    from ulna.models.catalogue import models

    if as_json:
        rows = [{"name": m.name, "text": m.text, "teaches": m.teaches, "source": m.source} for m in models()]
        print_json(rows)
        return
    from rich.table import Table

    table = Table(title="plants of the catalogue", title_justify="left")
    for heading in ("name", "what it is", "what it teaches", "source"):
        table.add_column(heading, no_wrap=heading == "name", overflow="fold")
    for entry in models():
        table.add_row(entry.name, entry.text, entry.teaches, entry.source)
    console().print(table)
