"""The paper's arm to be driven by hand: Figures 4 to 7 in motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ulna.design import compensator
from ulna.loop import Loop
from ulna.page import live_blocks
from ulna.plants import model
from ulna.report import Block
from ulna.studies.paper.exact import PLANT, Exact
from ulna.studies.paper.loops import Controller, controller_system
from ulna.studies.paper.runs import ANGLE


def free_blocks(angles: Sequence[float]) -> tuple[Block, ...]:
    """The arm without voltage, side by side from each initial angle (Figure 4)."""
    names = [_from(angle) for angle in angles]
    return _beside([Loop(plant=model(PLANT))] * len(angles), angles, names, "free arm", inputs={"u": 0.0})


def loop_blocks(exact: Exact, printed: Controller, angles: Sequence[float]) -> tuple[Block, ...]:
    """The loop with its estimator from each initial angle, and as printed from the first of them (Figures 5 to 7)."""
    done, read = compensator(exact.law, exact.observer), controller_system(exact, printed)
    starts = [*angles, angles[0]]
    names = [*(f"exact, {_from(angle)}" for angle in angles), f"as printed, {_from(angles[0])}"]
    plant = model(PLANT)
    loops = [Loop(plant=plant, controller=each) for each in (*[done] * len(angles), read)]
    return _beside(loops, starts, names, "closed loop")


def _beside(
    loops: Sequence[Loop], angles: Sequence[float], names: Sequence[str], what: str, **more: Any
) -> tuple[Block, ...]:
    own = [s.name for s in loops[0].plant.states]
    starts: list[Any] = [dict.fromkeys(own, 0.0) | {ANGLE: angle} for angle in angles]
    return live_blocks(*loops, title=f"The {what}, to be driven by hand", initial=starts, names=names, **more)


def _from(angle: float) -> str:
    return f"from {angle:g} rad".replace("-", "−")
