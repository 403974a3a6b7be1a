"""`Fitted`: hardware fitted to a wiring: which option each signal has, and every number by name."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from ulna.base import SimulationError
from ulna.loop.discretisation import Discretisation, ExactHold
from ulna.loop.drive import Amplifier, Pwm
from ulna.loop.hardware import Hardware
from ulna.loop.limits import Saturation, SlewLimit
from ulna.loop.reaction import SafeOutput
from ulna.loop.sensors import MeasurementNoise, Quantiser
from ulna.loop.watches import ReferenceRange
from ulna.loop.wiring import Wiring
from ulna.program import HOISTED, Kernel, in_arithmetic, to_python
from ulna.symbolic.compiling import rounded
from ulna.system import LinearInjection, Signal

TINY = 1e-9
"""Part of a period below which a time counts as a whole number of periods."""

Option = TypeVar("Option")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fitted:
    """A loop with a processor, every choice made: what the kernels of step and flow are written from.

    Attributes:
        wiring: names and formulas. hardware: what was asked for. period: s.
        whole_delay: periods. fraction: of a period, the rest of the delay.
        saturations, slews, drives: for each driven input. sensors, noises: for each measured signal.
        ranges: of each reference, both ends known.
        frozen: places in the memory of integrals under anti-windup.
        walls: of each end stop the places of position and velocity among the plant's states.
        numbers: what holds forever, by the name of the kernels' input.
    """

    wiring: Wiring
    hardware: Hardware
    period: float
    whole_delay: int
    fraction: float
    saturations: tuple[Saturation | None, ...]
    slews: tuple[SlewLimit | None, ...]
    drives: tuple[Pwm | Amplifier | None, ...]
    sensors: tuple[Quantiser | None, ...]
    noises: tuple[MeasurementNoise | None, ...]
    ranges: tuple[ReferenceRange | None, ...]
    frozen: tuple[int, ...]
    walls: tuple[tuple[int, int], ...]
    numbers: Mapping[str, float]

    @property
    def split(self) -> bool:
        """Whether the input changes within a period."""
        return self.fraction > TINY

    @property
    def rule(self) -> Discretisation | None:
        """How the controller is discretised; None where it is in discrete time."""
        return None if self.wiring.discrete else self.hardware.discretisation

    def written(self, kernel: Kernel) -> Kernel:
        """The formulas of a kernel in the processor's arithmetic."""
        return in_arithmetic(kernel, self.hardware.arithmetic)

    def finished(self, kernel: Kernel) -> Kernel:
        """A kernel put together of formulas and sums: without fused steps where the arithmetic has none."""
        return kernel if self.hardware.arithmetic.fuses else in_arithmetic(kernel, self.hardware.arithmetic)


def fitted(wiring: Wiring, hardware: Hardware, parameters: Mapping[str, float]) -> Fitted:
    """The hardware fitted to a wiring.

    Args:
        wiring: of plant and controller. hardware: with a period.
        parameters: SI values of the controller's parameters, where other than its own.

    Raises:
        SimulationError: options of signals that do not exist, options that contradict each other, parameters without
            a value.
    """
    period = hardware.period
    if period is None:
        raise SimulationError("step of a loop", "its controller is continuous.", "Give Hardware(period=...).")
    if isinstance(hardware.discretisation, ExactHold) and (wiring.injected is None or wiring.discrete):
        raise SimulationError(
            "ExactHold()",
            "it needs an estimator whose linear part is known.",
            "Give a compensator with injected_observer(form, gains), or another discretisation.",
        )
    whole = math.floor(hardware.delay / period + TINY)
    _check_reactions(hardware, wiring)
    drives = _each("drive", hardware.drive, wiring.driven)
    found = Fitted(
        wiring=wiring,
        hardware=hardware,
        period=period,
        whole_delay=whole,
        fraction=hardware.delay / period - whole,
        saturations=_each("saturation", hardware.saturation, wiring.driven),
        slews=_each("slew", hardware.slew, wiring.driven),
        drives=drives,
        sensors=_each("sensors", hardware.sensors, wiring.measured),
        noises=_each("noise", hardware.noise, wiring.measured),
        ranges=_ranges(hardware, wiring),
        frozen=_frozen(hardware, wiring),
        walls=_walls(hardware, wiring),
        numbers={},
    )
    found.numbers.update(_numbers(found) | _held_numbers(found, parameters))  # type: ignore[attr-defined]
    return found


