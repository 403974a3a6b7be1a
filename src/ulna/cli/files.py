"""Files that a command begins: nothing is overwritten, and what cannot be written is one line."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ulna.base import PlantError, whole_file

_WRITTEN = ("out", "plot")
"""The options that name what a command writes; every other file that is named is read."""


def refuse_own_input(options: Mapping[str, object]) -> None:
    """Refuse a command line that would write over the plant, controller or log that it reads.

    Raises:
        PlantError: naming the option and the file.
    """
    read = [file for name, value in options.items() if name not in _WRITTEN for file in _files(value)]
    for name in _WRITTEN:
        for file in _files(options.get(name)):
            if any(file.samefile(other) for other in read):
                raise PlantError(f"--{name} {file}", "this file is read by the same command.", "Give another name.")


def _files(value: object) -> list[Path]:
    """The files of this name that are there."""
    if isinstance(value, list | tuple):
        return [file for each in value for file in _files(each)]
    try:
        return [Path(value)] if isinstance(value, str | Path) and value and Path(value).is_file() else []
    except (OSError, ValueError):  # no name that a file can have
        return []


def write_text(file: Path, text: str) -> None:
    """Write a new file.

    Raises:
        PlantError: it is there already, or cannot be written.
    """
    if file.exists():
        raise PlantError(f"the file '{file}'", "it is there already.", "Choose another name.")
    try:
        with whole_file(file) as target:
            target.write(text.encode())
    except OSError as error:
        raise PlantError(f"the file '{file}'", f"it cannot be written ({error.strerror or error}).") from None
