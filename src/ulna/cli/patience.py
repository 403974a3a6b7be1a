"""`--seconds`: how long a command may work with formulas. The same as `ULNA_PATIENCE`, in seconds."""

from __future__ import annotations

import time

from ulna.cli.supervisor import limit

_SECONDS = 30.0
"""s of CPU time of a command at a patience of 1."""

_LEAST = 0.2
"""s of this that computer algebra gets, however long loading it took."""


def take_time(seconds: float | None) -> None:
    """Let the command work this long in all; None: as long as the patience says.

    The time budgets share what loading has left of it, and whatever holds none is ended a moment later.
    """
    from ulna.symbolic.exact import patience, set_patience

    if seconds is None:
        limit(_SECONDS * patience())
    else:
        limit(seconds)
        set_patience(max(seconds - time.process_time(), _LEAST) / _SECONDS)
