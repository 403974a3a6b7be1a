"""A claim over a box of parameters: branch and bound over their values, the equilibrium moving with them."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
import sympy as sp

from ulna.base import Verdict
from ulna.certify.certificate import OVER
from ulna.certify.claims import Over
from ulna.certify.over.part import (
    Family,
    ParameterBox,
    Part,
    all_decay,
    at,
    coefficients_over,
    family_of,
    halves_of,
    middle_of,
    rest_over,
    within_limits,
)
from ulna.certify.region import (
    HALVED,
    LEAF,
    ball,
    certificate_of,
    equilibrium_near,
    in_states,
    limited_loop,
    linear_answer,
    start_of,
)
from ulna.loop import Loop

_SAMPLES, _SEED = 60, 0
_TRIES = 7
"""Sizes of the box that are tried where the whole of it is refuted."""
_THINNEST = sp.Rational(1, 2**20)

Bounds = Mapping[str, tuple[sp.Rational, sp.Rational]]
"""Lowest and highest value by parameter."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Covered:
    """What became of a box of parameters.

    Attributes:
        proved: whether all of it is. splits: its halves as in a tree of boxes. parts: what the leaves rest on.
        stuck: the part where it ended otherwise. looked: how many parts were looked at.
    """

    proved: bool
    splits: str
    parts: tuple[Part, ...]
    stuck: ParameterBox | None
    looked: int


