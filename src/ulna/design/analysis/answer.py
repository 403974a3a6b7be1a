"""An answer: a value with the verdict that vouches for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NoReturn

from ulna.base import Status, UlnaError, Verdict


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """The answer to one question.

    Attributes:
        verdict: how sure the value is; for yes/no questions the answer itself.
        value: a number, a bool, expressions, or a mapping of them; None where there is none.

    Examples:
        >>> answer = ulna.analyse("duffing", questions=["controllability_rank"])["controllability_rank"]
        >>> answer.value
        2
    """

    verdict: Verdict
    value: Any

    def __bool__(self) -> NoReturn:
        raise UlnaError(
            f"the truth of the answer '{self.verdict.claim}'",
            f"it is {self.verdict.status}, with the value {self.value}: an answer is more than true or false.",
            "Ask .value, or .verdict.holds and .verdict.fails.",
        )

    def __repr__(self) -> str:
        return f"Answer({self.value}, {self.verdict})"


def decided(verdict: Verdict) -> Answer:
    """The answer to a yes/no question: True, False, or None while undecided."""
    value = None if verdict.status is Status.UNDECIDED else verdict.holds
    return Answer(verdict=verdict, value=value)


def not_applicable(key: str, reason: str, *, ran_out: bool = False) -> Answer:
    """The answer to a question that could not be asked or answered, for want of time where `ran_out`."""
    evidence = {"reason": reason} | ({"ran_out": True} if ran_out else {})
    return Answer(verdict=Verdict.undecided(key.replace("_", " "), **evidence), value=None)
