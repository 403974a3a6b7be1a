"""What a run is asked to report: crossings, ends and outputs that settle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ulna.cli.typed_values import known_name, number

if TYPE_CHECKING:
    from ulna.sim import Crossing, Settling
    from ulna.system import System


def reported(
    system: System, events: Sequence[str], until: Sequence[str], settle: Sequence[str]
) -> tuple[Crossing | Settling, ...]:
    """The events asked for: expressions (`omega`, or with a name `top: omega`), ends, outputs that settle (`y=0`).

    Raises:
        UlnaError: a target that is no number, an output that is not there.
    """
    from ulna.sim import Crossing, Settling

    found: list[Crossing | Settling] = []
    for texts, terminal in ((events, False), (until, True)):
        for text in texts:
            name, colon, expression = text.partition(":")
            found.append(
                Crossing(name=name.strip(), expression=(expression if colon else name).strip(), terminal=terminal)
            )
    shown = [s.name for s in (*system.outputs, *system.states)]
    for text in settle:
        name, equals, target = text.partition("=")
        asked = f"--settle '{text}'"
        value = number(target, asked) if equals else 0.0
        found.append(Settling(output=known_name(name.strip(), shown, asked, "output or state"), target=value))
    return tuple(found)
