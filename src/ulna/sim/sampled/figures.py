"""Figures of a run, taken along the way: last, least and most of each output, when it settled, and the effort."""

from __future__ import annotations

from ulna.program import Assembly, Kernel, Scalar


def output_figures(count: int) -> Kernel:
    """At a sample: outputs `o<k>`, targets and bands in; `entered` tells whether one came into its band."""
    w = Assembly("figures")
    found: dict[str, Scalar] = {}
    entered: Scalar | None = None
    for k, value in enumerate(w.inputs("o", count)):
        last, least, most = (w.input(f"{name}{k}") for name in ("last", "least", "most"))
        enters = _enters(w, k, value, last)
        entered = enters if entered is None else entered.either(enters)
        found |= {
            f"before{k}": last,
            f"last{k}": value,
            f"least{k}": least.less(value).where(least, value),
            f"most{k}": most.more(value).where(most, value),
        }
    return w.finished(found | {"entered": w.constant(0.0) if entered is None else entered})


def _enters(w: Assembly, k: int, now: Scalar, then: Scalar) -> Scalar:
    target, band = w.input(f"target{k}"), w.input(f"band{k}")
    return abs(now - target).at_most(band).both(abs(then - target).at_most(band).negated())


def entries(count: int) -> Kernel:
    """Where the straight line between two samples enters the band; `settled<k>` keeps the last time."""
    w = Assembly("entries")
    found = {}
    for k in range(count):
        last, before = w.input(f"last{k}"), w.input(f"before{k}")
        target, band = w.input(f"target{k}"), w.input(f"band{k}")
        now, then = abs(last - target), abs(before - target)
        time, earlier = w.input("time"), w.input("earlier")
        crossing = earlier + (band - then) / (now - then) * (time - earlier)
        found[f"settled{k}"] = _enters(w, k, last, before).where(crossing, w.input(f"settled{k}"))
    return w.finished(found)


def effort(count: int, *, split: bool) -> Kernel:
    """Largest |u| and the integral of u² over the period, of what the plant gets (with pulses: of what is asked)."""
    w = Assembly("effort")
    found = {}
    for k in range(count):
        late, peak = w.input(f"ub{k}"), w.input(f"peak{k}")
        square = late * late
        if split:
            early = w.input(f"ua{k}")
            square = w.input("fraction").fused(early * early - square, square)
            peak = abs(early).more(peak).where(abs(early), peak)
        found[f"peak{k}"] = abs(late).more(peak).where(abs(late), peak)
        found[f"square{k}"] = square.fused(w.input("span"), w.input(f"square{k}"))
    return w.finished(found)
