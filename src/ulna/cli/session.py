"""What every command shares: errors as one line and exit status 2, plants by file or name, numbers, output."""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar, cast

import typer
from typer.core import TyperGroup

from ulna.base.errors import UlnaError, UlnaWarning

if TYPE_CHECKING:
    from rich.console import Console

    from ulna.system import System


Options = TypeVar("Options")


class UlnaGroup(TyperGroup):
    """Commands whose user errors end in one clear message and exit status 2, without a traceback."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        warnings.showwarning = _show_warning
        try:
            return super().invoke(ctx)
        except UlnaError as error:
            typer.secho(f"error: {error}", fg=typer.colors.RED, err=True)
            raise typer.Exit(2) from None
        except BrokenPipeError:
            # The reader (head, less) went away; there is nobody left to tell.
            sys.stderr.close()
            raise typer.Exit(0) from None


def _show_warning(message: Warning | str, category: type[Warning], *_place: Any) -> None:
    if issubclass(category, UlnaWarning):
        typer.secho(f"warning: {message}", fg=typer.colors.YELLOW, err=True)


def plant(name: str) -> System:
    """The plant of a file or, where there is no such file, of the catalogue.

    Raises:
        UlnaError: if it is neither.
    """
    from ulna.plants import as_plant

    return as_plant(name)


def chosen(kind: Callable[..., Options], given: Mapping[str, Any]) -> Options:
    """The dataclass of options `kind` from a command's arguments of the same names; None stands for its default."""
    names = {field.name for field in fields(cast("Any", kind))}
    return kind(**{name: value for name, value in given.items() if name in names and value is not None})


def console() -> Console:
    """Where tables go."""
    from rich.console import Console

    return Console(highlight=False, soft_wrap=False)


@contextmanager
def progress(text: str) -> Iterator[None]:
    """Show that work goes on, on a terminal; elsewhere say nothing."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    with Console(stderr=True).status(text):
        yield


def line(value: Any, limit: int = 400) -> str:
    """A value as one line: vectors and one-row matrices without brackets, mappings as equations."""
    from ulna.report.results import plain

    text = _line(plain(value))
    return text if len(text) <= limit else f"{text[:limit]}… ({len(text)} characters; --json shows all)"


def _line(shape: Any) -> str:
    if shape is None:
        return "–"
    if isinstance(shape, dict):
        return "; ".join(f"{key} = {_line(part)}" for key, part in shape.items() if part not in ({}, []))
    if isinstance(shape, list):
        parts = [part[0] if isinstance(part, list) and len(part) == 1 else part for part in shape]
        return ", ".join(f"({_line(part)})" if isinstance(part, list | dict) else str(part) for part in parts)
    return str(shape)


def print_json(data: Any) -> None:
    """One JSON document on standard output; NaN and infinity become null."""
    typer.echo(json.dumps(_finite(data), indent=2, ensure_ascii=False))


def _finite(data: Any) -> Any:
    if isinstance(data, dict):
        return {str(key): _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    if isinstance(data, float) and not (float("-inf") < data < float("inf")):
        return None
    return data


def pole_list(text: str) -> list[str]:
    """The poles in a comma-separated text.

    Raises:
        UlnaError: for an empty entry.
    """
    poles = [part.strip() for part in text.split(",")]
    if not all(poles):
        raise UlnaError(f"poles '{text}'", "an entry is empty.", "Separate poles by commas: -9,-10,-11.")
    return poles


def number_list(text: str, what: str) -> list[float]:
    """The numbers in a comma-separated text, formulas such as pi/2 included.

    Raises:
        UlnaError: for an entry that is no number.
    """
    from ulna.symbolic.formulas.parse import parse_formula

    return [float(parse_formula(part, {}, where=f"{what} '{text}'")) for part in text.split(",")]


def plant_states(system: System, initial: str) -> dict[str, float]:
    """What `--initial` gives each state of the plant, by name.

    Raises:
        UlnaError: for another count, or an entry that is no number.
    """
    from ulna.base import SimulationError

    names = [s.name for s in system.states]
    numbers = number_list(initial, "--initial")
    if len(numbers) != len(names):
        found = f"{len(numbers)} numbers, {len(names)} states ({', '.join(names)})."
        raise SimulationError("the initial state", found, "Give one for each.")
    return dict(zip(names, numbers, strict=True))
