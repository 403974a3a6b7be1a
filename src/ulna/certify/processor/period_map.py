"""`PeriodMap`: one sampling period of a loop on its processor in balls, with its slopes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import sympy as sp
from flint import arb, arb_mat

from ulna.certify.errors import CertifyError
from ulna.certify.processor.moving import Moving, moved_by
from ulna.certify.region import check_smooth
from ulna.loop import Hardware, Loop
from ulna.program import Kernel, Unwritten, bound, restricted
from ulna.symbolic.compiling import kernel
from ulna.symbolic.formulas import exact
from ulna.system import starting_point

ORDER = 8
"""Of the series of a plant's slopes over a stretch of a period."""
_TURN, _MOST = 0.5, 50
_TRIES, _LEAST = 12, arb(0, 1e-14)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sensor:
    """A measured value: within `half_step` of the plant's, SI, as long as that lies between lower and upper."""

    half_step: float
    lower: float
    upper: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PeriodMap:
    """What is between one sample and the next: read, compute, command; then the plant moves with its inputs held.

    The state is that of the plant, then the memory of the processor. Sensors are exact up to a disturbance each.

    Attributes:
        name: of the loop. states: names of the plant's. memory: slots of the processor.
        rates: x' in states and inputs. inputs: symbols of the driven ones. readings: in states. sensors: of these.
        motion, reading: the same as kernels.
        step: of the processor. first: the same at the first sample, where nothing is advanced.
        stretches: length in s, and the slot that each input holds meanwhile.
    """

    name: str
    states: tuple[str, ...]
    memory: tuple[str, ...]
    rates: tuple[sp.Expr, ...]
    inputs: tuple[sp.Symbol, ...]
    readings: tuple[sp.Expr, ...]
    sensors: tuple[Sensor, ...]
    motion: Kernel
    reading: Kernel
    step: Kernel
    first: Kernel
    stretches: tuple[tuple[sp.Rational, tuple[str, ...]], ...]

    @property
    def size(self) -> int:
        """States and memory together."""
        return len(self.states) + len(self.memory)

    def moved(
        self, point: Sequence[arb], noise: Sequence[arb], *, first: bool = False
    ) -> tuple[list[arb], list[list[arb]]]:
        """The state one period later, and its slopes by the state and then by the disturbances of the sensors.

        Every value that the exact loop takes from a start in these balls is in the balls of the answer; a NaN where
        the loop may have no value, or a sensor may be out of its range.
        """
        x, done = self._computed(point, noise, first=first)
        for length, held in self.stretches:
            x = _flown(self.motion, x, [done[slot] for slot in held], arb(int(length.p)) / int(length.q))
        whole, every = [*x, *(done[name] for name in self.memory)], len(point) + len(noise)
        return [each.value for each in whole], [_row(each, every) for each in whole]

    def held(self, point: Sequence[arb]) -> list[arb]:
        """What the plant's inputs hold at the end of the period, sensors exact."""
        _, done = self._computed(point, [arb(0)] * len(self.sensors), first=False)
        return [done[slot].value for slot in self.stretches[-1][1]]

    def _computed(
        self, point: Sequence[arb], noise: Sequence[arb], *, first: bool
    ) -> tuple[list[Moving], dict[str, Moving]]:
        """The plant at the sample, and what the processor makes of it, by slot."""
        n, m = len(self.states), self.size
        every = m + len(noise)
        units = [arb_mat(1, every, [int(i == j) for j in range(every)]) for i in range(every)]
        x = [Moving(v, unit) for v, unit in zip(point, units, strict=False)][:n]
        slots = {name: Moving(v, unit) for name, v, unit in zip(self.memory, point[n:], units[n:m], strict=True)}
        seen = moved_by(self.reading, dict(zip(self.reading.inputs, x, strict=True)))
        for (name, value), sensor, disturbance, unit in zip(seen.items(), self.sensors, noise, units[m:], strict=True):
            inside = value.value >= sensor.lower and value.value <= sensor.upper
            read = value.value + disturbance if inside else arb("nan")
            slots[name] = Moving(read, unit if value.slope is None else value.slope + unit)
        program = self.first if first else self.step
        return x, moved_by(program, {name: slots[name] for name in program.inputs})


