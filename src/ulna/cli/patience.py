"""`--seconds`: how long a command may work with formulas. The same as `ULNA_PATIENCE`, in seconds."""

from __future__ import annotations

import time

from ulna.cli.supervisor import limit

_SECONDS = 30.0
"""s of CPU time of a command at a patience of 1."""

_LEAST_PATIENCE = 0.3
"""Below this the single steps of a computation would find less than their few seconds are worth."""

_GROUP, _GROUPS = 0.5, 1.6
"""Share of what is left that one group of answers may take, and how many times as long all of them."""


def take_time(seconds: float | None) -> dict[str, float]:
    """Let the command work this long in all, None: as long as the patience says; keywords of `ulna.analyse` for it.

    The time budgets share what loading has left of it, and whatever holds none is ended a moment later.
    """
    from ulna.symbolic.exact import patience, set_patience

    if seconds is None:
        limit(_SECONDS * patience())
        return {}
    limit(seconds)
    left = max(seconds - time.process_time(), 0.1 * seconds)
    set_patience(max(left / _SECONDS, _LEAST_PATIENCE))
    return {"seconds": _GROUP * left / patience(), "groups": _GROUPS}
