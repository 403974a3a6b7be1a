"""Files: read within bounds, written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BufferedIOBase
from pathlib import Path
from uuid import uuid4


@contextmanager
def whole_file(target: Path) -> Iterator[BufferedIOBase]:
    """A file to write to, which is there whole at the end, also after a power cut, or not at all.

    A pipe or a device is written to as it is, never replaced.

    Raises:
        OSError: it cannot be written; nothing is left of it.
    """
    if target.exists() and not target.is_file():
        with target.open("wb") as file:
            yield file
        return
    beside = target.with_name(f".{uuid4().hex}.part")
    try:
        with beside.open("wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        beside.replace(target)
    except BaseException:
        with suppress(OSError):
            beside.unlink()
        raise


def text_of_file(target: Path, *, most: int) -> str:
    """The UTF-8 text of a file, without the byte order mark that some editors put in front.

    Args:
        target: a plain file. most: bytes it may have.

    Raises:
        ValueError: its text is what was found: no plain file, too large, no UTF-8, not readable.
    """
    try:
        if target.exists() and not target.is_file():
            raise ValueError("this is not a file but a folder, a pipe or a device")
        if target.stat().st_size > most:
            raise ValueError(f"it is larger than {most // 1_000_000} MB")
        return target.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError("it cannot be read (not a UTF-8 text)") from None
    except OSError as error:
        raise ValueError(f"it cannot be read ({error.strerror or error})") from None
