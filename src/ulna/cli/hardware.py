"""The options that put a processor, sensors and a drive into the loop, and the `Sampled` they make."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from ulna.cli.making import LoopMade
from ulna.cli.rules import end_stops, saturations

if TYPE_CHECKING:
    from ulna.sim import ConditionalIntegration, Pwm, Quantiser, Sampled
    from ulna.system import System

_PANEL = "Hardware (with --period)"
Period = Annotated[
    float, typer.Option("--period", help="Run the controller sampled, with this period in s.", rich_help_panel=_PANEL)
]
Delay = Annotated[float, typer.Option("--delay", help="From sample to new input, s.", rich_help_panel=_PANEL)]
Encoder = Annotated[
    int, typer.Option("--encoder", metavar="BITS", help="Codes of a turn: 2^BITS.", rich_help_panel=_PANEL)
]
Resolution = Annotated[
    float, typer.Option("--resolution", help="Step of the measured outputs, SI.", rich_help_panel=_PANEL)
]
Noise = Annotated[
    float, typer.Option("--noise", help="Standard deviation of each measurement, SI.", rich_help_panel=_PANEL)
]
Slew = Annotated[float, typer.Option("--slew", help="Largest rate of the inputs, SI a second.", rich_help_panel=_PANEL)]
ClockJitter = Annotated[
    float, typer.Option("--jitter", help="Samples come late by up to this, s.", rich_help_panel=_PANEL)
]
Missed = Annotated[float, typer.Option("--missed", help="Probability of a missed sample.", rich_help_panel=_PANEL)]
Pulses = Annotated[
    str,
    typer.Option(
        "--pwm",
        metavar="HZ:V",
        help="Drive of this carrier and supply: '20e3:24'; its mean, or every pulse with '20e3:24:switched'.",
        rich_help_panel=_PANEL,
    ),
]
Limit = Annotated[
    list[str] | None, typer.Option("--limit", help="Limit an input: 'u=-24:24', 'u=24'; '24' for all. Repeatable.")
]
Stop = Annotated[
    list[str] | None,
    typer.Option("--stop", help="End stop of a position, SI: 'theta=-pi/2:pi/2', with rebound 'theta=0:pi/2:0.5'."),
]


@dataclass(frozen=True, slots=True, kw_only=True)
class HardwareOptions:
    """What a user says of processor, sensors and drive; zero or empty where nothing is said."""

    period: float = 0.0
    limit: Sequence[str] = ()
    stop: Sequence[str] = ()
    delay: float = 0.0
    encoder: int = 0
    resolution: float = 0.0
    noise: float = 0.0
    slew: float = 0.0
    jitter: float = 0.0
    missed: float = 0.0
    pwm: str = ""
    seed: int = 0

    @property
    def sampled(self) -> bool:
        """True if the controller runs on a processor."""
        return self.period != 0


def require_period(options: HardwareOptions) -> None:
    """Refuse what only a sampled loop has where the controller is continuous.

    Raises:
        SimulationError: naming the option.
    """
    from ulna.base import SimulationError

    names = ("delay", "encoder", "resolution", "noise", "slew", "jitter", "missed", "pwm")
    given = [name for name in names if getattr(options, name)]
    if given and not options.sampled:
        raise SimulationError(f"--{given[0]}", "it is for a sampled loop.", "Give --period, 1e-3 say.")


def sampled(
    system: System, loop: LoopMade, options: HardwareOptions, references: Mapping[str, float] | None = None
) -> Sampled:
    """The loop of a plant with a processor; the estimator sees the limited, delayed input.

    Raises:
        SimulationError: no controller, a value out of its range.
    """
    from ulna.base import SimulationError
    from ulna.sim import Jitter, MeasurementNoise, MissedSamples, Sampled, SlewLimit

    made = loop.design
    if made is None or made.law is None:
        raise SimulationError("--period", "there is no controller to be sampled.", "Give --controller-poles or --lqr.")
    return Sampled(
        controller=made.law.system,
        estimator=None if made.observer is None else made.observer.system,
        period=options.period,
        delay=options.delay,
        initial=loop.starts,
        saturation=saturations(options.limit),
        slew=SlewLimit(rate=options.slew) if options.slew else None,
        anti_windup=_anti_windup(loop, options),
        sensors=_sensors(options),
        noise=MeasurementNoise(std=options.noise) if options.noise else None,
        jitter=Jitter(width=options.jitter) if options.jitter else None,
        missed=MissedSamples(probability=options.missed) if options.missed else None,
        drive=_drive(options.pwm),
        end_stops=end_stops(system, options.stop),
        references=dict(references or {}),
        seed=options.seed,
    )


def _anti_windup(loop: LoopMade, options: HardwareOptions) -> ConditionalIntegration | None:
    from ulna.sim import ConditionalIntegration

    integrals = tuple(s.name for s in loop.law.system.states) if loop.law is not None else ()
    return ConditionalIntegration(states=integrals) if integrals and options.limit else None


def _sensors(options: HardwareOptions) -> Quantiser | None:
    from ulna.base import SimulationError
    from ulna.sim import Quantiser

    if options.encoder and options.resolution:
        raise SimulationError("--encoder and --resolution", "both set the step.", "Leave one of them out.")
    if options.encoder:
        return Quantiser.encoder(bits=options.encoder, turn=2 * math.pi)
    return Quantiser(step=options.resolution) if options.resolution else None


def _drive(text: str) -> Pwm | None:
    from ulna.base import SimulationError
    from ulna.cli.session import number_list
    from ulna.sim import Pwm

    if not text:
        return None
    parts = text.split(":")
    if len(parts) not in (2, 3) or parts[2:] not in ([], ["switched"]):
        raise SimulationError(f"--pwm '{text}'", "carrier and supply are due.", "Write 20e3:24 or 20e3:24:switched.")
    frequency, supply = (number_list(part, "--pwm")[0] for part in parts[:2])
    return Pwm(frequency=frequency, supply=supply, switched=len(parts) == 3)
