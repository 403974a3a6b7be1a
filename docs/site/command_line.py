"""The reference of the command line, read from the program itself."""

from __future__ import annotations

from typing import Any

import typer.main

from ulna.cli.main import app

_MARKUP = str.maketrans({"<": "&lt;", "|": "&#124;", "\n": " "})


def command_line_page() -> str:
    """One section for each command: what it does, its arguments and options."""
    top = typer.main.get_command(app)
    sections = [section for name, command in _commands("ulna", top) for section in _section(name, command)]
    return "\n".join(["# Command line", "", "What `--help` of each command says, on one page.", "", *sections])


def _commands(name: str, command: Any) -> list[tuple[str, Any]]:
    inner = getattr(command, "commands", None)
    if inner is None:
        return [(name, command)]
    return [found for word, part in inner.items() if not part.hidden for found in _commands(f"{name} {word}", part)]


def _section(name: str, command: Any) -> list[str]:
    rows = [row for parameter in command.params if not getattr(parameter, "hidden", False) for row in _row(parameter)]
    table = ["| option | meaning |", "|---|---|", *rows] if rows else []
    return [f"## {name}", "", _plain(command.help or ""), "", *table, ""]


def _row(parameter: Any) -> list[str]:
    if parameter.param_type_name == "argument":
        return [f"| `{(parameter.metavar or parameter.name).upper()}` | {_cell(getattr(parameter, 'help', ''))} |"]
    flags = ", ".join(f"`{flag}`" for flag in [*parameter.opts, *parameter.secondary_opts])
    return [f"| {flags} | {_cell(parameter.help)} |"]


def _cell(text: str | None) -> str:
    return (text or "").translate(_MARKUP)


def _plain(text: str) -> str:
    """A command's help as Markdown: its paragraphs, with what looks like markup escaped."""
    paragraphs = text.replace("\f", "").replace("\b\n", "").split("\n\n")
    return "\n\n".join(" ".join(paragraph.split()).replace("<", "&lt;") for paragraph in paragraphs)