def _flown(motion: Kernel, x: Sequence[Moving], held: Sequence[Moving], time: arb) -> list[Moving]:
    """The plant after a time with its inputs held.

    First a box that no run leaves meanwhile, by Picard's operator. In it Φ' = J(t) Φ for the slopes by the start and
    Γ' = J(t) Γ + G(t) for those by the inputs, J and G within the slopes over the box; the Peano-Baker series of both
    are within Σ (hJ)ᵏ/k! and h Σ (hJ)ᵏ/(k+1)! G, a convex set of matrices standing in for each factor.
    """
    n, m = len(x), len(held)
    tube = _tube(motion, [each.value for each in x], [each.value for each in held], time)
    if tube is None:
        return [Moving(arb("nan"))] * n
    rates, slopes = _slopes(motion, tube, [each.value for each in held])
    J = arb_mat(n, n, [slopes[i][j] for i in range(n) for j in range(n)]) * time
    G = arb_mat(n, m, [slopes[i][n + j] for i in range(n) for j in range(m)]) * time
    size = max((float(sum((J[i, j].abs_upper() for j in range(n)), arb(0)).upper()) for i in range(n)), default=0.0)
    if not size < ORDER / 2:
        return [Moving(arb("nan"))] * n
    power = total = mean = arb_mat(n, n, [int(i == j) for i in range(n) for j in range(n)])
    for k in range(1, ORDER + 1):
        power = power * J * (arb(1) / k)
        total, mean = total + power, mean + power * (arb(1) / (k + 1))
    # Beyond: at most twice the first term left out, in every entry.
    beyond = arb(0, 2.0 * float((arb(size) ** (ORDER + 1) / math.factorial(ORDER + 1)).upper()) + 1e-300)
    rest = arb_mat(n, n, [beyond] * (n * n))
    Phi, Gamma = total + rest, (mean + rest) * G
    width = next((each.slope.ncols() for each in (*x, *held) if each.slope is not None), 0)
    before = arb_mat(n, width, [v for each in x for v in _row(each, width)])
    pushed = arb_mat(m, width, [v for each in held for v in _row(each, width)])
    after = Phi * before + Gamma * pushed
    values = [each.value + time * rate for each, rate in zip(x, rates, strict=True)]
    return [Moving(v, arb_mat(1, width, [after[i, j] for j in range(width)])) for i, v in enumerate(values)]


def _row(each: Moving, width: int) -> list[arb]:
    """The slopes; of what has no value they have none either."""
    if each.slope is None:
        return [arb(0) if each.value.is_finite() else arb("nan")] * width
    return each.slope.entries()


def _tube(motion: Kernel, start: Sequence[arb], held: Sequence[arb], time: arb) -> list[arb] | None:
    """A box that holds every run from the start for the time; None where none is found."""
    part, wider = arb(0.5, 0.5) * time, arb(0.5, 0.75) * time
    box = list(start)
    for _ in range(_TRIES):
        rates, _ = _slopes(motion, box, held)
        reached = [x + part * rate for x, rate in zip(start, rates, strict=True)]
        if not all(v.is_finite() for v in reached):
            return None
        if all(b.contains(r) for b, r in zip(box, reached, strict=True)):
            return box
        box = [x + wider * rate + _LEAST * (1 + abs(x)) for x, rate in zip(start, rates, strict=True)]
    return None


def _slopes(motion: Kernel, box: Sequence[arb], held: Sequence[arb]) -> tuple[list[arb], list[list[arb]]]:
    """x' and its slopes by states and inputs."""
    point = [*box, *held]
    width = len(point)
    given = [Moving(v, arb_mat(1, width, [int(i == j) for j in range(width)])) for i, v in enumerate(point)]
    found = moved_by(motion, dict(zip(motion.inputs, given, strict=True)))
    return [each.value for each in found.values()], [_row(each, width) for each in found.values()]


