"""`FixedFirmware`: the processor's step of a loop in fixed point."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ulna.deploy.errors import DeployError
from ulna.deploy.firmware import Firmware, firmware
from ulna.deploy.fixed_point import FixedPoint
from ulna.deploy.rehearsal import rehearsal
from ulna.loop import Fault, Loop, Quantiser
from ulna.program import (
    Assembly,
    Doubt,
    Format,
    IntegerProgram,
    Kernel,
    Unwritten,
    format_of,
    to_fixed,
    to_python,
)
from ulna.system import Signal

REHEARSED, ROOM = 1000, 1.5
"""Samples of the run that ranges are taken from where none is known, and how many widths are added on either side."""
MICROSECOND = 1e-6
"""What times are counted in."""
LARGEST = 1e15
"""SI, of a range that a rehearsed run gives."""
_ROUNDS = 4
"""Of the analysis of memory that no signal stands for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """Lower and upper end in SI, and where they come from."""

    lower: float
    upper: float
    origin: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FixedFirmware:
    """The step in integers.

    Attributes:
        made: the same step in double precision, with names and ports. fixed: what was asked for.
        kernel, program: the step on counts in double precision, and in integers; both have its slots.
        counts: step of the sensor of each measured signal that comes in counts, by slot.
        ranges: of every signal, by its name.
        bounds: of each command, how far one call is from the step in double precision at most, SI: on the same inputs
            and memory, this step limited to the same ranges, too, and every doubt decided as there.
        seen: the largest such difference in the calls of the rehearsed run; larger than its bound where a doubt was
            decided otherwise.
        difference: largest difference of each command along the rehearsed run, where each step has a memory of its own.
        doubts: comparisons that may be decided otherwise, in names of the C.
    """

    made: Firmware
    fixed: FixedPoint
    kernel: Kernel
    program: IntegerProgram
    counts: Mapping[str, float]
    ranges: Mapping[str, Range]
    bounds: Mapping[str, float]
    seen: Mapping[str, float]
    difference: Mapping[str, float]
    doubts: tuple[Doubt, ...]

    def integers(self, rows: np.ndarray) -> list[list[int]]:
        """Rows in SI, in the order of the firmware's inputs, as the integers that the C takes."""
        names = [*(port.slot for port in self.made.inputs), *(["missed"] if self.made.missed else [])]
        forms = [(self.form_in(name), self.counts.get(name, 1.0)) for name in names]
        return [[form.integer(value / step) for value, (form, step) in zip(row, forms, strict=True)] for row in rows]

    def form_in(self, slot: str) -> Format:
        """The format of an input; one that nothing reads is passed on in SI."""
        return self.program.inputs.get(slot, Format(0, -1e9, 1e9))

    def run_integers(self, rows: list[list[int]]) -> list[list[int]]:
        """(N, outputs) integers of the C: commands, estimates, then the fault code."""
        wanted = [*(port.slot for port in (*self.made.commands, *self.made.estimates)), "code"]
        return [[found[name] for name in wanted] for _, found in self.calls(rows)]

    def calls(self, rows: list[list[int]]) -> Iterator[tuple[dict[str, int], dict[str, int]]]:
        """Inputs and outputs of the program at each call, by slot."""
        slots = {name: self.program.inputs[name].integer(value) for name, value in self.initial.items()}
        names = [*(port.slot for port in self.made.inputs), *(["missed"] if self.made.missed else [])]
        compute, inputs = self.program.compiled, tuple(self.program.inputs)
        for row in rows:
            known = {**slots, **dict(zip(names, row, strict=True))}
            found = dict(zip(self.program.outputs, compute(*(known[n] for n in inputs)), strict=True))
            slots = {name: found[name] for name in slots}
            yield known, found

    @property
    def accuracy(self) -> str:
        """How far it is from double precision, as half a sentence."""
        each = [
            f"{port.name} at most {self.bounds[port.name]:.2g} ({self.seen[port.name]:.2g} seen)"
            for port in self.made.commands
        ]
        return f"one call is off double precision by: {', '.join(each)}"

    @property
    def initial(self) -> Mapping[str, float]:
        """SI values of the memory before the first sample."""
        return self.made.initial

    def run(self, rows: np.ndarray) -> np.ndarray:
        """(N, outputs) in SI: commands, estimates, then the fault code."""
        answer = np.array(self.run_integers(self.integers(rows)), dtype=float)
        wanted = [*(port.slot for port in (*self.made.commands, *self.made.estimates)), "code"]
        return answer * np.array([2.0 ** -self.program.outputs[name].point for name in wanted])


