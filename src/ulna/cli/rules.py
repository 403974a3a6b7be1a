"""What `ulna simulate` is told about limits, end stops and events."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ulna.base.errors import SimulationError
from ulna.cli.session import number_list

if TYPE_CHECKING:
    from ulna.sim import Crossing, EndStop, Saturation, Settling
    from ulna.system import System


def saturations(texts: Sequence[str]) -> Saturation | dict[str, Saturation] | None:
    """The limits in texts like `u=-24:24`, `u=24` (both ways) or `24` (of every input).

    Raises:
        UlnaError: a text that cannot be read, limits the wrong way round.
    """
    from ulna.sim import Saturation

    found: dict[str, Saturation] = {}
    for text in texts:
        name, equals, bounds = text.rpartition("=")
        numbers = _numbers(bounds, f"--limit '{text}'", (1, 2))
        limit = Saturation(lower=-numbers[0] if len(numbers) == 1 else numbers[0], upper=numbers[-1])
        if not equals:
            if len(texts) > 1:
                raise SimulationError(f"--limit '{text}'", "it is for all inputs, another one for some.", "Name them.")
            return limit
        found[name.strip()] = limit
    return found or None


def end_stops(system: System, texts: Sequence[str]) -> tuple[EndStop, ...]:
    """The end stops in texts like `theta=-pi/2:pi/2` or, with a restitution coefficient, `theta=0:pi/2:0.5`.

    The velocity is the state that stands for the position's rate.

    Raises:
        UlnaError: a text that cannot be read, a state that has no such velocity, bounds the wrong way round.
    """
    from ulna.sim import EndStop

    stops = []
    rates = dict(zip((s.name for s in system.states), system.inline(system.rates), strict=True))
    by_symbol = {s.symbol: s.name for s in system.states}
    for text in texts:
        name, _, bounds = (part.strip() for part in text.partition("="))
        if name not in rates:
            known = ", ".join(rates)
            raise SimulationError(f"--stop '{text}'", f"there is no state '{name}'.", f"The plant's states: {known}.")
        velocity = by_symbol.get(rates[name])
        if velocity is None:
            raise SimulationError(f"--stop '{text}'", f"the rate of {name} is no state, {rates[name]}.")
        numbers = _numbers(bounds, f"--stop '{text}'", (2, 3))
        bounce = numbers[2] if len(numbers) == 3 else 0.0
        stops.append(EndStop(position=name, velocity=velocity, lower=numbers[0], upper=numbers[1], restitution=bounce))
    return tuple(stops)


def reported(events: Sequence[str], until: Sequence[str], settle: Sequence[str]) -> tuple[Crossing | Settling, ...]:
    """The events asked for: expressions (`omega`, or with a name `top: omega`), ends, outputs that settle (`y=0`).

    Raises:
        UlnaError: a target that is no number.
    """
    from ulna.sim import Crossing, Settling

    found: list[Crossing | Settling] = []
    for texts, terminal in ((events, False), (until, True)):
        for text in texts:
            name, colon, expression = text.partition(":")
            found.append(
                Crossing(name=name.strip(), expression=(expression if colon else name).strip(), terminal=terminal)
            )
    for text in settle:
        name, equals, target = text.partition("=")
        value = number_list(target, f"--settle '{text}'")[0] if equals else 0.0
        found.append(Settling(output=name.strip(), target=value))
    return tuple(found)


def _numbers(text: str, what: str, counts: tuple[int, ...]) -> list[float]:
    parts = text.split(":")
    if len(parts) not in counts:
        raise SimulationError(what, f"{len(parts)} numbers, {' or '.join(map(str, counts))} are due.")
    return [number_list(part, what.split(maxsplit=1)[0])[0] for part in parts]
