"""The entry point of `ulna`. A command is imported when it is asked for: help and completion answer at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.main import get_command

from ulna import __version__
from ulna.cli.help import UlnaTyper
from ulna.cli.terminal import UlnaGroup

COMMANDS: dict[str, tuple[str, str]] = {
    "new": ("new:new", "Write a commented plant file to begin with."),
    "models": ("list_models:list_models", "List, search and export plants of the catalogue."),
    "analyse": ("analyse:analyse", "Say what a plant is and what can be done with it."),
    "identify": ("identify:identify", "Find parameters of a plant from logs, and how surely."),
    "design": ("design:design", "Design a law, an observer, or both."),
    "simulate": ("simulate:simulate", "Run a plant alone or in a loop, with its hardware."),
    "prove": ("prove:prove", "Prove which runs of a loop converge."),
    "check": ("check:check", "Prove a certificate again, by a second program."),
    "sweep": ("sweep:sweep", "Run a loop many times with whatever varies."),
    "studio": ("studio:studio", "Write a page on which a loop is driven by hand."),
    "report": ("report:report", "Write all that is known of a plant and its loop on one page."),
    "replay": ("replay:replay", "Compute one run of a sweep again."),
    "excite": ("excite:excite", "Find the input from which parameters come out most surely."),
    "export": ("export:app", "Write a loop as C for a processor, or as an FMU."),
    "reproduce": ("reproduce:reproduce", "Recompute the paper, equation by equation."),
    "study": ("study:app", "Compare controllers of a powered prosthesis."),
}
"""Module and name of each command below `ulna.cli`, and what the list of commands says of it."""


class _Loaded(Mapping[str, Any]):
    """The commands by name, each imported at its first use."""

    def __init__(self) -> None:
        self._made: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._made:
            module, _, attribute = COMMANDS[name][0].partition(":")
            found = getattr(import_module(f"ulna.cli.{module}"), attribute)
            if not isinstance(found, typer.Typer):
                program = UlnaTyper("", cls=UlnaGroup)
                program.command(name)(found)
                found = program
            self._made[name] = get_command(found)
            self._made[name].name = name
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(COMMANDS)

    def __len__(self) -> int:
        return len(COMMANDS)


class _Ulna(UlnaGroup):
    def __init__(self, **keywords: Any) -> None:
        super().__init__(**keywords)
        self.commands = _Loaded()

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002 (Typer's signature)
        return list(COMMANDS)

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])


_HELP = """From a nonlinear plant written as equations to a proven output-feedback controller.

    `ulna design -h` says what `ulna design` takes, and so on for every command.

    Examples:
        ulna new arm.toml
        ulna analyse arm.toml
        ulna design arm.toml
        ulna simulate arm.toml --best --initial 0.5,0 --plot run.png
        ulna models pendulum
    """

app = UlnaTyper(_HELP, name="ulna", cls=_Ulna, complete=True)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"ulna {__version__}")
        raise typer.Exit


@app.callback()
def _main(
    _version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and leave.")
    ] = False,
) -> None: ...
