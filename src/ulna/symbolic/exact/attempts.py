"""A computation that may fail or take too long, as a value: `attempt`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, ParamSpec, TypeVar

from ulna.base import UlnaError
from ulna.symbolic.exact.budget import patience, time_budget
from ulna.symbolic.exact.helper import apart
from ulna.symbolic.exact.high_powers import has_high_powers

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt(Generic[Result]):
    """What a bounded computation gave.

    `value` is None unless it came to its end; `ran_out` says that the time was spent; `reason` is an empty text
    or one line on what went wrong.
    """

    value: Result | None
    ran_out: bool
    reason: str

    @property
    def succeeded(self) -> bool:
        """True if the computation came to its end."""
        return not self.reason


def attempt(
    seconds: float,
    what: str,
    function: Callable[Arguments, Result],
    /,
    *arguments: Arguments.args,
    **keywords: Arguments.kwargs,
) -> Attempt[Result]:
    """The value of `function(*arguments, **keywords)`, or why there is none after at most `seconds`.

    Computer algebra fails in many ways (NotImplementedError, ValueError, RecursionError, ...): each becomes a
    reason. Mistakes of the user (`UlnaError`), KeyboardInterrupt and an outer budget that is spent pass through.

    What powers of high degree could keep inside compiled code forever is computed in the helper process.

    Args:
        seconds: s of CPU time.
        what: what is tried, in words, for the reason (`"solve for x1"`).
        function: called with the remaining arguments.
    """
    if has_high_powers((arguments, keywords)):
        return attempt_expecting((Exception,), seconds, what, apart, function, *arguments, **keywords)
    return attempt_expecting((Exception,), seconds, what, function, *arguments, **keywords)


def attempt_expecting(
    failures: tuple[type[Exception], ...],
    seconds: float,
    what: str,
    function: Callable[Arguments, Result],
    /,
    *arguments: Arguments.args,
    **keywords: Arguments.kwargs,
) -> Attempt[Result]:
    """As `attempt`, but only these failures become a reason: for our own code, whose mistakes must not be hidden."""
    try:
        with time_budget(seconds):
            value = function(*arguments, **keywords)
            return Attempt(value=value, ran_out=False, reason="")
    except UlnaError:
        raise
    except failures as error:
        return Attempt(value=None, ran_out=False, reason=f"{what}: {type(error).__name__}: {error}")
    return Attempt(value=None, ran_out=True, reason=f"{what}: no answer within {seconds * patience():.3g} s")
