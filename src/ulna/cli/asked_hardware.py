"""The hardware that the options ask for: limits, end stops, processor, sensors and drive."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ulna.base import SimulationError
from ulna.cli.options import Arithmetic, Discretisation, HardwareOptions
from ulna.cli.typed_values import known_name, number, typed_list

if TYPE_CHECKING:
    from ulna.loop import ConditionalIntegration, EndStop, Hardware, Pwm, Quantiser, Saturation
    from ulna.program import AbstractArithmetic
    from ulna.system import System


def require_period(options: HardwareOptions) -> None:
    """Refuse what only a sampled loop has where the controller is continuous.

    Raises:
        SimulationError: naming the option.
    """
    names = ("delay", "encoder", "resolution", "noise", "slew", "anti_windup", "jitter", "missed", "pwm")
    names += ("reference_range", "innovation")
    given = [name for name in names if getattr(options, name)]
    given += ["encoder"] if options.encoder == 0 else []
    given += ["discretise"] if options.discretise is not Discretisation.runge_kutta else []
    given += [name for name in ("lateness", "missed_most", "safe_output") if getattr(options, name) is not None]
    given += ["arithmetic"] if options.arithmetic is not None else []
    if given and not options.sampled:
        asked = f"--{given[0].replace('_', '-')}"
        raise SimulationError(asked, "it is for a sampled loop.", "Give --period, 1e-3 say.")


def hardware_of(
    plant: System, options: HardwareOptions, *, driven: Sequence[str], memory: Sequence[str], integrals: Sequence[str]
) -> Hardware | None:
    """The hardware; None where nothing is asked for.

    Args:
        plant: whose states have end stops.
        options: what is asked for.
        driven: inputs that can be limited. memory: states of the controller.
        integrals: of the memory, those that wait while the input is limited unless the user says otherwise.

    Raises:
        UlnaError: a text that cannot be read, a name that is unknown, a value out of its range.
    """
    from ulna.loop import Hardware, Jitter, MeasurementNoise, MissedSamples, SlewLimit

    limits, walls = saturations(options.limit, driven), end_stops(plant, options.stop)
    if not options.sampled:
        return Hardware(saturation=limits, end_stops=walls) if limits or walls else None
    clock = (Jitter(width=options.jitter) if options.jitter else None,)
    clock += (MissedSamples(probability=options.missed) if options.missed else None,)
    return Hardware(
        period=options.period,
        delay=options.delay,
        saturation=limits,
        slew=SlewLimit(rate=options.slew) if options.slew else None,
        anti_windup=_anti_windup(options, memory, integrals),
        discretisation=_discretisation(options.discretise),
        arithmetic=_arithmetic(options.arithmetic),
        sensors=_sensors(options),
        noise=MeasurementNoise(std=options.noise) if options.noise else None,
        drive=_drive(options.pwm),
        clock=tuple(each for each in clock if each is not None),
        end_stops=walls,
        **_watches(options),
    )


def _watches(options: HardwareOptions) -> dict[str, Any]:
    """What is watched, and what is commanded while a fault lasts."""
    from ulna.loop import Deadline, Guard, Hold, InnovationLimit, ReferenceRange, SafeOutput

    reaction = Hold() if options.safe_output is None else SafeOutput(options.safe_output)
    found: dict[str, Any] = {} if options.safe_output is None else {"guard": Guard(reaction=reaction)}
    if options.lateness is not None or options.missed_most is not None:
        found["deadline"] = Deadline(lateness=options.lateness, missed=options.missed_most, reaction=reaction)
    ranges = {}
    for text in options.reference_range:
        name, _, bounds = (part.strip() for part in text.partition("="))
        low, high = _numbers(bounds, f"--reference-range '{text}'", (2,))
        ranges[name] = ReferenceRange(lower=low, upper=high)
    if ranges:
        found["references"] = ranges
    if options.innovation:
        asked = f"--innovation '{options.innovation}'"
        size, *counts = _numbers(options.innovation, asked, (2, 3))
        if any(count != int(count) for count in counts):
            raise SimulationError(asked, "expected whole numbers of samples.", "Write 0.2:10, say.")
        samples, resume = int(counts[0]), int(counts[1]) if len(counts) > 1 else None
        found["innovation"] = InnovationLimit(size=size, samples=samples, resume=resume, reaction=reaction)
    return found


def saturations(texts: Sequence[str], driven: Sequence[str]) -> Saturation | dict[str, Saturation] | None:
    """The limits in texts like `u=-24:24`, `u=24` (both ways) or `24` (of every input).

    Raises:
        UlnaError: a text that cannot be read, an input that is not there, limits the wrong way round.
    """
    from ulna.loop import Saturation

    found: dict[str, Saturation] = {}
    for text in texts:
        name, equals, bounds = (part.strip() for part in text.rpartition("="))
        asked = f"--limit '{text}'"
        numbers = _numbers(bounds, asked, (1, 2))
        limit = Saturation(lower=-numbers[0] if len(numbers) == 1 else numbers[0], upper=numbers[-1])
        if not equals:
            if len(texts) > 1:
                raise SimulationError(asked, "it limits all inputs, and other limits are given too.", "Name them.")
            return limit
        found[known_name(name, driven, asked, "input")] = limit
    return found or None


def end_stops(plant: System, texts: Sequence[str]) -> tuple[EndStop, ...]:
    """The end stops in texts like `theta=-pi/2:pi/2` or, with a restitution coefficient, `theta=0:pi/2:0.5`.

    The velocity is the state that stands for the position's rate.

    Raises:
        UlnaError: a text that cannot be read, a state that has no such velocity, bounds the wrong way round.
    """
    from ulna.loop import EndStop

    stops = []
    rates = dict(zip((s.name for s in plant.states), plant.inline(plant.rates), strict=True))
    by_symbol = {s.symbol: s.name for s in plant.states}
    for text in texts:
        name, _, bounds = (part.strip() for part in text.partition("="))
        asked = f"--stop '{text}'"
        known_name(name, list(rates), asked, "state")
        velocity = by_symbol.get(rates[name])
        if velocity is None:
            raise SimulationError(asked, f"the rate of {name} is not a state but {rates[name]}.")
        numbers = _numbers(bounds, asked, (2, 3))
        bounce = numbers[2] if len(numbers) == 3 else 0.0
        stops.append(EndStop(position=name, velocity=velocity, lower=numbers[0], upper=numbers[1], restitution=bounce))
    return tuple(stops)


def _numbers(text: str, asked: str, counts: tuple[int, ...]) -> list[float]:
    parts = text.split(":")
    if len(parts) not in counts:
        raise SimulationError(asked, f"it has {len(parts)} numbers, expected {' or '.join(map(str, counts))}.")
    return [number(part, asked) for part in parts]


def _anti_windup(
    options: HardwareOptions, memory: Sequence[str], integrals: Sequence[str]
) -> ConditionalIntegration | None:
    from ulna.loop import ConditionalIntegration

    names = tuple(integrals) if options.limit else ()
    if options.anti_windup:
        asked = f"--anti-windup '{options.anti_windup}'"
        given = [] if options.anti_windup == "none" else typed_list(options.anti_windup)
        names = tuple(known_name(name, memory, asked, "state of the controller") for name in given)
        if names and not options.limit:
            raise SimulationError(asked, "no input is limited.", "Add --limit 24, say.")
    return ConditionalIntegration(states=names) if names else None


def _discretisation(asked: Discretisation) -> Any:
    from ulna.loop import Euler, ExactHold, RungeKutta4

    kinds = {Discretisation.euler: Euler, Discretisation.runge_kutta: RungeKutta4, Discretisation.exact: ExactHold}
    return kinds[asked]()


def _arithmetic(asked: Arithmetic | None) -> AbstractArithmetic:
    from ulna.program import Fused, Plain

    return Plain() if asked is Arithmetic.plain else Fused()


def _sensors(options: HardwareOptions) -> Quantiser | None:
    from ulna.loop import Quantiser

    if options.encoder is not None and options.resolution:
        raise SimulationError("--encoder and --resolution", "both set the step.", "Leave one of them out.")
    if options.encoder is not None:
        return Quantiser.encoder(bits=options.encoder, turn=2 * math.pi)
    return Quantiser(step=options.resolution) if options.resolution else None


def _drive(text: str) -> Pwm | None:
    from ulna.loop import Pwm

    if not text:
        return None
    parts, asked = text.split(":"), f"--pwm '{text}'"
    if len(parts) not in (2, 3) or parts[2:] not in ([], ["switched"]):
        raise SimulationError(asked, "expected carrier and supply.", "Write 20e3:24 or 20e3:24:switched.")
    frequency, supply = (number(part, asked) for part in parts[:2])
    return Pwm(frequency=frequency, supply=supply, switched=len(parts) == 3)