def prove_over(loop: Loop, claim: Over, inputs: Mapping[str, Any], boxes: int) -> Verdict:
    """The claim over a box of parameters; see `prove`."""
    limited = limited_loop(loop, inputs, list(claim.parameters))
    form, bounds = in_states(limited), claim.bounds
    names = [s.name for s in limited.states]
    ranges = ", ".join(f"{name} from {float(low):g} to {float(high):g}" for name, (low, high) in bounds.items())
    text = f"'{limited.name}' is exponentially stable at rest, within its limits, for every {ranges}"
    family, near = family_of(form), start_of(loop, form)
    against = _counterexample(family, bounds, near)
    if against is not None:
        known = {p.name: p.value for p in loop.plant.parameters if p.name in bounds and p.value is not None}
        return Verdict.refuted(text, **against, **_proved_part(family, bounds, known, near, boxes // 2))
    done = cover(family, _box_of(bounds), near, boxes)
    if not done.proved:
        stuck = {} if done.stuck is None else {"stuck": _named(bounds, [m for m, _ in done.stuck])}
        return Verdict.undecided(
            text, reason="some values of the parameters are not decided", parts=done.looked, **stuck
        )
    lows = np.min([part.found.numbers - part.found.reach for part in done.parts], axis=0)
    highs = np.max([part.found.numbers + part.found.reach for part in done.parts], axis=0)
    return Verdict.proved(
        text,
        equilibrium={n: (float(a), float(b)) for n, a, b in zip(names, lows, highs, strict=True)},
        parts=len(done.parts),
        certificate=certificate_of(
            loop,
            family.slopes,
            None,
            theorem=OVER,
            bounds=bounds,
            splits=done.splits,
            pieces=[part.found for part in done.parts],
        ),
    )


def _named(bounds: Bounds, values: Iterable[sp.Rational]) -> dict[str, float]:
    return {name: float(value) for name, value in zip(bounds, values, strict=True)}


def _box_of(bounds: Bounds) -> ParameterBox:
    """Middle and half-width of each parameter."""
    return tuple(((low + high) / 2, (high - low) / 2) for low, high in bounds.values())


def cover(family: Family, box: ParameterBox, near: np.ndarray, boxes: int) -> Covered:
    """Whether at every value of the parameters the loop rests within its limits and is exponentially stable there."""
    looked = 0
    splits: list[str] = []
    parts: list[Part] = []
    stack = [(box, near)]
    while stack:
        part, start = stack.pop()
        looked += 1
        if looked > boxes:
            return Covered(proved=False, splits="", parts=(), stuck=part, looked=looked)
        x = equilibrium_near(family.slopes.at(at(middle_of(part))), start)
        shown, moves = (None, None) if x is None else _part(family, part, x)
        if shown is not None:
            splits.append(LEAF)
            parts.append(shown)
            continue
        axis = _most(part, box, moves)
        if axis is None or part[axis][1] < _THINNEST * box[axis][1]:
            return Covered(proved=False, splits="", parts=(), stuck=part, looked=looked)
        splits.append(f"{HALVED}{axis}")
        stack += reversed([(each, start if x is None else x) for each in halves_of(part, axis)])
    return Covered(proved=True, splits=" ".join(splits), parts=tuple(parts), stuck=None, looked=looked)


def _part(family: Family, box: ParameterBox, x: np.ndarray) -> tuple[Part | None, np.ndarray | None]:
    """What shows the claim on a box, and how much each parameter moves the coefficients where that is known."""
    found = rest_over(family, box, x)
    if found is None:
        return None, None
    enclosed = coefficients_over(family, box, found)
    if enclosed is None:
        return None, None
    coefficients, steps = enclosed
    shown = all_decay(coefficients) and within_limits(family.slopes.at(at(box)), found)
    sizes = np.array([abs(float(c.mid())) for c in coefficients]) + 1e-300
    return Part(box=box, found=found) if shown else None, np.max(steps / sizes[:, None], axis=0)


def _most(part: ParameterBox, whole: ParameterBox, moves: np.ndarray | None) -> int | None:
    """The parameter to halve, the one that moves most; None where none is left."""
    shares = [float(h / w) if h > 0 else 0.0 for (_, h), (_, w) in zip(part, whole, strict=True)]
    if not any(shares):
        return None
    if moves is None or not np.isfinite(moves).all():
        return int(np.argmax(shares))
    # A parameter that does not act on the coefficients may still move the equilibrium.
    return int(np.argmax(np.array(shares) * 1e-3 + moves))


def _points(box: ParameterBox) -> Iterator[ParameterBox]:
    """The middle, the corners, and some at random."""
    yield middle_of(box)
    if len(box) <= 6:
        for signs in itertools.product((-1, 1), repeat=len(box)):
            yield tuple((m + s * h, sp.Integer(0)) for s, (m, h) in zip(signs, box, strict=True))
    for shares in np.random.default_rng(_SEED).uniform(-1.0, 1.0, (_SAMPLES, len(box))):
        yield tuple(
            (m + sp.Rational(round(64 * s), 64) * h, sp.Integer(0)) for s, (m, h) in zip(shares, box, strict=True)
        )


def _counterexample(family: Family, bounds: Bounds, near: np.ndarray) -> dict[str, Any] | None:
    """The worst of some values of the parameters, proved to be bad: unstable there, or holding is beyond a limit."""
    worst: tuple[float, ParameterBox, np.ndarray] | None = None
    start = near
    for k, point in enumerate(_points(_box_of(bounds))):
        slopes = family.slopes.at(at(point))
        x = equilibrium_near(slopes, start)
        if x is None:
            continue
        start = x if k == 0 else start
        if needed := _beyond(family, point, x):
            return {"parameters": _named(bounds, [v for v, _ in point]), "needed": needed}
        real = float(la.eigvals(slopes.numbers(x)).real.max())
        if real > 0 and (worst is None or real > worst[0]):
            worst = (real, point, x)
    if worst is None:
        return None
    _, point, x = worst
    found = rest_over(family, point, x)
    answer = None if found is None else linear_answer(family.slopes.at(at(point)), found)
    if answer is None:
        return None
    return {"parameters": _named(bounds, [v for v, _ in point]), **answer.evidence}


def _beyond(family: Family, point: ParameterBox, x: np.ndarray) -> dict[str, float]:
    """What each limited signal certainly is beyond its limit where the unlimited loop rests."""
    slopes, found = family.slopes.at(at(point)), rest_over(family, point, x)
    if found is None:
        return {}
    n, m = slopes.sizes
    limited, commands = slopes.form.limited, slopes.values(*found.balls)[n : n + m]
    rows = zip(limited.limited, commands, limited.lower, limited.upper, strict=True)
    return {s.name: float(k.mid()) for s, k, low, high in rows if k < ball(low) or k > ball(high)}


def _proved_part(
    family: Family, bounds: Bounds, known: Mapping[str, sp.Expr], near: np.ndarray, boxes: int
) -> dict[str, Any]:
    """The largest box around the known values, of the shape of the whole, that is proved; empty where none is."""
    left, low, high, best = boxes, sp.Integer(0), sp.Integer(1), None
    middle = {n: min(max(sp.Rational(known[n]), a), b) if n in known else (a + b) / 2 for n, (a, b) in bounds.items()}
    for _ in range(_TRIES):
        share = (low + high) / 2
        part = {n: tuple(middle[n] + share * (end - middle[n]) for end in ends) for n, ends in bounds.items()}
        if left <= 0:
            break
        done = cover(family, _box_of(part), near, min(left, boxes // 3))
        left -= done.looked
        if done.proved:
            low, best = share, part
        else:
            high = share
    return {} if best is None else {"proved_within": {n: (float(a), float(b)) for n, (a, b) in best.items()}}
