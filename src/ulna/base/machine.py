"""What differs between operating systems, in one place: timers, forks, cores, locks on files."""

from __future__ import annotations

import os
import signal
from importlib.util import find_spec

HAS_TIMER = hasattr(signal, "SIGALRM") and hasattr(signal, "setitimer")
"""Whether a process can be told by a signal that its time is over."""

HAS_FORK = hasattr(os, "fork") and find_spec("resource") is not None
"""Whether a process can be copied, and the copy be given less memory and time."""


def cores() -> int:
    """The cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def lock_alone(handle: int) -> bool:
    """Lock an open file for this process until it is closed; False where another process holds the lock."""
    if find_spec("fcntl") is None:
        return _lock_a_byte(handle)
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _lock_a_byte(handle: int) -> bool:
    """The same on Windows, where a part of a file is locked."""
    if find_spec("msvcrt") is None:
        return True
    import msvcrt

    try:
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)  # pyright: ignore[reportAttributeAccessIssue]
    except OSError:
        return False
    return True
