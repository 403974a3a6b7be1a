"""heyoka held to the thread that calls it, while threads of our own or of a cluster share the work out."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

_LOCK = threading.Lock()
_inside = 0
_before = 0


@contextmanager
def one_thread() -> Iterator[None]:
    """heyoka spreads large evaluations over all cores on its own; not in here. The setting is one of the process."""
    import heyoka as hy

    global _inside, _before  # noqa: PLW0603  (heyoka's setting is global too)
    with _LOCK:
        if _inside == 0:
            _before = hy.get_nthreads()
            hy.set_nthreads(1)
        _inside += 1
    try:
        yield
    finally:
        with _LOCK:
            _inside -= 1
            if _inside == 0:
                hy.set_nthreads(_before)
