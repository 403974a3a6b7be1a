"""`Fault`: what a processor found wrong at a sample, as bits of one number."""

from __future__ import annotations

from enum import IntFlag


class Fault(IntFlag):
    """The bits of a fault code; 0 where nothing is wrong.

    Examples:
        >>> ulna.Fault(3)
        <Fault.NOT_FINITE|MISSED: 3>
    """

    NOT_FINITE = 1
    """A measured value or a command that is not finite, or a command of `Guard(largest=...)` or more."""
    MISSED = 2
    """More samples missed in a row than `Deadline(missed=...)`."""
    LATE = 4
    """A call later than `Deadline(lateness=...)`."""
    REFERENCE = 8
    """A reference out of its `ReferenceRange`."""
    LOST = 16
    """An estimator that has lost the plant, see `InnovationLimit`."""
