"""`ulna models`: what the catalogue holds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ulna.cli.completion import complete_plant_name
from ulna.cli.files import write_text
from ulna.cli.layout import say
from ulna.cli.options import AsJson
from ulna.cli.terminal import print_json

if TYPE_CHECKING:
    from ulna.plants import Model


def list_models(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="WORD",
            help="Plants whose name, text or source has all these words.",
            autocompletion=complete_plant_name,
        ),
    ] = None,
    linearisable: Annotated[
        bool | None,
        typer.Option("--linearisable/--not-linearisable", help="Plants that are full-state linearisable, or are not."),
    ] = None,
    states: Annotated[int | None, typer.Option(min=1, help="Plants with this many states.")] = None,
    inputs: Annotated[int | None, typer.Option(min=0, help="Plants with this many inputs.")] = None,
    outputs: Annotated[int | None, typer.Option(min=0, help="Plants with this many outputs.")] = None,
    export: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the plant file of the one found, 'mine.toml'.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List the plants of the catalogue: what each is, what it teaches and where it comes from.

    Examples:
        ulna models
        ulna models pendulum
        ulna models --linearisable --inputs 2
        ulna models cart_pole --export mine.toml
    """
    from ulna.plants import models

    sizes = {"states": states, "inputs": inputs, "outputs": outputs}
    found = [
        entry
        for entry in models()
        if _has(entry, words or [])
        and (linearisable is None or entry.answers.get("full_state_linearizable") is linearisable)
        and all(count is None or getattr(entry, name) == count for name, count in sizes.items())
    ]
    if export is not None:
        _export(found, words or [], export)
    elif as_json:
        print_json([_row(entry) for entry in found])
    else:
        for entry in found:
            _show(entry)
        if not found:
            say("No plant of the catalogue matches. `ulna models` lists all.")


def _has(entry: Model, words: list[str]) -> bool:
    text = f"{entry.name} {entry.name.replace('_', ' ')} {entry.text} {entry.teaches} {entry.source}".lower()
    return all(word.lower() in text or word.lower().replace("-", "_") in text for word in words)


def _row(entry: Model) -> dict[str, Any]:
    told = {name: getattr(entry, name) for name in ("name", "text", "teaches", "source", "states", "inputs", "outputs")}
    return told | {"linearisable": entry.answers.get("full_state_linearizable")}


def _show(entry: Model) -> None:
    sizes = ((entry.states, "state"), (entry.inputs, "input"), (entry.outputs, "output"))
    size = ", ".join(f"{count} {word}{'' if count == 1 else 's'}" for count, word in sizes)
    typer.echo(f"{typer.style(entry.name, bold=True)}  ({size})")
    for text in (entry.text, entry.teaches):
        say(text, indent=4)
    if entry.source:
        say(f"source: {entry.source}", indent=4, hanging=2)


def _export(found: list[Model], words: list[str], file: Path) -> None:
    from ulna.base import PlantError
    from ulna.plants import plant_text

    named = [entry for entry in found if [entry.name] == [word.replace("-", "_") for word in words]]
    chosen = named or found
    if len(chosen) != 1:
        names = ", ".join(entry.name for entry in found[:5])
        text = f"{len(found)} plants are left{f' ({names}, ...)' if found else ''}."
        raise PlantError(f"--export '{file}'", text, "Give the name of one: ulna models cart_pole --export mine.toml.")
    write_text(file, plant_text(chosen[0].name))
    typer.echo(f"{file} is written. Next: ulna analyse {file}")
