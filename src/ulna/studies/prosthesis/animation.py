"""The arms in motion: one inline SVG that moves by itself, without script."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

import numpy as np

from ulna.plot.style import INK, MUTED, RULE, colour
from ulna.studies.prosthesis.comparison import Comparison
from ulna.studies.prosthesis.tasks import PERIOD
from ulna.studies.prosthesis.trial import ANGLE

SHOWN = ("reach", "pick_up", "push")
"""Tasks that are shown one after the other."""
FRAMES = 25
"""Frames a second."""
_WIDTH, _HEIGHT, _LENGTH = 180, 170, 95


def animate(found: Comparison) -> str:
    """SVG text: an arm for every contender side by side, on the nominal plant, the wanted angle as a thin line.

    Angles grow downwards as in the plant, which is how SVG turns. The drawing plays in real time and starts again.
    """
    step = round(1 / FRAMES / PERIOD)
    tasks = [task for task in found.tasks if task.key in SHOWN]
    wanted = np.concatenate([task.reference[0, ::step] for task in tasks])
    loads = np.concatenate([task.load[::step] for task in tasks])
    seconds = len(wanted) / FRAMES
    columns = 4
    rows = math.ceil(len(found.contenders) / columns)
    box = f"0 0 {columns * _WIDTH} {rows * _HEIGHT}"
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}" font-family="sans-serif" font-size="11">']
    for place, contender in enumerate(found.contenders):
        angle = np.concatenate([found.entries[contender.key, t.key].nominal[ANGLE][0, ::step] for t in tasks])
        x, y = place % columns * _WIDTH, place // columns * _HEIGHT
        parts.append(f'<g transform="translate({x + 45} {y + 75})">')
        parts.append(f'<text x="-35" y="-58" fill="{INK}">{escape(contender.title)}</text>')
        parts += _arm(angle, wanted, loads, seconds, colour(place))
        parts.append("</g>")
    parts.append("</svg>")
    return "".join(parts)


def _arm(angle: np.ndarray, wanted: np.ndarray, loads: np.ndarray, seconds: float, hue: str) -> list[str]:
    load = f'<circle cx="{_LENGTH}" cy="14" r="9" fill="{MUTED}">' + _values(
        "opacity", [f"{int(value > 0)}" for value in loads], seconds, discrete=True
    )
    ghost = (
        f'<g><line x1="0" y1="0" x2="{_LENGTH + 14}" y2="0" stroke="{MUTED}" stroke-dasharray="3 3"/>'
        f"{_turn(wanted, seconds)}</g>"
    )
    arm = (
        f'<g><line x1="0" y1="0" x2="{_LENGTH}" y2="0" stroke="{hue}" stroke-width="11" stroke-linecap="round"/>'
        f'{load}</circle><circle cx="{_LENGTH}" cy="0" r="8" fill="{hue}"/>{_turn(angle, seconds)}</g>'
    )
    return [
        f'<line x1="0" y1="0" x2="0" y2="-50" stroke="{RULE}" stroke-width="16" stroke-linecap="round"/>',
        ghost,
        arm,
        f'<circle r="6" fill="white" stroke="{INK}"/>',
    ]


def _turn(angle: np.ndarray, seconds: float) -> str:
    values = ";".join(f"{value:.1f}" for value in np.degrees(angle))
    return (
        f'<animateTransform attributeName="transform" type="rotate" values="{values}" dur="{seconds:g}s" '
        'repeatCount="indefinite"/>'
    )


def _values(attribute: str, values: Sequence[str], seconds: float, *, discrete: bool) -> str:
    mode = ' calcMode="discrete"' if discrete else ""
    return (
        f'<animate attributeName="{attribute}" values="{";".join(values)}" dur="{seconds:g}s"{mode} '
        'repeatCount="indefinite"/>'
    )
