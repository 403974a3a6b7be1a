"""First stage of a step: read the sensors, advance the states of estimator and controller to this sample."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ulna.loop.discretisation import Euler, ExactHold, RungeKutta4
from ulna.loop.fitted import Fitted
from ulna.loop.kalman import filtered
from ulna.loop.rows import Pair, roles, row_of
from ulna.loop.runge_kutta import combined, moved
from ulna.loop.watching import overdue, referred
from ulna.program import (
    COSTLY,
    HOISTED,
    Assembly,
    Hoisted,
    Kernel,
    Operation,
    Scalar,
    costly_first,
)


def advance(loop: Fitted) -> Kernel:
    """The kernel: measured values, references and memory in, quantised values and new memory out."""
    w = Assembly("advance")
    missed = w.input("missed") if loop.hardware.told_missed else None
    measured = w.inputs("y", len(loop.wiring.measured))
    good = finite(measured) if loop.hardware.guard and measured else None
    outputs: dict[str, Scalar] = {}
    older, newer = w.inputs("yn", len(measured)), []
    for k, before in enumerate(older):
        value = _quantised(loop, w, k, measured[k])
        # A value that is not finite is as good as none.
        value = value if good is None else good.where(value, before)
        newer.append(value if missed is None else missed.where(before, value))
        outputs[f"yn{k}"] = newer[k]
    outputs["begun"] = w.constant(1.0)
    outputs |= overdue(loop, w)
    references = referred(loop, w, outputs)
    outputs["fault"] = w.constant(0.0) if good is None else good.where(0.0, math.nan)
    if loop.wiring.memory:
        _advanced(loop, w, (older, newer), references, (missed, good), outputs)
    return w.finished(outputs)


def finite(values: Sequence[Scalar], largest: float = math.inf) -> Scalar:
    """Whether their sum is below a size: a NaN fails the comparison. What waits for it waits for no more than that."""
    total = list(values)
    while len(total) > 1:
        total = [*(a + b for a, b in zip(total[::2], total[1::2], strict=False)), *total[len(total) & ~1 :]]
    return abs(total[0]).less(largest)


def _quantised(loop: Fitted, w: Assembly, k: int, value: Scalar) -> Scalar:
    sensor = loop.sensors[k]
    if sensor is None:
        return value
    whole = w.call(loop.written(_FLOOR), {"value": value * w.input(f"codes{k}") + 0.5})["floor"]
    value = w.input(f"step{k}") * whole
    high, low = w.input(f"code_high{k}"), w.input(f"code_low{k}")
    value = value.more(high).where(high, value)
    return value.less(low).where(low, value)


def _floor() -> Kernel:
    w = Assembly("floor")
    return w.finished({"floor": w.input("value").apply(Operation.FLOOR)})


_FLOOR = _floor()


def _advanced(
    loop: Fitted,
    w: Assembly,
    samples: Pair,
    newest: Sequence[Scalar],
    skips: tuple[Scalar | None, Scalar | None],
    outputs: dict[str, Scalar],
) -> None:
    """The memory advanced to this sample; at the first one, and where it would not be finite, it stays.

    Args:
        samples: measured values at the older and at this sample. newest: references at this one.
        skips: whether the sample is missed, and whether the measured values are good.
        outputs: gets the memory, and whether it is good, too.
    """
    missed, good = skips
    moves = None if missed is None else missed.negated()
    z, references = w.inputs("z", len(loop.wiring.memory)), (w.inputs("r_old", len(newest)), newest)
    begun = [w.input("begun")] * len(z)
    match loop.rule:
        case None:
            row = _Row(loop, w, "z'", samples, outputs, interpolate=False)
            advanced = row(z, references[0], 0.0)
        case Euler() | RungeKutta4() if loop.wiring.filter is not None:
            # It reads the first sample, too.
            begun[: loop.wiring.observed] = [w.constant(1.0)] * loop.wiring.observed
            advanced = filtered(loop, w, z, samples, references, outputs)
            advanced = _by_trapezoids(loop, w, z, advanced, samples, references, outputs)
        case Euler(substeps=steps, interpolate=interpolate):
            row = _Row(loop, w, "z'", samples, outputs, interpolate=interpolate)
            advanced = _euler(w, row, z, (references[0], references[0]), steps)
        case RungeKutta4(substeps=steps, interpolate=interpolate):
            row = _Row(loop, w, "z'", samples, outputs, interpolate=interpolate)
            advanced = _runge_kutta(w, row, z, references, steps)
        case ExactHold(interpolate=interpolate):
            advanced = _exact(loop, w, z, samples, references, outputs, interpolate=interpolate)
    if loop.hardware.guard:
        good = finite(advanced) if good is None else good.both(finite(advanced))
        moves = good if moves is None else moves.both(good)
        outputs["fault"] = begun[0].where(good.where(0.0, math.nan), outputs["fault"])
    for k, value in enumerate(advanced):
        # Outermost what is the same for all runs: a compiler makes two loops of it.
        outputs[f"z{k}"] = begun[k].where(value if moves is None else moves.where(value, z[k]), z[k])
        if k in loop.frozen:
            outputs[f"kept{k}"] = z[k]


class _Row:
    """A row of the controller's kernel between two samples of y, with u held.

    What is costly and depends on y alone is computed at each sample and kept for the next one.
    """

    def __init__(
        self, loop: Fitted, w: Assembly, stem: str, samples: Pair, outputs: dict[str, Scalar], *, interpolate: bool
    ) -> None:
        wiring = loop.wiring
        self.w, self.samples, self.interpolate = w, samples, interpolate
        self.u = w.inputs("believed", len(wiring.driven))
        fixed = [f"y{k}" for k in range(len(wiring.measured))]
        fixed += [f"{HOISTED}{k}" for k in range(len(wiring.controller.before.outputs))]
        parts = costly_first(row_of(wiring.controller.main, stem), fixed)
        self.parts = Hoisted(before=loop.written(parts.before), main=loop.written(parts.main))
        slots = f"costly_{stem[0]}"
        older, newer = w.inputs(slots, len(parts.before.outputs)), self._costly(samples[1])
        outputs |= {f"{slots}{k}": value for k, value in enumerate(newer)}
        self.known = {0.0: older, 1.0: newer}

    def __call__(self, z: Sequence[Scalar], r: Sequence[Scalar], fraction: float) -> list[Scalar]:
        """The row for states z and references r, this part of a period after the older sample."""
        at = fraction if self.interpolate else 0.0
        y = _between(self.samples, at)
        if at not in self.known:
            self.known[at] = self._costly(y)
        costly = {f"{COSTLY}{k}": value for k, value in enumerate(self.known[at])}
        return list(self.w.call(self.parts.main, costly | roles(z=z, y=y, u=self.u, r=r)).values())

    def _costly(self, y: Sequence[Scalar]) -> list[Scalar]:
        return list(self.w.call(self.parts.before, roles(y=y)).values())


def _between(pair: Pair, fraction: float) -> Sequence[Scalar]:
    older, newer = pair
    if older is newer or fraction == 0.0:
        return older
    if fraction == 1.0:
        return newer
    return [a + fraction * (b - a) for a, b in zip(older, newer, strict=True)]


def _euler(w: Assembly, rates: _Row, z: Sequence[Scalar], r: Pair, steps: int) -> Sequence[Scalar]:
    h = w.input("period") / float(steps)
    for j in range(steps):
        z = moved(z, h, rates(z, _between(r, j / steps), j / steps))
    return z


def _runge_kutta(w: Assembly, rates: _Row, z: Sequence[Scalar], r: Pair, steps: int) -> Sequence[Scalar]:
    h = w.input("period") / float(steps)
    half, sixth = 0.5 * h, h / 6.0
    for j in range(steps):
        at = [(j + c) / steps for c in (0.0, 0.5, 1.0)]
        r_at = [_between(r, c) for c in at]
        k1 = rates(z, r_at[0], at[0])
        k2 = rates(moved(z, half, k1), r_at[1], at[1])
        k3 = rates(moved(z, half, k2), r_at[1], at[1])
        k4 = rates(moved(z, h, k3), r_at[2], at[2])
        z = combined(z, sixth, (k1, k2, k3, k4))
    return z


def _exact(
    loop: Fitted,
    w: Assembly,
    z: Sequence[Scalar],
    samples: Pair,
    r: Pair,
    outputs: dict[str, Scalar],
    *,
    interpolate: bool,
) -> list[Scalar]:
    """Φ ẑ + G₀ w(y_k, u_k) + G₁ w(y_{k+1}, u_k); the law's states by the trapezoidal rule."""
    n = loop.wiring.observed
    injected = _Row(loop, w, "w", samples, outputs, interpolate=interpolate)
    blocks = {"phi": z[:n], "g0": injected(z, r[0], 0.0)}
    if interpolate:
        blocks["g1"] = injected(z, r[1], 1.0)
    z_new: list[Scalar] = []
    for i in range(n):
        value = w.constant(0.0)
        for name, row in blocks.items():
            for j, each in enumerate(row):
                value = w.input(f"{name}_{i}_{j}").fused(each, value)
        z_new.append(value)
    return _by_trapezoids(loop, w, z, z_new, samples, r, outputs)


def _by_trapezoids(
    loop: Fitted,
    w: Assembly,
    z: Sequence[Scalar],
    z_new: list[Scalar],
    samples: Pair,
    r: Pair,
    outputs: dict[str, Scalar],
) -> list[Scalar]:
    """The estimator's new states, and the law's by the trapezoidal rule."""
    own = range(len(z_new), len(z))
    if own:
        h = w.input("period")
        rates = _Row(loop, w, "z'", samples, outputs, interpolate=True)
        k1 = rates(z, r[0], 0.0)
        k2 = rates(z_new + [h.fused(k1[k], z[k]) for k in own], r[1], 1.0)
        return z_new + [(0.5 * h).fused(k1[k] + k2[k], z[k]) for k in own]
    return z_new