def period_map(loop: Loop, inputs: Mapping[str, Any], *, limits: bool = True) -> PeriodMap:
    """The map of a loop with a processor; references and disturbances are held.

    Args:
        loop: with a period. inputs: SI values by name. limits: whether saturation counts.

    Raises:
        CertifyError: hardware that no theorem here speaks of, unknown inputs, formulas that are not smooth.
    """
    hardware, wiring = _checked(loop, inputs), loop.wiring
    bare = replace(hardware, sensors=None, guard=None, arithmetic=Unwritten())
    found = replace(loop, hardware=bare if limits else replace(bare, saturation=None, slew=None))
    plant, fitted = loop.plant, loop.fit({})
    held = {s.symbol: exact(inputs.get(s.name, 0)) for s in wiring.disturbances} | dict(plant.values)
    taken = {s.name for s in plant.states}
    names = [f"u{k}" if f"u{k}" not in taken else f"u{k}_held" for k in range(len(wiring.driven))]
    u = tuple(sp.Symbol(name, real=True) for name in names)
    held |= dict(zip((s.symbol for s in wiring.driven), u, strict=True))
    rates = tuple(e.xreplace(held) for e in plant.inline(plant.rates))
    readings = tuple(e.xreplace(held) for e in wiring.readings)
    check_smooth(plant.name, (*rates, *readings))
    numbers = dict(found.step.numbers)
    for k, reference in enumerate(wiring.references):
        numbers |= dict.fromkeys((f"r{k}", f"r_old{k}"), float(inputs.get(reference.name, 0)))
    whole = found.step.kernel
    memory = tuple(name for name in found.step.memory if name != "begun" and not name.startswith("r_old"))
    late = tuple(f"late{k}" for k in range(len(u)))
    early = tuple(f"early{k}" for k in range(len(u)))
    wanted = restricted(whole, dict.fromkeys((*memory, *late, *(early if fitted.split else ()))))
    period = sp.Rational(exact(fitted.period))
    part = period * sp.Rational(exact(fitted.fraction))
    x = list(plant.state_symbols)
    motion = kernel("rates", [*x, *u], {f"x'{k}": e for k, e in enumerate(rates)})
    return PeriodMap(
        name=plant.name,
        states=tuple(s.name for s in plant.states),
        memory=memory,
        rates=rates,
        inputs=u,
        readings=readings,
        sensors=tuple(
            Sensor(half_step=0.0, lower=-math.inf, upper=math.inf)
            if each is None
            else Sensor(half_step=each.step / 2, lower=each.lower, upper=each.upper)
            for each in fitted.sensors
        ),
        motion=motion,
        reading=kernel("readings", x, {f"y{k}": e for k, e in enumerate(readings)}),
        step=bound(wanted, {**numbers, "begun": 1.0}),
        first=bound(wanted, {**numbers, "begun": 0.0}),
        stretches=tuple(
            (length / count, slots)
            for length, slots in (((part, early), (period - part, late)) if fitted.split else ((period, late),))
            for count in [_parts(motion, loop, float(length))]
            for _ in range(count)
        ),
    )


def _parts(motion: Kernel, loop: Loop, time: float) -> int:
    """Into how many parts a stretch is cut, so that in each of them the plant turns little."""
    point = starting_point(loop.plant).numbers
    at = [arb(float(point.get(s.name, 0.0))) for s in loop.plant.states]
    _, rows = _slopes(motion, at, [arb(0)] * (len(motion.inputs) - len(at)))
    turn = max((sum(float(abs(v).upper()) for v in row[: len(at)]) for row in rows), default=0.0) * time
    return max(1, math.ceil(turn / _TURN)) if turn < _MOST * _TURN else _MOST


def _checked(loop: Loop, inputs: Mapping[str, Any]) -> Hardware:
    asked, hardware = f"an ultimate bound of the loop of '{loop.plant.name}'", loop.hardware
    if not loop.sampled or hardware is None or loop.controller is None:
        raise CertifyError(
            asked, "it has no processor.", "Give Hardware(period=...); without one ask for Region() or StableWithin()."
        )
    if loop.plant.discrete:
        raise CertifyError(asked, "its plant is in discrete time.", "Give a plant in continuous time.")
    present = {
        "noise, which has no largest value": hardware.noise,
        "a drive other than the voltage itself": hardware.drive,
        "a clock that jitters or misses samples": hardware.clock,
        "end stops": hardware.end_stops,
        "a watch over deadlines, references or innovations": hardware.watches,
        "a guard against commands above a size": hardware.guard is not None and math.isfinite(hardware.guard.largest),
    }
    for what, given in present.items():
        if given:
            raise CertifyError(asked, f"it has {what}, which this theorem does not cover.", "Leave it out.")
    missing = [p.name for p in loop.plant.parameters if p.value is None]
    if missing:
        raise CertifyError(asked, f"parameters without a value: {', '.join(missing)}.", "Give them values.")
    if any(d.implicit for d in loop.plant.definitions):
        raise CertifyError(asked, "some of its definitions are implicit equations.", "Solve them by hand.")
    known = [s.name for s in (*loop.references, *loop.disturbances)]
    unknown = [name for name in inputs if name not in known]
    if unknown:
        raise CertifyError(
            f"the input '{unknown[0]}'", "the loop has no such input.", f"Known: {', '.join(known) or 'none'}."
        )
    return hardware
