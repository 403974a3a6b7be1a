"""What every command shares: errors in one message and exit status 2, tables, JSON."""

from __future__ import annotations

import gc
import json
import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from ulna.base import UlnaError, UlnaWarning
from ulna.cli.help import PlainGroup
from ulna.cli.supervisor import end_interrupted, supervised
from ulna.cli.wording import in_terminal_words, told

if TYPE_CHECKING:
    from rich.console import Console


class UlnaGroup(PlainGroup):
    """Commands whose user errors end in one clear message and exit status 2, without a traceback.

    The status is 0 where all was done and 1 where a run or a check failed, memory or the disk ran out.
    """

    def main(self, *args: Any, **keywords: Any) -> Any:
        """Read the command line and run the command, the line of the process itself under a supervisor."""
        if args or keywords.get("args") is not None:
            return self._run(*args, **keywords)
        return supervised(lambda: self._run(**keywords))

    def _run(self, *args: Any, **keywords: Any) -> Any:
        warnings.showwarning = _show_warning
        gc.set_threshold(20_000, 20, 100)  # a command lives for seconds; collecting as often as usual takes a tenth
        try:
            try:
                return super().main(*args, **keywords)
            finally:
                sys.stdout.flush()
        except OSError as error:
            # What is still to be written has no place to go, and must not be tried again at the end.
            with suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            _end(f"{error.filename or 'standard output'}: {error.strerror or error}.", 1)
        except MemoryError:
            _end("memory: there is not enough for this. Ask for fewer samples or runs, or a smaller plant.", 1)
        except RecursionError:
            _end("formulas: they are nested too deeply to be worked on. Use definitions for their parts.", 2)

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        try:
            return super().invoke(ctx)
        except UlnaError as error:
            _end(told(error), 2)
        except KeyboardInterrupt:
            end_interrupted()
        except BrokenPipeError:
            # The reader (head, less) went away; there is nobody left to tell.
            sys.stderr.close()
            raise typer.Exit(0) from None


def _end(message: str, status: int) -> NoReturn:
    typer.secho(f"error: {message}", fg=typer.colors.RED, err=True)
    sys.exit(status)


def _show_warning(message: Warning | str, category: type[Warning], *_place: Any) -> None:
    if issubclass(category, UlnaWarning):
        typer.secho(f"warning: {in_terminal_words(str(message))}", fg=typer.colors.YELLOW, err=True)


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
