"""Second stage of a step: the law, anti-windup, limits, guard, and the delay line to the drive."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ulna.loop.advance import finite
from ulna.loop.fitted import Fitted
from ulna.loop.rows import roles, row_of
from ulna.loop.watching import reacted, seen_references
from ulna.program import Assembly, Kernel, Scalar


def command(loop: Fitted) -> Kernel:
    """The kernel: memory and quantised values in, estimates, commands and what the drive gets out."""
    w, wiring = Assembly("command"), loop.wiring
    z, y = w.inputs("z", len(wiring.memory)), w.inputs("yn", len(wiring.measured))
    u, r = w.inputs("believed", len(wiring.driven)), seen_references(loop, w)
    outputs: dict[str, Scalar] = {}
    computed = _commanded(loop, w, (z, y, u, r), outputs)
    estimates = w.call(loop.written(row_of(wiring.controller.main, "e")), roles(z=z, y=y, u=u, r=r))
    outputs |= estimates
    good = _good(loop, w, computed)
    for k, value in enumerate(reacted(loop, w, computed, estimates, outputs, good)):
        outputs[f"c{k}"] = value
        outputs |= _delayed(loop, w, k, _limited(loop, w, k, value))
    outputs["fault"] = w.input("fault") if good is None else good.where(0.0, math.nan)
    outputs |= {f"r_old{k}": value for k, value in enumerate(r)}
    return w.finished(outputs)


def _commanded(loop: Fitted, w: Assembly, rows: tuple[list[Scalar], ...], outputs: dict[str, Scalar]) -> list[Scalar]:
    """The commands; integrals whose step pushed a saturated command farther out are put back."""
    z, y, u, r = rows
    kernel = loop.written(row_of(loop.wiring.controller.main, "c"))
    commands = list(w.call(kernel, roles(z=z, y=y, u=u, r=r)).values())
    if not loop.frozen:
        return commands
    kept = list(z)
    for k in loop.frozen:
        kept[k] = w.input(f"kept{k}")
    others = list(w.call(kernel, roles(z=kept, y=y, u=u, r=r)).values())
    freezes = _excess(loop, w, commands).more(_excess(loop, w, others))
    for k in loop.frozen:
        z[k] = outputs[f"z{k}"] = freezes.where(kept[k], z[k])
    return [freezes.where(b, a) for a, b in zip(commands, others, strict=True)]


def _excess(loop: Fitted, w: Assembly, commands: Sequence[Scalar]) -> Scalar:
    """Sum over the inputs of how far a command lies outside its limits."""
    total: Scalar | None = None
    for k, value in enumerate(commands):
        if loop.saturations[k] is not None:
            above, below = value - w.input(f"upper{k}"), w.input(f"lower{k}") - value
            beyond = below.more(0.0).where(below, above.more(0.0).where(above, 0.0))
            total = beyond if total is None else total + beyond
    return w.constant(0.0) if total is None else total


def _good(loop: Fitted, w: Assembly, commands: Sequence[Scalar]) -> Scalar | None:
    """Whether every number of the sample is finite, and no command too large; None without a guard."""
    guard = loop.hardware.guard
    if guard is None:
        return None
    good = w.input("fault").equals(0.0)
    for value in commands:
        good = good.both(finite([value], guard.largest))
    return good


def _limited(loop: Fitted, w: Assembly, k: int, value: Scalar) -> Scalar:
    """Slew limit, then saturation."""
    if loop.slews[k] is not None:
        before, change = w.input(f"h{k}_0"), w.input(f"change{k}")
        value = value.at_most(before + change).where(value, before + change)
        value = value.at_least(before - change).where(value, before - change)
    if loop.saturations[k] is not None:
        upper, lower = w.input(f"upper{k}"), w.input(f"lower{k}")
        value = value.at_most(upper).where(value, upper)
        value = value.at_least(lower).where(value, lower)
    return value


def _delayed(loop: Fitted, w: Assembly, k: int, wanted: Scalar) -> dict[str, Scalar]:
    """h_0 is the newest limited command, h_j the one j samples older; the drive gets h_m, before that h_{m+1}."""
    m = loop.whole_delay
    row = [wanted, *(w.input(f"h{k}_{j}") for j in range(m + loop.split))]
    found = {f"h{k}_{j}": value for j, value in enumerate(row)}
    late, early = row[m], row[m + loop.split]
    believed = late + w.input("fraction") * (early - late) if loop.split else late
    return found | {f"late{k}": late, f"early{k}": early, f"believed{k}": believed}
