"""Messages between a process and its helper: a length, then pickled Python, over a pipe that nobody else holds."""

from __future__ import annotations

import os
import pickle
import struct
from typing import Any

HEADER = struct.Struct("!Q")
"""The length of what follows."""


def write(place: int, message: Any) -> None:
    """Send one message."""
    text = pickle.dumps(message)
    left = memoryview(HEADER.pack(len(text)) + text)
    while left:
        left = left[os.write(place, left) :]


def read(place: int) -> Any:
    """The next message; None where there is no other."""
    head = _exactly(place, HEADER.size)
    return None if head is None else pickle.loads(_exactly(place, HEADER.unpack(head)[0]) or b"N.")  # noqa: S301


def _exactly(place: int, size: int) -> bytes | None:
    parts: list[bytes] = []
    while size:
        part = os.read(place, min(size, 1 << 20))
        if not part:
            return None
        parts.append(part)
        size -= len(part)
    return b"".join(parts)
