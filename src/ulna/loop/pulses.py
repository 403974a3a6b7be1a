"""Pulses of a bridge within a carrier period, integrated one by one or averaged to second order."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ulna.loop.applied import bridges, pulse
from ulna.loop.fitted import Fitted
from ulna.loop.runge_kutta import mean, moved
from ulna.program import Assembly, Kernel, Scalar

Stretch = tuple[str, Sequence[str]]
"""Slots of a part of a carrier's period, and of the inputs over it."""
Rates = Callable[[Assembly, Sequence[Scalar], Scalar, Sequence[str]], list[Scalar]]
"""x' of (assembly, x, time, slots of the inputs)."""


STEPS = "steps"
"""Name of the number of Runge-Kutta steps: loops that differ in it alone are one program."""
CARRIERS = "carriers"
"""Name of the number of carrier periods in a sampling period, likewise."""


def pulses(loop: Fitted, inputs: str, periods: str) -> Kernel:
    """Parts of a carrier's period between the ends of pulses, their lengths, and every input over each of them.

    Args:
        loop: hardware and wiring. inputs: slots of what is asked of the bridges.
        periods: the number that tells how many carrier periods follow each other with one duty.

    Slots: `part<i>` of the period, `part<i>_length` s of a step in it, `pulse<i>_<k>` input k over it; `late_length`
    s of a step over all periods and `carrier` s of one, for averages.
    """
    w = Assembly("pulses")
    given = w.inputs(inputs, len(loop.wiring.driven))
    cut = {k: pulse(w, k, given[k]) for k, bridge in enumerate(bridges(loop)) if bridge is not None}
    ends = _sorted([part for _, part in cut.values()])
    span, carriers, steps, outputs = w.input("span"), w.input(CARRIERS), w.input(STEPS), {}
    length = span / (carriers * steps)
    for i, (begin, end) in enumerate(zip([0.0, *ends], [*ends, w.constant(1.0)], strict=True)):
        part = end - begin
        outputs |= {f"part{i}": part, f"part{i}_length": length * part}
        for k, value in enumerate(given):
            if k in cut:
                height, share = cut[k]
                value = share.at_least(end).where(height, 0.0)  # noqa: PLW2901 - the input over this part
            outputs[f"pulse{i}_{k}"] = value
    carrier, count = span / carriers, w.input(periods)
    outputs["late_length"] = carrier * count / steps
    outputs["carrier"] = count.more(0.0).where(carrier, 0.0)
    return w.finished(outputs)


def _sorted(values: Sequence[Scalar]) -> list[Scalar]:
    """The values in increasing order."""
    row: list[Scalar] = []
    for value in values:
        rest = value
        for place, smaller in enumerate(row):
            ordered = smaller.at_most(rest)
            row[place], rest = ordered.where(smaller, rest), ordered.where(rest, smaller)
        row.append(rest)
    return row


def shifted(loop: Fitted, rates: Rates, stretches: Sequence[Stretch], *, back: bool) -> Kernel:
    """From the state at the start of a carrier's period to the one without ripple, v = x + T m(v), or back.

    T m is the mean over the period of the integral of f − mean(f), which begins at 0 with the period.
    """
    w = Assembly("ripple put back" if back else "ripple taken out")
    x, carrier, now = w.inputs("x", len(loop.wiring.plant.states)), w.input("carrier"), w.input("now")
    parts = [w.input(name) for name, _ in stretches]

    def ripple(at: Sequence[Scalar]) -> list[Scalar]:
        rows = [rates(w, at, now, inputs) for _, inputs in stretches]
        areas = []
        for average, *values in zip(mean(parts, rows), *rows, strict=True):
            height, area = w.constant(0.0), w.constant(0.0)
            for part, value in zip(parts, values, strict=True):
                rise = part * (value - average)
                area = part.fused(rise.like(0.5).fused(rise, height), area)
                height = height + rise
            areas.append(area)
        return areas

    first = ripple(x)
    # One iteration: without it the way there and back would leave a trace of second order at every sample.
    x_new = moved(x, -carrier, first) if back else moved(x, carrier, ripple(moved(x, carrier, first)))
    return w.finished({f"x{k}": value for k, value in enumerate(x_new)})