def _each(
    what: str, given: Option | Mapping[str, Option] | None, signals: tuple[Signal, ...]
) -> tuple[Option | None, ...]:
    """The option of each signal."""
    names = [s.name for s in signals]
    if not isinstance(given, Mapping):
        return (given,) * len(names)
    unknown = [name for name in given if name not in names]
    if unknown:
        raise SimulationError(
            f"Hardware({what}=...)",
            f"the loop has no signal {', '.join(unknown)} there.",
            f"Known: {', '.join(names) or 'none'}.",
        )
    return tuple(given.get(name) for name in names)


def _check_reactions(hardware: Hardware, wiring: Wiring) -> None:
    """Refuse safe outputs of inputs that are not driven."""
    for what in ("guard", "deadline", "innovation"):
        asked = getattr(hardware, what)
        if asked is not None and isinstance(asked.reaction, SafeOutput) and isinstance(asked.reaction.output, Mapping):
            _each(what, asked.reaction.output, wiring.driven)


def _ranges(hardware: Hardware, wiring: Wiring) -> tuple[ReferenceRange | None, ...]:
    """Ends that are not given are those that the signal declares; without either there is none on this side."""
    found: list[ReferenceRange | None] = []
    for asked, signal in zip(
        _each("references", hardware.references, wiring.references), wiring.references, strict=True
    ):
        if asked is None:
            found.append(None)
            continue
        ends = [(asked.lower, signal.lower, -math.inf), (asked.upper, signal.upper, math.inf)]
        low, high = (
            given if given is not None else float(declared) if declared is not None else open_
            for given, declared, open_ in ends
        )
        if math.isinf(low) and math.isinf(high):
            raise SimulationError(
                f"ReferenceRange() of '{signal.name}'",
                "the reference declares no range, and none is given.",
                "Give ReferenceRange(lower=-1.0, upper=1.0), say.",
            )
        found.append(ReferenceRange(lower=low, upper=high, held=asked.held))
    return tuple(found)


def _frozen(hardware: Hardware, wiring: Wiring) -> tuple[int, ...]:
    if hardware.anti_windup is None:
        return ()
    names = [s.name for s in wiring.memory]
    unknown = [name for name in hardware.anti_windup.states if name not in names]
    if unknown:
        raise SimulationError(
            "anti-windup", f"the controller has no state {', '.join(unknown)}.", f"Known: {', '.join(names) or 'none'}."
        )
    return tuple(names.index(name) for name in hardware.anti_windup.states)


def _walls(hardware: Hardware, wiring: Wiring) -> tuple[tuple[int, int], ...]:
    names = [s.name for s in wiring.plant.states]
    for wall in hardware.end_stops:
        for name in (wall.position, wall.velocity):
            if name not in names:
                raise SimulationError(
                    "EndStop", f"'{wiring.plant.name}' has no state '{name}'.", f"Its states: {', '.join(names)}."
                )
    return tuple((names.index(wall.position), names.index(wall.velocity)) for wall in hardware.end_stops)


def _numbers(loop: Fitted) -> dict[str, float]:
    """Limits, steps and times."""
    hardware = loop.hardware
    numbers = {
        "period": loop.period,
        "fraction": loop.fraction,
        "jitter": hardware.jitter.width if hardware.jitter else 0.0,
        "missed_share": hardware.missed.probability if hardware.missed else 0.0,
    }
    numbers |= _watched(loop)
    for k, saturation in enumerate(loop.saturations):
        if saturation is not None:
            numbers |= {f"lower{k}": saturation.lower, f"upper{k}": saturation.upper}
    for k, slew in enumerate(loop.slews):
        if slew is not None:
            numbers[f"change{k}"] = slew.rate * loop.period
    for k, sensor in enumerate(loop.sensors):
        if sensor is not None:
            numbers |= {f"step{k}": sensor.step, f"codes{k}": 1.0 / sensor.step}
            numbers |= {f"code_low{k}": sensor.lower, f"code_high{k}": sensor.upper}
    for k, noise in enumerate(loop.noises):
        if noise is not None:
            numbers[f"std{k}"] = noise.std
    for k, drive in enumerate(loop.drives):
        if isinstance(drive, Pwm):
            numbers |= {
                f"supply{k}": drive.supply,
                f"sag{k}": drive.sag,
                f"dead{k}": drive.dead_time * drive.frequency,
            }
        elif drive is not None:
            numbers |= {f"drive{k}_{name}": float(value) for name, value in drive.numbers.items()}
    for k, wall in enumerate(hardware.end_stops):
        numbers |= {f"wall_low{k}": wall.lower, f"wall_high{k}": wall.upper, f"bounce{k}": wall.restitution}
    return numbers


