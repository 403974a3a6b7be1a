"""What a run is asked to report: crossings, ends and outputs that settle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ulna.base import SimulationError
from ulna.cli.asked_run import Run
from ulna.cli.typed_values import known_name, number

if TYPE_CHECKING:
    from ulna.sim import Crossing, Settling, Trajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class Settled:
    """Whether an output stayed in its band. time: s, from when; None where it did not, or never left its target."""

    output: str
    target: float
    time: float | None
    text: str


def crossings(events: Sequence[str], until: Sequence[str]) -> tuple[Crossing, ...]:
    """The crossings asked for: expressions (`omega`, or with a name `top: omega`), and ends."""
    from ulna.sim import Crossing

    found: list[Crossing] = []
    for texts, terminal in ((events, False), (until, True)):
        for text in texts:
            name, colon, expression = text.partition(":")
            found.append(
                Crossing(name=name.strip(), expression=(expression if colon else name).strip(), terminal=terminal)
            )
    return tuple(found)


def settlings(asked: Run, texts: Sequence[str]) -> tuple[Settling, ...]:
    """The outputs and states that are to settle: at the target given (`y=0.5`), else at the constant reference.

    An output without a reference is to settle where the plant rests at its operating point.

    Raises:
        UlnaError: a target that is not a number, an unknown output, a reference that varies.
    """
    from ulna.sim import Settling

    system = asked.loop.plant if asked.loop.sampled else asked.loop.system
    shown = [s.name for s in (*system.outputs, *system.states)]
    found = []
    for text in texts:
        name, equals, target = (part.strip() for part in text.partition("="))
        option = f"--settle '{text}'"
        known_name(name, shown, option, "output or state")
        found.append(Settling(output=name, target=number(target, option) if equals else _target(asked, name, option)))
    return tuple(found)


def _target(asked: Run, name: str, option: str) -> float:
    reference = asked.inputs.get(f"{name}_ref")
    if reference is None or isinstance(reference, float):
        return target_of(asked, name)
    raise SimulationError(
        option, f"its reference varies: {reference}.", f"Say where it should end: --settle {name}=0.5."
    )


def target_of(asked: Run, name: str) -> float:
    """Where an output or state is to end, SI: its constant reference, else where the plant is held at rest."""
    from ulna.report.run_figures import target_of as target

    return target(asked.loop, name, asked.inputs, asked.parameters)


def settled(trajectory: Trajectory, wanted: Sequence[Settling]) -> list[Settled]:
    """What became of each output that was to settle."""
    return [_settled(trajectory, each) for each in wanted]


def _settled(trajectory: Trajectory, wanted: Settling) -> Settled:
    from ulna.sim import EventKind, output_metrics

    values = trajectory[wanted.output]
    exact = [e.time for e in trajectory.events if e.kind is EventKind.SETTLED and e.signal == wanted.output]
    time = exact[-1] if exact else output_metrics(trajectory.times, values, wanted.target).settling_time
    time = time if math.isfinite(time) else None
    band = f"its 2 % band around {wanted.target:.6g}"
    if time is not None:
        text = f"{wanted.output} stays in {band} from t = {time:.6g} s on"
    elif values[0] == wanted.target:
        text = f"{wanted.output} starts at its target {wanted.target:.6g}: with a step of zero there is no 2 % band"
    else:
        last = f"{values[-1]:.6g} at t = {trajectory.times[-1]:.6g} s"
        text = f"{wanted.output} does not settle: it is {last}, outside {band}"
    return Settled(output=wanted.output, target=wanted.target, time=time, text=text)
