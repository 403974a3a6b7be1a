"""The loop on its processor: every run that starts in a box ends up and stays in a smaller one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from flint import arb, ctx

from ulna.base import Verdict
from ulna.certify.claims import UltimateBound
from ulna.certify.errors import CertifyError
from ulna.certify.processor.certificate_of import sampled_certificate_of
from ulna.certify.processor.linearised import Linearised, linearised
from ulna.certify.processor.period_map import PeriodMap, period_map
from ulna.certify.processor.sampled_rest import resting
from ulna.loop import Loop

BITS = 80
FINER = 1.1
"""Ratio of the smallest box that is not proved to the largest that is, at which the search ends."""
_SLACK = 1 - 1e-6
_ROUNDS, _HALVINGS, _FARTHEST = 30, 24, 1e9


def prove_ultimate(loop: Loop, claim: UltimateBound, inputs: Mapping[str, Any]) -> Verdict:
    """Whether a claim about a loop on its processor is true; see `ulna.certify.prove`."""
    before = ctx.prec
    try:
        ctx.prec = BITS
        return _answer(loop, claim, inputs)
    finally:
        ctx.prec = before


def _answer(loop: Loop, claim: UltimateBound, inputs: Mapping[str, Any]) -> Verdict:
    found, free = period_map(loop, inputs), period_map(loop, inputs, limits=False)
    shown = _shown(loop, found)
    unknown = [name for name in claim.box if name not in shown]
    if unknown:
        raise CertifyError(
            f"the state '{unknown[0]}' of the claim", "the loop has no such state.", f"Known: {', '.join(shown)}."
        )
    text = f"runs of '{found.name}' on its processor that start in a box about rest end up and stay in a smaller one"
    center = resting(loop, free)
    if center is None:
        return Verdict.undecided(text, reason="no rest point of the sampled loop is found near the operating point")
    if beyond := _beyond(loop, free, center):
        return Verdict.refuted(text, **beyond)
    shape = _shape(loop, claim, found, shown)
    linear = linearised(found, center, shape)
    if not isinstance(linear, Linearised):
        return Verdict.undecided(
            text, reason="the sampled loop is not stable at rest", largest_eigenvalue=linear, period=_period(loop)
        )
    best = _searched(linear, shape, wanted=bool(claim.box))
    steps = {s.name: each.half_step for s, each in zip(loop.wiring.measured, found.sensors, strict=True)}
    evidence: dict[str, Any] = {
        "equilibrium": _named(shown, center),
        "half_steps": steps,
        "bound_of_the_linear_loop": _named(shown, linear.driven * linear.scale),
    }
    if best is None or (claim.box and best[0] < 1.0):
        if best is not None:
            evidence["proved_box"] = {name: size * best[0] for name, size in claim.box.items()}
        return Verdict.undecided(text, reason=_why(best), **evidence)
    share, boxes = best
    start = shape * share
    certificate = sampled_certificate_of(
        loop, linear, start + linear.begins * linear.scale, [b * linear.scale for b in boxes], shown
    )
    return Verdict.proved(
        text,
        starts_within={name: v for name, v in _named(shown, start).items() if v},
        stays_within=_named(shown, boxes[0] * linear.scale),
        ends_within=_named(shown, boxes[-1] * linear.scale),
        **evidence,
        certificate=certificate,
    )


def _why(best: tuple[float, list[np.ndarray]] | None) -> str:
    if best is not None:
        return "the linearisation is not proved to hold over what runs from this box may reach"
    return "the steps of the sensors alone may drive the loop beyond where its linearisation is proved to hold"


def _period(loop: Loop) -> float:
    return loop.fit({}).period


def _named(shown: Mapping[str, int], values: np.ndarray) -> dict[str, float]:
    return {name: float(values[place]) for name, place in shown.items()}


def _shown(loop: Loop, found: PeriodMap) -> dict[str, int]:
    """Place by name of the states of plant and controller; what else the processor remembers has no name of its own."""
    n = len(found.states)
    known = dict(zip(found.states, range(n), strict=True))
    for k, signal in enumerate(loop.wiring.memory):
        if f"z{k}" in found.memory:
            known.setdefault(signal.name, n + found.memory.index(f"z{k}"))
    return known


def _shape(loop: Loop, claim: UltimateBound, found: PeriodMap, shown: Mapping[str, int]) -> np.ndarray:
    """(n,) how far each state starts from rest: as asked, else each state of the plant at its range or 1."""
    shape = np.zeros(found.size)
    if claim.box:
        for name, size in claim.box.items():
            shape[shown[name]] = size
        return shape
    for k, state in enumerate(loop.plant.states):
        ends = [abs(float(end)) for end in (state.lower, state.upper) if end is not None]
        shape[k] = max(ends, default=1.0) or 1.0
    return shape


def _beyond(loop: Loop, free: PeriodMap, center: np.ndarray) -> dict[str, Any]:
    """What holding takes beyond the limits, and the limits; empty where it is within."""
    wanted = free.held([arb(v) for v in center.tolist()])
    names = [s.name for s in loop.wiring.driven]
    limits = loop.saturation
    needed = {
        name: float(v.mid())
        for name, v in zip(names, wanted, strict=True)
        if name in limits and (v > limits[name].upper or v < limits[name].lower)
    }
    return {"needed": needed, "limits": {n: (limits[n].lower, limits[n].upper) for n in needed}} if needed else {}


def _searched(linear: Linearised, shape: np.ndarray, *, wanted: bool) -> tuple[float, list[np.ndarray]] | None:
    """The largest share of the shape that is proved, and its boxes: the first holds the run, the last in the end."""
    low, high, share, best = 0.0, math.inf, 1.0, None
    for _ in range(_HALVINGS):
        boxes = _boxes(linear, shape / linear.scale * share)
        if boxes is not None:
            low, best = share, (share, boxes)
        else:
            high = share
        if best is not None and (high <= FINER * low or (wanted and low >= 1.0)):
            break
        share = share / 2 if best is None else share * 2 if math.isinf(high) else math.sqrt(low * high)
    return best


def _boxes(linear: Linearised, start: np.ndarray) -> list[np.ndarray] | None:
    """Boxes, each holding what runs from the start do: always, then in the end, smaller and smaller."""
    begun = linear.begun(start + linear.begins)
    if not np.isfinite(begun).all():
        return None
    away = linear.sums.largest @ begun + linear.driven
    box = 1.02 * away
    for _ in range(_ROUNDS):
        needed = away + linear.sums.total @ linear.rest(box)
        if not np.isfinite(needed).all() or needed.max() > _FARTHEST:
            return None
        if (needed <= _SLACK * box).all():
            break
        box = np.maximum(box, 1.05 * needed)
    else:
        return None
    boxes = [box]
    for _ in range(_ROUNDS):
        smaller = (linear.driven + linear.sums.total @ linear.rest(boxes[-1])) / _SLACK + 1e-30
        if (smaller > 0.99 * boxes[-1]).all():
            break
        boxes.append(smaller)
    return boxes