def fixed_firmware(
    loop: Loop, fixed: FixedPoint, *, name: str = "", initial: Mapping[str, float] | None = None
) -> FixedFirmware:
    """The firmware of a loop in fixed point.

    Args:
        loop: as for `firmware`. fixed: bits and ranges. name, initial: as for `firmware`.

    Raises:
        DeployError: as `firmware`; a range of a name that the loop does not have, a guard with a bound of commands.
        UnboundedError: a value in between that has no bounds over the ranges.
    """
    made = firmware(loop, name=name, initial=initial)
    hardware = made.hardware
    if hardware.guard is not None and hardware.guard.largest < math.inf:
        raise DeployError(
            f"Guard(largest={hardware.guard.largest:g}) in fixed point", "commands are limited by their range.",
            "Leave it out and give saturation=Saturation(...).",
        )  # fmt: skip
    fitted = loop.fit({})
    counts = {f"y{k}": sensor.step for k, sensor in enumerate(fitted.sensors) if sensor is not None}
    counts |= {"elapsed": MICROSECOND} if hardware.told_elapsed else {}
    bare = replace(hardware, arithmetic=Unwritten(), guard=None, sensors=None, noise=None)
    shipped = firmware(
        Loop(plant=loop.plant, controller=loop.controller, hardware=bare), name=made.name, initial=initial
    )
    rows = rehearsal(made, REHEARSED)[:REHEARSED]
    seen = _envelope(made, rows)
    named = _ranges(made, fixed, seen)
    formats = _formats(shipped, named, counts, fitted.sensors)
    kernel = _counted(shipped.kernel, counts)
    program = _program(kernel, shipped, formats, fixed)
    found = FixedFirmware(
        made=replace(made, kernel=shipped.kernel, memory=shipped.memory, initial=shipped.initial, loop=made.loop),
        fixed=fixed, kernel=kernel, program=program, counts=counts, ranges=named, seen={}, difference={},
        bounds={port.name: program.errors[port.slot] for port in made.commands}, doubts=_doubts(made, program),
    )  # fmt: skip
    worst = np.abs(made.run(rows) - found.run(rows)).max(axis=0).tolist()
    return replace(
        found,
        seen=_seen(found, rows),
        difference={port.name: worst[k] for k, port in enumerate(made.commands)},
    )


def _seen(found: FixedFirmware, rows: np.ndarray) -> dict[str, float]:
    """The largest difference of each command from the step in double precision, call by call on the same memory."""
    program, kernel, evaluate = found.program, found.kernel, to_python(found.kernel)
    worst = {port.name: 0.0 for port in found.made.commands}
    for given, answer in found.calls(found.integers(rows)):
        exact = evaluate(*(program.inputs[name].number(given[name]) for name in kernel.inputs))
        numbers = dict(zip(kernel.outputs, exact, strict=True))
        for port in found.made.commands:
            form = program.outputs[port.slot]
            expected = min(max(numbers[port.slot], form.lower), form.upper)
            worst[port.name] = max(worst[port.name], abs(form.number(answer[port.slot]) - expected))
    return worst


def _doubts(made: Firmware, program: IntegerProgram) -> tuple[Doubt, ...]:
    """The doubts of a program, slots called as in C."""
    names = dict(made.memory) | {port.slot: port.name for port in made.inputs}
    return tuple(
        replace(each, text=re.sub(r"[a-z_]\w*", lambda word: names.get(word[0], word[0]), each.text))
        for each in program.doubts
    )


def _counted(kernel: Kernel, counts: Mapping[str, float]) -> Kernel:
    """The kernel with counts in place of measured values."""
    w = Assembly(kernel.name)
    given = {slot: w.input(slot) * step for slot, step in counts.items() if slot in kernel.inputs}
    return w.finished(w.call(kernel, given))


def _envelope(made: Firmware, rows: np.ndarray) -> dict[str, tuple[float, float]]:
    """The least and the largest value of every slot along a run in double precision."""
    evaluate, kernel = to_python(made.kernel), made.kernel
    slots = dict(made.initial)
    names = [*(port.slot for port in made.inputs), *(["missed"] if made.missed else [])]
    found: dict[str, tuple[float, float]] = {}
    for row in rows.tolist():
        known = {**slots, **dict(zip(names, row, strict=True))}
        values = dict(zip(kernel.outputs, evaluate(*(known[n] for n in kernel.inputs)), strict=True))
        slots = {name: values[name] for name in slots}
        for name, value in {**known, **values}.items():
            low, high = found.get(name, (value, value))
            found[name] = min(low, value), max(high, value)
    return found


