"""`Firmware`: the processor's step of a loop with its numbers filled in, as a chip runs it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ulna.deploy.errors import DeployError
from ulna.deploy.names import c_name, c_names
from ulna.loop import Amplifier, Hardware, Loop, fingerprint
from ulna.program import Fused, Kernel, Plain, Precision, Unwritten, bound, condensed, restricted, to_numpy
from ulna.sim import begun
from ulna.system import Signal

SHORTEST = 1e-7
"""s of a period."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Port:
    """A number that goes in or comes out.

    Attributes:
        slot: of the step. name: in C. signal: what it is.
    """

    slot: str
    name: str
    signal: Signal


ELAPSED = Port(slot="elapsed", name="elapsed", signal=Signal(name="elapsed", unit="s", text="time since the last call"))
"""What a loop with `Deadline(lateness=...)` is told."""
_KEPT = ("missed", "elapsed", "fault")
"""Names of the structures that no signal may have."""


# No slots: it is compared and shown by identity, and holds the loop it came from.
@dataclass(frozen=True, kw_only=True, eq=False)
class Firmware:
    """The step of a loop as a processor runs it.

    Attributes:
        name: of the library, and how its functions begin. loop: what was designed. precision: of every number.
        kernel: memory, measured values and references → memory, commands, estimates, fault code.
        memory: slots that one sample hands to the next, with their names in C.
        initial: the value of each slot before the first sample.
        inputs: measured values, references, what measuring amplifiers apply, the time since the last call.
        missed: whether the caller says that a sample was missed.
        commands, estimates: what comes out.
        fingerprint: of plant, design and hardware.
    """

    name: str
    loop: Loop
    precision: Precision
    kernel: Kernel
    memory: Mapping[str, str]
    initial: Mapping[str, float]
    inputs: tuple[Port, ...]
    missed: bool
    commands: tuple[Port, ...]
    estimates: tuple[Port, ...]
    fingerprint: str

    @property
    def hardware(self) -> Hardware:
        """Of the loop; it has a period."""
        return self.loop.fit({}).hardware

    def run(self, rows: np.ndarray) -> np.ndarray:
        """(N, outputs) of the step over N samples, in NumPy: the answer the C has to give, to the last bit.

        Args:
            rows: (N, inputs) SI values in the order of `inputs`; then 1 where the sample is missed, if it can be.

        Returns:
            Commands, estimates, then the fault code: the sum of the bits of `Fault`.
        """
        evaluate = to_numpy(self.kernel, precision=self.precision)
        slots = {name: self.precision.dtype(value) for name, value in self.initial.items()}
        names = [*(port.slot for port in self.inputs), *(["missed"] if self.missed else [])]
        wanted = [*(port.slot for port in (*self.commands, *self.estimates)), "code"]
        answer = np.zeros((len(rows), len(wanted)), dtype=self.precision.dtype)
        for k, row in enumerate(np.asarray(rows, dtype=self.precision.dtype)):
            known = {**slots, **dict(zip(names, row, strict=True))}
            found = dict(zip(self.kernel.outputs, evaluate(*(known[n] for n in self.kernel.inputs)), strict=True))
            slots = {name: found[name] for name in slots}
            answer[k] = [found[name] for name in wanted]
        return answer


def firmware(
    loop: Loop,
    *,
    name: str = "",
    precision: Precision = Precision.DOUBLE,
    initial: Mapping[str, float] | None = None,
) -> Firmware:
    """The firmware of a loop: what its processor runs.

    Args:
        loop: with a processor and a value for every parameter of the controller.
        name: of the library; that of the plant if left out.
        precision: of every number. In single precision the step is that of `Plain()` or `Fused()` in this precision.
        initial: SI values by name before the first sample: states of estimator and controller, estimates of an
            estimator in coordinates of its own, driven inputs; 0 where left out.

    Raises:
        DeployError: a loop without controller or period, names that clash in C, an unknown name in `initial`.
        SimulationError: a parameter of the controller without a value.
    """
    hardware = loop.hardware
    if loop.controller is None or hardware is None or not hardware.sampled:
        missing = "no controller" if loop.controller is None else "no processor: Hardware(period=...) is missing"
        raise DeployError(
            f"firmware of the loop of '{loop.plant.name}'",
            f"it has {missing}.",
            "Give Loop(plant=..., controller=..., hardware=Hardware(period=1e-3)).",
        )
    loop = in_precision(loop, precision)
    _check_period(hardware.period or 0.0)
    step, wiring = loop.step, loop.wiring
    commands = tuple(f"h{k}_0" for k in range(len(wiring.driven)))
    estimates = tuple(f"e{k}" for k in range(len(wiring.estimates)))
    fixed = {slot: value for slot, value in step.numbers.items() if slot not in ("missed", "begun", "elapsed")}
    whole = step.kernel
    # What a measuring amplifier tells takes the place of what the estimator would believe.
    told = [k for k, drive in enumerate(loop.fit({}).drives) if isinstance(drive, Amplifier) and drive.measured]
    memory = [slot for slot in whole.inputs if slot in whole.outputs and slot not in {f"believed{k}" for k in told}]
    wanted = [*commands, *estimates, *(slot for slot in memory if slot not in commands), "code"]
    kernel = bound(restricted(whole, wanted), fixed, precision=precision)
    kernel, memory = _without_idle(condensed(kernel), memory)
    return Firmware(
        name=_library_name(name, loop.plant.name),
        loop=loop,
        precision=precision,
        kernel=kernel,
        memory=_memory_names(loop, memory),
        initial=_initial(loop, memory, initial or {}),
        inputs=(
            *_ports("y", wiring.measured, taken=_KEPT),
            *_ports("r", wiring.references, taken=[*_KEPT, *(s.name for s in wiring.measured)]),
            *(port for port in _ports("believed", wiring.driven, taken=()) if int(port.slot[8:]) in told),
            *((ELAPSED,) if "elapsed" in kernel.inputs else ()),
        ),
        missed="missed" in kernel.inputs,
        commands=tuple(replace(p, slot=f"{p.slot}_0") for p in _ports("h", wiring.driven, taken=_KEPT)),
        estimates=_ports("e", wiring.estimates, taken=[*_KEPT, *(s.name for s in wiring.driven)]),
        fingerprint=fingerprint(loop),
    )


