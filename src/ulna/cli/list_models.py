"""`ulna models`: what the catalogue holds."""

from __future__ import annotations

from ulna.cli.options import AsJson
from ulna.cli.terminal import console, print_json


def list_models(
    as_json: AsJson = False,
) -> None:
    """List the plants of the catalogue: what each is, what it teaches and where it comes from."""
    from ulna.plants import models

    if as_json:
        rows = [{"name": m.name, "text": m.text, "teaches": m.teaches, "source": m.source} for m in models()]
        print_json(rows)
        return
    from rich.markup import escape
    from rich.table import Table

    table = Table(title="plants of the catalogue", title_justify="left", show_lines=True)
    table.add_column("name", no_wrap=True)
    table.add_column("what it is, what it teaches, where it comes from", overflow="fold")
    for entry in models():
        lines = (escape(entry.text), escape(entry.teaches), f"[dim]{escape(entry.source)}[/]" if entry.source else "")
        table.add_row(entry.name, "\n".join(one for one in lines if one))
    console().print(table)
