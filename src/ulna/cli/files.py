"""Files that a command begins: nothing is overwritten, and what cannot be written is one line."""

from __future__ import annotations

from pathlib import Path

from ulna.base import PlantError, whole_file


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