def _watched(loop: Fitted) -> dict[str, float]:
    """Ends of references, and how late a call may be."""
    deadline, numbers = loop.hardware.deadline, dict[str, float]()
    if deadline is not None and deadline.lateness is not None:
        numbers["latest"] = loop.period + deadline.lateness
    for k, bounds in enumerate(loop.ranges):
        if bounds is not None and bounds.lower is not None and bounds.upper is not None:
            numbers |= {f"range_low{k}": bounds.lower, f"range_high{k}": bounds.upper}
    return numbers


def _held_numbers(loop: Fitted, parameters: Mapping[str, float]) -> dict[str, float]:
    """The controller's coefficients, then Φ, G₀ and G₁ of an exact hold row by row."""
    wiring = loop.wiring
    known = parameters_of(wiring, parameters)
    before = wiring.controller.before
    values = to_python(before)(*(known[int(name[1:])] for name in before.inputs))
    if not all(map(math.isfinite, values)):
        raise SimulationError(f"controller of '{wiring.plant.name}'", "its formulas are not finite for its parameters.")
    numbers = {f"{HOISTED}{k}": value for k, value in enumerate(values)}
    rule, injected = loop.hardware.discretisation, wiring.injected
    if isinstance(rule, ExactHold) and isinstance(injected, LinearInjection):
        table = dict(zip(injected.system.parameter_symbols, known, strict=False))
        matrix = np.array(injected.matrix.xreplace(table), dtype=float)
        blocks = held_matrices(matrix, loop.period, interpolate=rule.interpolate)
        for name, block in zip(("phi", "g0", "g1"), blocks, strict=True):
            numbers |= {f"{name}_{i}_{j}": float(block[i, j]) for i, j in np.ndindex(block.shape)}
    return numbers


def held_matrices(matrix: np.ndarray, period: float, *, interpolate: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(Φ, G₀, G₁), each (n, n), of z' = F z + w with w on a straight line from w₀ to w₁, or held at w₀.

    One matrix exponential gives all three: C. F. Van Loan, "Computing integrals involving the matrix exponential",
    IEEE Trans. Autom. Contr. 23 (1978).
    """
    from scipy.linalg import expm  # as long to import as the rest of ulna

    n = len(matrix)
    whole = np.zeros((3 * n, 3 * n))
    whole[:n, :n] = matrix * period
    whole[:n, n : 2 * n] = np.eye(n) * period
    whole[n : 2 * n, 2 * n :] = np.eye(n)
    grown = expm(whole)
    phi, step, ramp = grown[:n, :n], grown[:n, n : 2 * n], grown[:n, 2 * n :]
    return (phi, step - ramp, ramp) if interpolate else (phi, step, np.zeros((n, n)))


def parameters_of(wiring: Wiring, given: Mapping[str, float]) -> list[float]:
    """(q,) SI values of the parameters of estimator and controller.

    Raises:
        SimulationError: parameters without a value.
    """
    missing = [name for name, value in wiring.parameters if value is None and name not in given]
    if missing:
        raise SimulationError(
            f"controller of '{wiring.plant.name}'",
            f"parameters without a value: {', '.join(dict.fromkeys(missing))}.",
            f"Give them: parameters={{'{missing[0]}': ...}}, or design for with_values().",
        )
    return [
        rounded(value, name) if value is not None and name not in given else given[name]
        for name, value in wiring.parameters
    ]
