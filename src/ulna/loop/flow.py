"""`Flow`: how the plant moves from one sample to the next, as kernels over named slots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ulna.base import SimulationError
from ulna.loop.applied import bridges
from ulna.loop.drive import Pwm
from ulna.loop.fitted import Fitted
from ulna.loop.pace import pace
from ulna.loop.pulses import CARRIERS, STEPS, pulses, shifted
from ulna.loop.rows import roles, row_of
from ulna.loop.runge_kutta import combined, mean, moved
from ulna.loop.wiring import TIME, Wiring, numbered
from ulna.program import HOISTED, Assembly, Hoisted, Kernel, Scalar, hoist
from ulna.symbolic.compiling import kernel


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeat:
    """A body that runs so many times, by the name of one of the flow's `numbers`."""

    times: str
    body: tuple[Kernel | Repeat, ...]


Program = tuple[Kernel | Repeat, ...]
"""Kernels and repetitions of them, one after the other."""


def unrolled(program: Program, numbers: Mapping[str, float]) -> list[Kernel]:
    """The kernels one after the other, repetitions written out as often as the numbers say."""
    found: list[Kernel] = []
    for each in program:
        found += unrolled(each.body, numbers) * int(numbers[each.times]) if isinstance(each, Repeat) else [each]
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Steps:
    """Explicit Runge-Kutta steps of the plant for each stretch of constant input.

    Attributes:
        number: of steps. order: 4, the classical step, or 2, the midpoint rule at half the price: enough where
            stretches are short against the plant's fastest time constant.
    """

    number: int = 1
    order: int = 4

    def __post_init__(self) -> None:
        if not isinstance(self.number, int) or isinstance(self.number, bool) or self.number < 1:
            raise SimulationError(f"Steps(number={self.number})", "expected a whole number, at least 1.")
        if self.order not in {2, 4}:
            raise SimulationError(f"Steps(order={self.order})", "expected order 2 or 4.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Flow:
    """The plant between samples.

    Slots: `x<k>` states, `ua<k>` and `ub<k>` what the driven inputs get before and after the delay's fraction of a
    period, `d<k>` disturbances at the sample and `slope<k>` how fast they change, `time` of the sample and `span` until
    the next one; `hit<k>` 1 where end stop k was touched; `y<k>` measured signals as the sensors see them (with
    `noise<k>`, standard normal numbers), `o<k>` outputs.

    Attributes:
        constants: plant parameters `p<k>` → what the others need of them.
        outputs: at a sample, `y<k>` and `o<k>`.
        motion: from one sample to the next.
        pace: at a sample, `pace` of the fastest rate so far. stretch: the longest one, over the period.
        numbers: as in `Step`.
    """

    constants: Kernel
    outputs: Kernel
    motion: Program
    pace: Kernel
    stretch: float
    numbers: Mapping[str, float]


def flow(loop: Fitted, steps: Steps, formulas: Mapping[str, sp.Expr], *, ramps: bool = True) -> Flow:
    """The flow of a loop with a processor.

    Args:
        loop: hardware and wiring. steps: of the plant.
        formulas: disturbances that are given as formulas of `TIME`, and so are no slots.
        ramps: whether the other disturbances change between samples; else there are no slopes.

    Raises:
        SimulationError: bridges with pulses that do not fit each other or the period.
    """
    plant = plant_kernels(loop.wiring, formulas)
    whole = _Plant(loop=loop, kernel=plant.main, steps=steps, ramps=ramps)
    return Flow(
        constants=loop.written(plant.before),
        outputs=loop.finished(_outputs(loop, plant.main)),
        motion=_finished(loop, whole.motion()),
        pace=pace(loop, plant.main, constants=_names(plant.main), disturbances=_count(plant.main, "d")),
        stretch=whole.stretch(),
        numbers={**loop.numbers, STEPS: float(steps.number), **whole.counts()},
    )


def _finished(loop: Fitted, program: Program) -> Program:
    return tuple(
        Repeat(times=each.times, body=_finished(loop, each.body)) if isinstance(each, Repeat) else loop.finished(each)
        for each in program
    )


def plant_kernels(wiring: Wiring, formulas: Mapping[str, sp.Expr]) -> Hoisted:
    """x' (outputs `x'k`), measured values (`yk`) and the plant's outputs (`ok`) of x, u, d, t, hoisted by p."""
    plant = wiring.plant
    given = {s.symbol: formulas[s.name] for s in plant.inputs if s.name in formulas}
    rows = (
        ("x", plant.state_symbols),
        ("u", [s.symbol for s in wiring.driven]),
        ("d", [s.symbol for s in wiring.disturbances if s.name not in formulas]),
        ("p", plant.parameter_symbols),
    )
    names: dict[sp.Symbol, sp.Symbol] = {}
    for stem, row in rows:
        names |= dict(zip(row, numbered(stem, len(row)), strict=True))
    outputs = {f"x'{k}": e for k, e in enumerate(plant.inline(plant.rates))}
    outputs |= {f"y{k}": e for k, e in enumerate(wiring.readings)}
    outputs |= {f"o{k}": e for k, e in enumerate(plant.inline(plant.readouts))}
    outputs = {label: e.xreplace(given).xreplace(names) for label, e in outputs.items()}
    held = numbered("p", len(plant.parameters))
    symbols = [symbol for symbol in names.values() if symbol not in held]
    whole = kernel(f"plant {plant.name}", [*symbols, TIME, *held], outputs, held=held)
    return hoist(whole, [p.name for p in held])


def _outputs(loop: Fitted, plant: Kernel) -> Kernel:
    """`y<k>` with noise and `o<k>` at the present state."""
    w = Assembly("outputs")
    u = {f"u{k}": w.input(f"ub{k}") for k in range(len(loop.wiring.driven))}
    known = u | _constants(w, plant) | {"t": w.input("time")}
    found = w.call(loop.written(row_of(plant, "y")), known)
    for k, noise in enumerate(loop.noises):
        if noise is not None:
            found[f"y{k}"] = found[f"y{k}"] + w.input(f"std{k}") * w.input(f"noise{k}")
    return w.finished(found | w.call(loop.written(row_of(plant, "o")), known))


def _constants(w: Assembly, plant: Kernel) -> dict[str, Scalar]:
    """What the plant's parameters amount to; they have a name of their own, the controller has such numbers too."""
    return {name: w.input(slot) for name, slot in _names(plant).items()}


def _names(plant: Kernel) -> dict[str, str]:
    return {name: f"plant_{name}" for name in plant.inputs if name.startswith(HOISTED)}


def _count(plant: Kernel, stem: str) -> int:
    return sum(name.rstrip("0123456789") == stem for name in plant.inputs)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Plant:
    """What the kernels of the motion are written from."""

    loop: Fitted
    kernel: Kernel
    steps: Steps
    ramps: bool

    def motion(self) -> Program:
        """Runge-Kutta steps over the stretches of constant input of one period."""
        loop = self.loop
        driven = range(len(loop.wiring.driven))
        phases = [("early", "ua"), ("late", "ub")] if loop.split else [("late", "ub")]
        program: list[Kernel | Repeat] = [self._start([name for name, _ in phases])]
        if loop.wiring.plant.discrete:
            program.append(self._leap())
        elif any(bridges(loop)):
            program += self._pulsed([inputs for _, inputs in phases])
        else:
            for length, inputs in phases:
                program += self._steps([(length, [f"{inputs}{k}" for k in driven])])
        return tuple(program)

    def _leap(self) -> Kernel:
        """The one step of a plant in discrete time, then the walls."""
        w = Assembly("plant step")
        x = w.inputs("x", len(self.loop.wiring.plant.states))
        x_new = self.rates(w, x, w.input("time"), [f"ub{k}" for k in range(len(self.loop.wiring.driven))])
        outputs = self._walls(w, x_new)
        return w.finished(outputs | {f"x{k}": value for k, value in enumerate(x_new)})

    def _start(self, lengths: list[str]) -> Kernel:
        """Lengths of the stretches, and nothing hit yet."""
        w, loop = Assembly("start"), self.loop
        span, fraction, number = w.input("span"), w.input("fraction"), w.input(STEPS)
        parts = {"early": span * fraction / number, "late": span / number}
        if loop.split:
            parts["late"] = span * (1.0 - fraction) / number
        outputs = {f"{name}_length": parts[name] for name in lengths}
        outputs |= {f"hit{k}": w.constant(0.0) for k in range(len(loop.walls))}
        return w.finished(outputs | {"now": w.input("time")})

    def _steps(self, stretches: Sequence[tuple[str, Sequence[str]]]) -> Program:
        """The steps of some stretches: those of one after those of the one before."""
        kernels = [self._step(f"{length}_length", [(None, inputs)]) for length, inputs in stretches]
        return tuple(Repeat(times=STEPS, body=(each,)) for each in kernels)

    def _pulsed(self, phases: Sequence[str]) -> Program:
        """Carrier periods cut at the ends of their pulses; the bridge takes a new command at the start of one."""
        loop = self.loop
        rippled = _carriers(loop)[1]
        count = sum(bridge is not None for bridge in bridges(loop)) + 1
        driven = range(len(loop.wiring.driven))
        stretches = [(f"part{i}", [f"pulse{i}_{k}" for k in driven]) for i in range(count)]
        program: list[Kernel | Repeat] = []
        for inputs in phases:
            periods = f"periods_{inputs}"
            program.append(pulses(loop, inputs, periods))
            if rippled:
                program.append(shifted(loop, self.rates, stretches, back=False))
                program.append(Repeat(times=STEPS, body=(self._step("late_length", stretches),)))
                program.append(shifted(loop, self.rates, stretches, back=True))
            else:
                steps = self._steps([(f"part{i}", inputs) for i, (_, inputs) in enumerate(stretches)])
                program.append(Repeat(times=periods, body=steps))
        return tuple(program)

    def stretch(self) -> float:
        """The longest stretch of constant input, over the period."""
        loop, jitter = self.loop, self.loop.hardware.jitter
        longest = max(loop.fraction, 1.0 - loop.fraction) if loop.split else 1.0
        if any(bridges(loop)):
            carriers, rippled = _carriers(loop)
            longest = longest if rippled else 1.0 / carriers
        return longest * (1.0 + (jitter.width / loop.period if jitter else 0.0))

    def counts(self) -> dict[str, float]:
        """Carrier periods in a sampling period, and those before and after the delay's part of it."""
        if not any(bridges(self.loop)):
            return {}
        carriers = _carriers(self.loop)[0]
        early = round(self.loop.fraction * carriers) if self.loop.split else 0
        return {CARRIERS: float(carriers), "periods_ua": float(early), "periods_ub": float(carriers - early)}

    def _step(self, length: str, fields: Sequence[tuple[str | None, Sequence[str]]]) -> Kernel:
        """One Runge-Kutta step with the input held, or with the mean over parts of a carrier period, then the walls."""
        w = Assembly("plant step")
        h, now = w.input(length), w.input("now")
        half = 0.5 * h
        times = [now, now + half, now + h]
        x = w.inputs("x", len(self.loop.wiring.plant.states))

        def rates(at: Sequence[Scalar], stage: int) -> list[Scalar]:
            rows = [self.rates(w, at, times[stage], inputs) for _, inputs in fields]
            return rows[0] if len(rows) == 1 else mean([w.input(str(part)) for part, _ in fields], rows)

        k1 = rates(x, 0)
        k2 = rates(moved(x, half, k1), 1)
        if self.steps.order == 2:
            x_new = moved(x, h, k2)
        else:
            k3 = rates(moved(x, half, k2), 1)
            x_new = combined(x, h / 6.0, (k1, k2, k3, rates(moved(x, h, k3), 2)))
        outputs = self._walls(w, x_new)
        return w.finished(outputs | {f"x{k}": value for k, value in enumerate(x_new)} | {"now": times[2]})

    def rates(self, w: Assembly, x: Sequence[Scalar], time: Scalar, inputs: Sequence[str]) -> list[Scalar]:
        """x' of the plant; `inputs` are slots."""
        d = w.inputs("d", _count(self.kernel, "d"))
        if self.ramps:
            passed = time - w.input("time")
            d = [value + w.input(f"slope{k}") * passed for k, value in enumerate(d)]
        known = roles(x=x, u=[w.input(name) for name in inputs], d=d) | {"t": time} | _constants(w, self.kernel)
        return list(w.call(self.loop.written(row_of(self.kernel, "x'")), known).values())

    def _walls(self, w: Assembly, x: list[Scalar]) -> dict[str, Scalar]:
        """Positions beyond a wall are put back on it, velocities into it turned round; what was hit."""
        found = {}
        for k, (position, velocity) in enumerate(self.loop.walls):
            low, high, bounce = (w.input(f"{name}{k}") for name in ("wall_low", "wall_high", "bounce"))
            above, below = x[position].at_least(high), x[position].at_most(low)
            x[position] = below.where(low, above.where(high, x[position]))
            speed = x[velocity]
            back = (-bounce) * speed
            slowed = above.both(speed.more(0.0)).where(back, speed)
            x[velocity] = below.both(speed.less(0.0)).where(back, slowed)
            found[f"hit{k}"] = above.either(below).where(1.0, w.input(f"hit{k}"))
        return found


def _carriers(loop: Fitted) -> tuple[int, bool]:
    """(carrier periods of a sampling period, whether they are averaged to second order)."""
    found = [bridge for bridge in bridges(loop) if isinstance(bridge, Pwm)]
    frequencies = sorted({bridge.frequency for bridge in found})
    if len(frequencies) > 1 or len({bridge.ripple for bridge in found}) > 1:
        raise SimulationError(
            "bridges with pulses",
            f"they have different carriers ({', '.join(f'{each:g} Hz' for each in frequencies)}), or one is switched "
            "and another has ripple.",
            "Give all of them the same, or some only their mean.",
        )
    count = frequencies[0] * loop.period
    if round(count) < 1 or abs(count - round(count)) > 1e-6 * count:
        raise SimulationError(
            f"Pwm(frequency={frequencies[0]:g}) with pulses",
            f"a period of {loop.period:g} s has {count:g} carrier periods.",
            "Make it a whole number.",
        )
    return round(count), found[0].ripple
