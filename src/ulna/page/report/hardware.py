"""The hardware of a loop in words: what lies between controller and plant, with names and units."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ulna.loop import (
    Amplifier,
    Deadline,
    EndStop,
    Euler,
    ExactHold,
    Hardware,
    Loop,
    Pwm,
    Quantiser,
    Reaction,
    Report,
    SafeOutput,
    Saturation,
)
from ulna.page.report.quantities import number_text, seconds, with_unit
from ulna.program import Precision
from ulna.report import value_text
from ulna.system import Signal

Rows = Iterator[tuple[str, str]]


def hardware_rows(loop: Loop) -> list[tuple[str, str]]:
    """(part, what it does) of everything that the loop has beyond an ideal processor."""
    hardware = loop.hardware
    if hardware is None:
        return []
    rows = [*_processor(loop, hardware)] if hardware.sampled else [*_limits(loop)]
    units = {s.name: s.unit for s in loop.plant.states}
    return rows + [("end stop", _stop(each, units)) for each in hardware.end_stops]


def _processor(loop: Loop, hardware: Hardware) -> Rows:
    own = loop.fit({})
    measured, driven = loop.wiring.measured, loop.wiring.driven
    yield "processor", f"computes once every {seconds(own.period)}, {_arithmetic(hardware.arithmetic)}"
    if hardware.delay:
        yield "delay", f"{seconds(hardware.delay)} from a sample to the new input"
    yield from _each("sensor", measured, own.sensors, _sensor)
    yield from _each("noise", measured, own.noises, lambda n, s: f"standard deviation {with_unit(n.std, s.unit)}")
    yield from _each("limits", driven, own.saturations, _between)
    yield from _each("slew", driven, own.slews, lambda r, s: f"at most {with_unit(r.rate, f'{s.unit}/s')}")
    yield from _each("drive", driven, own.drives, _drive)
    if hardware.anti_windup is not None:
        yield "anti-windup", f"{', '.join(hardware.anti_windup.states)} kept while the command is limited"
    if own.rule is not None:
        yield "discretisation", _rule(own.rule)
    if hardware.jitter is not None:
        yield "clock", f"samples come up to {seconds(hardware.jitter.width)} late, at random"
    if hardware.missed is not None:
        yield "clock", f"{number_text(100 * hardware.missed.probability)} % of the samples are missed, at random"
    yield from _watches(loop, hardware)


def _limits(loop: Loop) -> Rows:
    signals = loop.plant.inputs if loop.controller is None else loop.wiring.driven
    yield from _each("limits", signals, [loop.saturation.get(s.name) for s in signals], _between)


def _watches(loop: Loop, hardware: Hardware) -> Rows:
    if (guard := hardware.guard) is not None:
        beyond = f" or its size reaches {number_text(guard.largest)}" if guard.largest < math.inf else ""
        yield "guard", f"where a command is not finite{beyond}, {_reaction(guard.reaction)}"
    if (deadline := hardware.deadline) is not None:
        yield "deadline", f"{_lateness(deadline)}: {_reaction(deadline.reaction)}"
    yield from _each("reference", loop.wiring.references, loop.fit({}).ranges, _range)
    if (innovation := hardware.innovation) is not None:
        size = innovation.size
        sizes = value_text(size) if isinstance(size, Mapping) else number_text(size)
        yield "innovation", f"above {sizes} in {innovation.samples} samples in a row, {_reaction(innovation.reaction)}"


def _each(what: str, signals: Sequence[Signal], parts: Sequence[Any], told: Any) -> Rows:
    for signal, part in zip(signals, parts, strict=True):
        if part is not None:
            yield f"{what} of {signal.name}", told(part, signal)


def _sensor(part: Quantiser, signal: Signal) -> str:
    turn = 2 * math.pi / part.step
    steps = f"steps of {with_unit(part.step, signal.unit)}"
    if signal.unit == "rad" and turn >= 2 and math.isclose(turn, round(turn), rel_tol=1e-9):
        steps = f"{round(turn)} steps a turn ({with_unit(part.step, signal.unit)})"
    ends = (part.lower, part.upper)
    return steps if math.inf in map(abs, ends) else f"{steps}, {_ends(*ends, signal.unit)}"


def _between(part: Saturation, signal: Signal) -> str:
    return _ends(part.lower, part.upper, signal.unit)


def _range(part: Any, signal: Signal) -> str:
    return f"{_ends(part.lower, part.upper, signal.unit)}; {'the last one' if part.held else 'the nearest end'} beyond"


def _drive(part: Pwm | Amplifier, signal: Signal) -> str:
    del signal
    if isinstance(part, Pwm):
        lost = f", {seconds(part.dead_time)} lost of each pulse" if part.dead_time else ""
        sags = f", {number_text(100 * part.sag)} % of it lost at full duty" if part.sag else ""
        kind = "every pulse" if part.switched else "mean and ripple" if part.ripple else "mean of the pulses"
        pulses = f"pulses at {number_text(part.frequency / 1000)} kHz from {number_text(part.supply)} V"
        return f"bridge with {pulses}{sags}{lost}; {kind}"
    known = {name: value for name, value in part.numbers.items() if math.isfinite(value)}
    numbers = f", with {value_text(known)}" if known else ""
    knows = "the controller knows what it gives" if part.measured else "the controller does not know what it gives"
    return f"no less than {part.lower}, no more than {part.upper}{numbers}; {knows}"


def _rule(rule: Any) -> str:
    if isinstance(rule, ExactHold):
        return "the estimator advances exactly between samples"
    name = "Euler steps" if isinstance(rule, Euler) else "Runge-Kutta steps of order 4"
    return name if rule.substeps == 1 else f"{name}, {rule.substeps} a period"


def _arithmetic(given: Any) -> str:
    size = "single" if given.precision is Precision.SINGLE else "double"
    return f"in {size} precision" + (" with fused multiply-add" if given.fuses else "")


def _lateness(deadline: Deadline) -> str:
    late = "" if deadline.lateness is None else f"a call more than {seconds(deadline.lateness)} late"
    missed = "" if deadline.missed is None else f"more than {deadline.missed} samples missed in a row"
    return " or ".join(each for each in (late, missed) if each)


def _reaction(reaction: Reaction) -> str:
    if isinstance(reaction, SafeOutput):
        return f"the safe output {value_text(reaction.output)} is commanded"
    return (
        "the controller continues, and the fault is reported"
        if isinstance(reaction, Report)
        else "the last command stays"
    )


def _stop(stop: EndStop, units: Mapping[str, str]) -> str:
    back = f", and {number_text(100 * stop.restitution)} % of the speed comes back" if stop.restitution else ""
    return f"{stop.position} {_ends(stop.lower, stop.upper, units[stop.position])}{back}"


def _ends(lower: float, upper: float, unit: str) -> str:
    if lower == -math.inf:
        return "without limits" if upper == math.inf else f"up to {with_unit(upper, unit)}"
    if upper == math.inf:
        return f"from {with_unit(lower, unit)} on"
    if lower == -upper:
        return f"within ±{with_unit(upper, unit)}"
    return f"from {with_unit(lower, unit)} to {with_unit(upper, unit)}"
