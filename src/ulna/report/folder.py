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
def output_folder(path: str | Path, *, holds: tuple[str, ...] = ("**",)) -> Iterator[Path]:
    """Give an empty folder to write into; at the end of the block it takes the place of `path`, whole.

    An earlier output at `path` (empty, or holding `results.json`) is replaced. When the block fails, nothing changes.

    Args:
        path: the folder to make; folders above it are made too.
        holds: patterns of the files that such an output holds (`"figures/*.svg"`); an earlier output with any other
            file in it is not replaced. Left out, any file is taken for a part of it.

    Raises:
        UlnaError: a place that cannot be written, or that holds something else than an earlier output.
    """
    target = Path(path).absolute()
    _check(target, holds)
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


def _check(target: Path, holds: tuple[str, ...]) -> None:
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
        inside = [entry.relative_to(target) for entry in target.rglob("*") if not entry.is_dir()]
        strange = sorted(str(part) for part in inside if not _belongs(part, holds))
        if strange:
            raise UlnaError(
                f"the output folder '{target}'",
                f"beside an earlier output it holds {', '.join(strange[:3])}{' …' * (len(strange) > 3)}.",
                "Move that away, or give another folder.",
            )
    except OSError as error:
        raise _refuse(target, error) from error


def _belongs(part: Path, holds: tuple[str, ...]) -> bool:
    return "**" in holds or any(part.match(h) and len(part.parts) == len(Path(h).parts) for h in holds)


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
