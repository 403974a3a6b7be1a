"""Help as plain text: options by panels, examples as they are typed, nothing read as markup."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperCommand, TyperGroup

from ulna.base import UlnaError
from ulna.cli.files import refuse_own_input
from ulna.cli.wording import mistyped

if TYPE_CHECKING:
    from typer.core import TyperOption

EXAMPLES = "Examples:"
"""The line of a docstring below which commands stand as they are typed."""


def examples(text: str | None) -> list[str]:
    """The commands that a docstring shows below its line `Examples:`."""
    _, _, shown = (text or "").partition(EXAMPLES)
    return [line.strip() for line in shown.splitlines() if line.strip()]


class UlnaCommand(TyperCommand):
    """A command whose help shows its options by panels and its examples unwrapped."""

    def format_help_text(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002 (Typer's signature)
        """Write what the command does, then its examples."""
        _write_text(self.help, formatter)

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write arguments and options, each panel under its name."""
        _write_options(self, ctx, formatter)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the line; a value that an option cannot take is a mistake like all others."""
        try:
            return super().parse_args(ctx, args)
        except typer.BadParameter as error:
            mistake = mistyped(error)
            if mistake is None:
                raise
            raise mistake from None

    def invoke(self, ctx: Any) -> Any:
        """Run the command, unless an option is empty or it would write over what it reads."""
        for each in self.params:
            source = ctx.get_parameter_source(each.name)
            typed = each.opts[0].startswith("-") and source is not None and source.name == "COMMANDLINE"
            if typed and ctx.params.get(each.name) in ("", [""], ("",)):
                # What a shell makes of a variable that is not set.
                raise UlnaError(max(each.opts, key=len), "its value is empty.", "Give one, or leave the option out.")
        refuse_own_input(ctx.params)
        return super().invoke(ctx)


class PlainGroup(TyperGroup):
    """A group of such commands."""

    def format_help_text(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002
        """Write what the commands do, then examples."""
        _write_text(self.help, formatter)

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the commands first, then the options of all of them."""
        self.format_commands(ctx, formatter)
        _write_options(self, ctx, formatter)


class UlnaTyper(typer.Typer):
    """A Typer program of such commands."""

    def __init__(self, told: str, *, cls: type[TyperGroup], name: str | None = None, complete: bool = False) -> None:
        super().__init__(
            name=name,
            cls=cls,
            help=told,
            add_completion=complete,
            no_args_is_help=True,
            context_settings={"help_option_names": ["-h", "--help"]},
            rich_markup_mode=None,
            pretty_exceptions_enable=False,
        )

    def command(self, name: str | None = None, **settings: Any) -> Any:
        """As `Typer.command`, of this kind of command."""
        return super().command(name, **{"cls": UlnaCommand, **settings})


def _write_text(text: str | None, formatter: Any) -> None:
    told, _, _ = (text or "").partition(EXAMPLES)
    for paragraph in told.strip().split("\n\n"):
        formatter.write_paragraph()
        with formatter.indentation():
            formatter.write_text(" ".join(paragraph.split()))
    if shown := examples(text):
        with formatter.section(EXAMPLES.rstrip(":")):
            for command in shown:
                formatter.write("".join(f"{line}\n" for line in _over_lines(command, formatter)))


def _over_lines(command: str, formatter: Any) -> list[str]:
    """A command that can be copied: over several lines it is broken before options only."""
    lines = [" " * formatter.current_indent]
    for k, part in enumerate(command.split(" --")):
        text = f" --{part}" if k else part
        if k and len(lines[-1]) + len(text) > formatter.width - 2:
            lines[-1] += " \\"
            lines.append(" " * (formatter.current_indent + 3))
        lines[-1] += text
    return lines


def _write_options(command: Any, ctx: Any, formatter: Any) -> None:
    panels: dict[str, list[tuple[str, str]]] = {}
    for panel, record in _records(command.get_params(ctx), ctx):
        panels.setdefault(panel, []).append(record)
    for panel, records in panels.items():
        with formatter.section(panel):
            formatter.write_dl(records)


def _records(parameters: list[TyperOption], ctx: Any) -> Iterator[tuple[str, tuple[str, str]]]:
    for each in parameters:
        if record := each.get_help_record(ctx):
            usual = "Arguments" if each.param_type_name == "argument" else "Options"
            yield getattr(each, "rich_help_panel", None) or usual, record
