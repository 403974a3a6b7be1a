"""What can be said of a plant with jumps and kinks on the side of them on which its operating point lies."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace

from ulna.base import Status
from ulna.design.analysis.answer import Answer
from ulna.system import OneSide

_EVERYWHERE = ("rest_points",)
"""What is asked of the whole plant."""


def asked_on_one_side(
    answers: Mapping[str, Answer], side: OneSide, ask: Callable[[Collection[str]], Mapping[str, Answer]]
) -> dict[str, Answer]:
    """The answers to questions left open, of the plant that there is on that side; each says so.

    Args:
        answers: of the whole plant.
        side: the plant on one side.
        ask: answers questions about that plant.
    """
    open_keys = [k for k, a in answers.items() if a.verdict.status is Status.UNDECIDED and k not in _EVERYWHERE]
    found = ask(open_keys) if open_keys else {}
    return {**answers, **{k: on_side(a, side) for k, a in found.items() if not _open(a)}}


def on_side(answer: Answer, side: OneSide) -> Answer:
    """An answer that says on which side of which jumps it holds."""
    verdict = answer.verdict
    return replace(answer, verdict=replace(verdict, evidence={**verdict.evidence, "side": side.pieces}))


def _open(answer: Answer) -> bool:
    return answer.verdict.status is Status.UNDECIDED