def _ranges(made: Firmware, fixed: FixedPoint, seen: Mapping[str, tuple[float, float]]) -> dict[str, Range]:
    """The range of every signal by name."""
    wiring, fitted = made.loop.wiring, made.loop.fit({})
    rows = [(s, f"y{k}") for k, s in enumerate(wiring.measured)] + [
        (s, f"r{k}") for k, s in enumerate(wiring.references)
    ]
    rows += [(s, f"z{k}") for k, s in enumerate(wiring.memory)] + [(s, f"h{k}_0") for k, s in enumerate(wiring.driven)]
    names = [s.name for s, _ in rows]
    unknown = [name for name in fixed.ranges if name not in names]
    if unknown:
        raise DeployError(
            f"the range of '{unknown[0]}'", "the controller has no signal of this name.", f"Known: {', '.join(names)}."
        )
    limits = dict(zip((s.name for s in wiring.driven), fitted.saturations, strict=True))
    found = {}
    for signal, slot in rows:
        limit = limits.get(signal.name) if slot.startswith("h") else None
        if signal.name in fixed.ranges:
            low, high, origin = *fixed.ranges[signal.name], "stated"
        elif limit is not None and math.isfinite(limit.lower) and math.isfinite(limit.upper):
            low, high, origin = limit.lower, limit.upper, "its saturation"
        elif signal.lower is not None and signal.upper is not None:
            low, high, origin = float(signal.lower), float(signal.upper), "declared"
        else:
            low, high = _roomy(*seen.get(slot, (0.0, 0.0)))
            if not (abs(low) + abs(high) < LARGEST):
                raise DeployError(
                    f"the range of '{signal.name}' in fixed point",
                    "none is stated, and the rehearsed run near the operating point does not stay within any.",
                    f"State it: FixedPoint(ranges={{'{signal.name}': (-1.0, 1.0)}}), say.",
                )
            origin = "four times a rehearsed run"
        found[signal.name] = Range(lower=low, upper=high, origin=origin)
    return found


def _roomy(low: float, high: float) -> tuple[float, float]:
    """Wider on both sides; what stays far from 0 keeps its sign."""
    width = max(high - low, 1e-3 * max(abs(low), abs(high))) or 1.0
    wide = low - ROOM * width, high + ROOM * width
    if low > width:
        return max(wide[0], low / 2.0), wide[1]
    return wide if high > -width else (wide[0], min(wide[1], high / 2.0))


def _formats(
    made: Firmware, named: Mapping[str, Range], counts: Mapping[str, float], sensors: tuple[Quantiser | None, ...]
) -> dict[str, Format]:
    """The format of every slot that a signal or a counter stands for."""
    wiring, hardware = made.loop.wiring, made.hardware
    found: dict[str, Format] = {}

    def put(slots: list[str], signal: Signal) -> None:
        bounds = named[signal.name]
        for slot in slots:
            value = made.initial.get(slot)
            ends = [bounds.lower, bounds.upper] + ([] if value is None else [value])
            found[slot] = format_of(min(ends), max(ends))

    for k, signal in enumerate(wiring.measured):
        put([f"y{k}", f"yn{k}"], signal)
        sensor = sensors[k]
        if f"y{k}" in counts and sensor is not None:
            bounds = named[signal.name]
            low, high = max(bounds.lower, sensor.lower), min(bounds.upper, sensor.upper)
            found[f"y{k}"] = Format(0, math.ceil(low / sensor.step), math.floor(high / sensor.step))
    for k, signal in enumerate(wiring.references):
        put([f"r{k}", f"r_old{k}"], signal)
    for k, signal in enumerate(wiring.memory):
        put([f"z{k}", f"kept{k}"], signal)
    for k, signal in enumerate(wiring.driven):
        put([f"believed{k}", *(slot for slot in made.memory if slot.startswith(f"h{k}_"))], signal)
    period = hardware.period or 0.0
    most = 2.0 * (period + (hardware.deadline.lateness or 0.0)) if hardware.deadline else period
    found |= {"missed": Format(0, 0, 1), "begun": Format(0, 0, 1), "lost": Format(0, 0, 1)}
    found["code"] = Format(0, 0, float(sum(Fault)))
    found["elapsed"] = Format(0, 0, math.ceil(2.0 * most / MICROSECOND))
    limit = hardware.innovation
    for slot, value in (
        ("absent", hardware.deadline.missed if hardware.deadline else 0),
        ("astray", limit.samples if limit else 0),
        ("calm", limit.resume if limit else 0),
    ):
        found[slot] = Format(0, 0, float(value or 0) + 1.0)
    return found


def _program(kernel: Kernel, made: Firmware, known: Mapping[str, Format], fixed: FixedPoint) -> IntegerProgram:
    """The program; memory that no signal stands for gets the range that is computed for it.

    Raises:
        DeployError: memory whose range grows from sample to sample.
    """
    formats = dict(known)
    derived = [slot for slot in made.memory if slot not in formats]
    for slot in derived:
        formats[slot] = format_of(made.initial[slot], made.initial[slot])
    wider: dict[str, Format] = {}
    for _ in range(_ROUNDS):
        program = to_fixed(kernel, formats, {k: v for k, v in formats.items() if k not in derived}, factor=fixed.factor)
        wider = {}
        for slot in derived:
            old, new = formats[slot], program.outputs[slot]
            if new.lower < old.lower or new.upper > old.upper:
                wider[slot] = format_of(min(old.lower, new.lower), max(old.upper, new.upper))
        if not wider:
            return to_fixed(kernel, formats, formats, factor=fixed.factor)
        formats |= wider
    slot = next(iter(wider))
    bounds = formats[slot]
    raise DeployError(
        f"the memory '{made.memory[slot]}' in fixed point",
        f"its range grows from sample to sample and has reached [{bounds.lower:.3g}, {bounds.upper:.3g}].",
        "Use single precision.",
    )
