"""An output folder that is there complete or not at all."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import uuid4

from ulna.base import UlnaError

MARK = "results.json"
"""The file by which a folder is known as an earlier output, which may be replaced."""


@contextmanager
def output_folder(path: str | Path) -> Iterator[Path]:
    """Give an empty folder to write into; at the end of the block it takes the place of `path`, whole.

    An earlier output at `path` (empty, or holding `results.json`) is replaced. When the block fails, nothing changes.

    Args:
        path: the folder to make; folders above it are made too.

    Raises:
        UlnaError: a place that cannot be written, or that holds something else than an earlier output.
    """
    target = Path(path).absolute()
    _check(target)
    beside = target.with_name(f".{target.name}.{uuid4().hex[:8]}")
    try:
        beside.mkdir(parents=True)
    except OSError as error:
        raise _refuse(target, error) from error
    try:
        yield beside
        _put_in_place(beside, target)
    except OSError as error:
        raise _refuse(target, error) from error
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def _check(target: Path) -> None:
    try:
        if not target.exists():
            return
        if not target.is_dir():
            raise UlnaError(f"the output folder '{target}'", "there is a file of this name.", "Give another folder.")
        if any(target.iterdir()) and not (target / MARK).is_file():
            raise UlnaError(
                f"the output folder '{target}'",
                "it holds files that are not an earlier output.",
                "Give an empty or a new folder.",
            )
    except OSError as error:
        raise _refuse(target, error) from error


def _put_in_place(beside: Path, target: Path) -> None:
    """Move the finished folder to its place; an earlier one steps aside first and comes back if that fails."""
    if not target.exists():
        beside.rename(target)
        return
    old = target.with_name(f".{target.name}.old-{uuid4().hex[:8]}")
    target.rename(old)
    try:
        beside.rename(target)
    except OSError:
        old.rename(target)
        raise
    shutil.rmtree(old, ignore_errors=True)


def _refuse(target: Path, error: OSError) -> UlnaError:
    reason = (error.strerror or str(error)).lower()
    return UlnaError(
        f"the output folder '{target}'", f"it cannot be written: {reason}.", "Give another one with --out."
    )