def controllers_part(loop: Loop, initial: Mapping[str, float]) -> dict[str, float]:
    """The initial values of a run that are the processor's: states of the controller, estimates, driven inputs."""
    own = {s.name for s in (*loop.wiring.memory, *_estimates(loop), *loop.wiring.driven)}
    return {name: float(value) for name, value in initial.items() if name in own}


def _estimates(loop: Loop) -> tuple[Signal, ...]:
    """What an estimator in coordinates of its own can be told to begin with."""
    estimator = loop.wiring.injected
    return () if estimator is None else estimator.system.outputs


def in_precision(loop: Loop, precision: Precision) -> Loop:
    """The loop with a processor that computes in this precision."""
    if loop.hardware is None:
        return loop
    if isinstance(loop.hardware.arithmetic, Unwritten):
        return loop
    kind = Fused if loop.hardware.arithmetic.fuses else Plain
    hardware = replace(loop.hardware, arithmetic=kind(precision=precision))
    return Loop(plant=loop.plant, controller=loop.controller, hardware=hardware)


def _check_period(period: float) -> None:
    if period < SHORTEST:
        found = f"{period:g} s is less than {SHORTEST:g} s, shorter than a step takes on any processor."
        raise DeployError(f"firmware with a period of {period:g} s", found, "Give the period in seconds.")


def _without_idle(kernel: Kernel, memory: list[str]) -> tuple[Kernel, list[str]]:
    """The kernel without memory that nothing reads."""
    while True:
        used = {k for each in kernel.instructions for k in each.operands} | set(kernel.results)
        read = {name for k, name in enumerate(kernel.inputs) if k in used}
        by_name = dict(zip(kernel.outputs, kernel.results, strict=True))
        idle = [slot for slot in memory if slot not in read]
        if not idle:
            return kernel, memory
        memory = [slot for slot in memory if slot not in idle]
        commands = re.compile(r"h\d+_0")
        kept = [label for label in by_name if label not in idle or commands.fullmatch(label)]
        kernel = bound(restricted(kernel, kept), dict.fromkeys(idle, 0.0))


def _library_name(given: str, plant: str) -> str:
    """The name that was asked for, else one made of the plant's."""
    if given and c_name(given) != given:
        raise DeployError(f"library '{given}'", "it is not a valid name in C.", f"Write '{c_name(given)}', say.")
    return given or c_name(plant).lower()


def _ports(stem: str, signals: tuple[Signal, ...], *, taken: Sequence[str]) -> tuple[Port, ...]:
    """The ports of signals in a structure where other names are taken already."""
    what = {"y": "measured signal", "r": "reference", "h": "command", "e": "estimate", "believed": "input"}[stem]
    names = c_names([*taken, *(s.name for s in signals)], what=what)[len(taken) :]
    names = tuple(f"applied_{each}" for each in names) if stem == "believed" else names
    return tuple(
        Port(slot=f"{stem}{k}", name=name, signal=signal)
        for k, (name, signal) in enumerate(zip(names, signals, strict=True))
    )


_SLOT = re.compile(r"([a-z_']+)(\d+)(?:_(\d+))?")


def _memory_names(loop: Loop, memory: list[str]) -> dict[str, str]:
    """Slot → name in C, said in the words of the signals."""
    wiring = loop.wiring
    rows: dict[str, tuple[str, tuple[Signal, ...]]] = {
        "z": ("state", wiring.memory),
        "kept": ("state_before", wiring.memory),
        "yn": ("measured", wiring.measured),
        "believed": ("believed", wiring.driven),
        "h": ("command", wiring.driven),
        "r_old": ("reference", wiring.references),
    }
    found: dict[str, str] = {}
    for slot in memory:
        match = _SLOT.fullmatch(slot)
        stem, place, age = match.groups() if match else (slot, None, None)
        if stem in rows and place is not None:
            head, signals = rows[stem]
            found[slot] = f"{head}_{c_name(signals[int(place)].name)}" + (f"_{age}" if age else "")
        else:
            found[slot] = slot.replace("'", "")
    return dict(zip(memory, c_names(found.values(), what="slot of memory"), strict=True))


def _initial(loop: Loop, memory: list[str], given: Mapping[str, float]) -> dict[str, float]:
    wiring = loop.wiring
    names: dict[str, Any] = {s.name: [] for s in _estimates(loop)}
    names |= {s.name: [f"z{k}"] for k, s in enumerate(wiring.memory)}
    for k, s in enumerate(wiring.driven):
        names[s.name] = [slot for slot in memory if slot == f"believed{k}" or slot.startswith(f"h{k}_")]
    unknown = [name for name in given if name not in names]
    if unknown:
        raise DeployError(
            f"initial value of '{unknown[0]}'",
            "the controller has no state and no command of this name.",
            f"Known: {', '.join(names)}.",
        )
    values = dict.fromkeys(memory, 0.0)
    # An estimator in coordinates of its own starts where its estimates are 0, as in the simulation.
    started = {name: float(rows[0]) for name, rows in begun(loop, given).items()}
    for name, value in {**loop.initial, **started}.items():
        values |= {slot: float(value) for slot in names[name] if slot in values}
    return values
