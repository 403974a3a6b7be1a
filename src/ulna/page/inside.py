"""A live page inside a document."""

from __future__ import annotations

from typing import Any

from ulna.base import UlnaError
from ulna.loop import Loop
from ulna.page.writing import studio_text
from ulna.report import Block, Frame, Text, verbatim

_HOW = "Press Play. The page computes the motion in this browser, and asks nothing of any network."


def live_blocks(*loops: Loop, title: str, **options: Any) -> tuple[Block, ...]:
    """The page of `studio` as blocks of a document, standing still until it is started; a sentence where there is none.

    Args:
        loops: as for `studio`. title: what it is, for those who cannot see it.
        options: what `studio_text` takes besides.
    """
    try:
        html = studio_text(*loops, paused=True, **options)
    except UlnaError as error:
        return (Text(text=verbatim(f"There is no live page of this loop: {error}")),)
    return Text(text=_HOW), Frame(html=html, title=title)
