"""Faults of a step as instructions: references out of range, late calls, missed samples, an estimator that is lost."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ulna.base import SimulationError
from ulna.loop.fault import Fault
from ulna.loop.fitted import Fitted
from ulna.loop.reaction import Report, commanded
from ulna.loop.rows import roles, row_of
from ulna.loop.watches import Deadline, InnovationLimit
from ulna.loop.wiring import numbered
from ulna.program import Assembly, Kernel, Scalar, to_python
from ulna.symbolic.compiling import kernel
from ulna.system import Signal


def referred(loop: Fitted, w: Assembly, outputs: dict[str, Scalar]) -> list[Scalar]:
    """The references that the controller sees (slots `rn<k>`); `strange` is set where one is out of its range."""
    given = w.inputs("r", len(loop.wiring.references))
    strange: Scalar | None = None
    for k, bounds in enumerate(loop.ranges):
        if bounds is None:
            continue
        low, high = w.input(f"range_low{k}"), w.input(f"range_high{k}")
        good = given[k].at_least(low).both(given[k].at_most(high))
        # The memory begins at 0, which need not lie within the range.
        last = _within(w.input(f"r_old{k}"), low, high)
        wrong = last if bounds.held else given[k].more(high).where(high, given[k].less(low).where(low, last))
        given[k] = outputs[f"rn{k}"] = good.where(given[k], wrong)
        strange = good.negated() if strange is None else strange.either(good.negated())
    if strange is not None:
        outputs["strange"] = strange
    return given


def _within(value: Scalar, low: Scalar, high: Scalar) -> Scalar:
    value = value.less(low).where(low, value)
    return value.more(high).where(high, value)


def seen_references(loop: Fitted, w: Assembly) -> list[Scalar]:
    """The references as the first stage left them."""
    return [w.input(f"r{k}" if bounds is None else f"rn{k}") for k, bounds in enumerate(loop.ranges)]


def overdue(loop: Fitted, w: Assembly) -> dict[str, Scalar]:
    """`overdue`: the call comes too late; the first one never does. A time that is no number is too late."""
    deadline = loop.hardware.deadline
    if deadline is None or deadline.lateness is None:
        return {}
    return {"overdue": w.input("elapsed").at_most(w.input("latest")).negated().both(w.input("begun"))}


def reacted(
    loop: Fitted, w: Assembly, values: list[Scalar], estimates: Mapping[str, Scalar], outputs: dict[str, Scalar],
    good: Scalar | None,
) -> list[Scalar]:  # fmt: skip
    """The commands after the reactions to faults; `outputs` gets counters and the fault `code`.

    What is reacted to first: samples missed in a row, numbers that are not finite, a lost plant, a late call.

    Args:
        loop: with its hardware. w: of the command. values: as computed. estimates: by slot.
        good: whether all numbers are finite; None without a guard.
    """
    hardware = loop.hardware
    missed = w.input("missed") if hardware.told_missed else None
    bad = None if good is None else good.negated()
    late = w.input("overdue") if hardware.told_elapsed else None
    gone = _gone(loop, w, missed, outputs)
    lost = None
    if hardware.innovation is not None:
        lost = _lost(loop, w, hardware.innovation, estimates, outputs, (missed, good))
    strange = w.input("strange") if any(loop.ranges) else None
    bits = {Fault.NOT_FINITE: bad, Fault.MISSED: gone, Fault.LATE: late, Fault.REFERENCE: strange, Fault.LOST: lost}
    outputs["code"] = _code(w, bits)
    # The last one is reacted to first.
    reactions = [
        (late, hardware.deadline),
        (lost, hardware.innovation),
        (bad, hardware.guard),
        (missed, _MISSED),
        (gone, hardware.deadline),
    ]
    for k, signal in enumerate(loop.wiring.driven):
        held = w.input(f"h{k}_0")
        for fault, source in reactions:
            if fault is not None and source is not None and not isinstance(source.reaction, Report):
                safe = commanded(source.reaction, signal.name)
                values[k] = fault.where(held if safe is None else w.constant(safe), values[k])
    return values


_MISSED = Deadline(missed=0)
"""A single missed sample holds the command."""


def _code(w: Assembly, faults: Mapping[Fault, Scalar | None]) -> Scalar:
    """The sum of the bits."""
    total: Scalar | None = None
    for bit, fault in faults.items():
        if fault is not None:
            value = fault.where(float(bit), 0.0)
            total = value if total is None else total + value
    return w.constant(0.0) if total is None else total


def _gone(loop: Fitted, w: Assembly, missed: Scalar | None, outputs: dict[str, Scalar]) -> Scalar | None:
    """Whether more samples in a row were missed than may be."""
    deadline = loop.hardware.deadline
    if missed is None or deadline is None or deadline.missed is None:
        return None
    count = w.input("absent") + 1.0
    gone = missed.both(count.more(float(deadline.missed)))
    # It stops one above the limit: counted forever it would lose its last bit.
    outputs["absent"] = missed.where(gone.where(float(deadline.missed), count), 0.0)
    return gone


def _lost(
    loop: Fitted, w: Assembly, limit: InnovationLimit, estimates: Mapping[str, Scalar], outputs: dict[str, Scalar],
    skips: tuple[Scalar | None, Scalar | None],
) -> Scalar:  # fmt: skip
    """Whether the plant is lost, of counters of samples in a row with large and with small innovations."""
    large: Scalar | None = None
    for value, size in _innovations(loop, w, limit, estimates).values():
        beyond = abs(value).at_most(size).negated()
        large = beyond if large is None else large.either(beyond)
    large = w.constant(0.0) if large is None else large
    astray, calm, lost = w.input("astray"), w.input("calm"), w.input("lost")
    most = float(limit.samples)
    count = large.where(astray.less(most).where(astray + 1.0, astray), 0.0)
    new = lost.either(count.at_least(most))
    found = {"astray": count}
    if limit.resume is not None:
        quiet = lost.both(large.negated()).where(calm + 1.0, 0.0)
        back = quiet.at_least(float(limit.resume))
        new = back.negated().both(new)
        found["calm"] = quiet
    found["lost"] = new
    missed, good = skips
    for name, value in found.items():
        kept = value if good is None else good.where(value, w.input(name))
        outputs[name] = kept if missed is None else missed.where(w.input(name), kept)
    return outputs["lost"]


def _innovations(
    loop: Fitted, w: Assembly, limit: InnovationLimit, estimates: Mapping[str, Scalar]
) -> dict[int, tuple[Scalar, float]]:
    """What each measured value differs from the estimates, of a filter from what was predicted, and how far it may.

    Raises:
        SimulationError: none, or a name that is no measured signal with an estimate of its own.
    """
    wiring = loop.wiring
    if wiring.filter is not None:
        found = {k: w.input(f"innovation{k}") for k in range(len(wiring.filter.measurement))}
    else:
        known = dict(estimates) | roles(y=w.inputs("yn", len(wiring.measured)))
        known |= roles(u=w.inputs("believed", len(wiring.driven)))
        found = {int(name[1:]): value for name, value in w.call(loop.written(_shown(loop)), known).items()}
    names = {k: wiring.measured[k].name for k in found}
    unknown = [name for name in limit.size if name not in names.values()] if isinstance(limit.size, Mapping) else []
    if unknown or not found:
        raise SimulationError(
            f"InnovationLimit(size={limit.size})",
            f"'{unknown[0]}' is no measured signal with an estimate of its own."
            if unknown
            else "the controller estimates nothing of what it measures.",
            f"Known: {', '.join(names.values())}." if names else "Give a compensator with an observer of all states.",
        )
    if isinstance(limit.size, Mapping):
        return {k: (value, float(limit.size[names[k]])) for k, value in found.items() if names[k] in limit.size}
    return {k: (value, float(limit.size)) for k, value in found.items()}


def _shown(loop: Fitted) -> Kernel:
    """Innovations `i<k>` of estimates `e<k>`, measured values `y<k>` and inputs `u<k>`.

    Those of signals whose estimate is no formula of the estimates, or always is the measured value, are left out.
    """
    wiring = loop.wiring
    names = [s.name for s in wiring.estimates]
    e, y, u = (numbered(stem, len(row)) for stem, row in (("e", names), ("y", wiring.measured), ("u", wiring.driven)))
    meaning = {s.symbol: symbol for s, symbol in zip(wiring.driven, u, strict=True)}
    meaning |= {p.symbol: p.si_value for p in wiring.plant.parameters if p.si_value is not None}
    meaning |= {s.symbol: e[place] for s in wiring.plant.states if (place := _place(s, names)) is not None}
    own = {*e, *u}
    found = {}
    for k, (signal, expression) in enumerate(zip(wiring.measured, wiring.readings, strict=True)):
        estimate = e[names.index(f"{signal.name}_hat")] if f"{signal.name}_hat" in names else None
        value = expression.xreplace(meaning) if estimate is None else estimate
        if value.free_symbols <= own:
            found[f"i{k}"] = y[k] - value
    whole = kernel("innovations", [*e, *y, *u], found)
    return whole if not found else _that_move(loop, whole)


def _place(signal: Signal, names: list[str]) -> int | None:
    return next((names.index(label) for label in (f"{signal.name}_hat", signal.name) if label in names), None)


def _that_move(loop: Fitted, shown: Kernel) -> Kernel:
    """Those that differ from 0 at some point: the estimate of an observer of reduced order is the measured value."""
    whole, random = Assembly("innovations"), np.random.default_rng(1)
    estimates = row_of(loop.wiring.controller.main, "e")
    outputs = whole.call(shown, whole.call(estimates))
    joined = whole.finished(outputs)
    evaluate, moving = to_python(joined), set[str]()
    for _ in range(5):
        point = [float(each) for each in random.uniform(0.1, 1.0, len(joined.inputs))]
        try:
            values = evaluate(*point)
        except (ArithmeticError, ValueError):
            continue
        moving |= {
            label
            for label, value in zip(joined.outputs, values, strict=True)
            if not (math.isfinite(value) and abs(value) < 1e-9)
        }
    kept = Assembly("innovations")
    found = kept.call(shown)
    return kept.finished({label: found[label] for label in shown.outputs if label in moving})
