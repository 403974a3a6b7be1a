"""`prove`: the answer to a claim about a loop, with a certificate where it is proved."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy as sp

from ulna.base import Verdict
from ulna.certify.cascade import NotByThisTheoremError, cascade, worded
from ulna.certify.certificate import CASCADE, THEOREM
from ulna.certify.claims import Claim, GloballyStable, Over, Region, StableWithin, UltimateBound
from ulna.certify.errors import CertifyError
from ulna.certify.over import prove_over
from ulna.certify.processor import prove_ultimate
from ulna.certify.region import (
    Attempt,
    Candidate,
    Form,
    Limited,
    Rest,
    Slopes,
    attempt,
    candidates,
    certificate_of,
    comes_back,
    form_of,
    holding,
    in_states,
    inside,
    limited_loop,
    linear_answer,
    moved,
    rest,
    slopes_of,
    start_of,
)
from ulna.loop import Loop

BOXES = 60_000
"""That a search may look at."""
FINER = 1.05
"""Ratio of the smallest level not proved to the largest proved one at which the search for the level ends."""
_FIRST = 0.97
"""Of the level that samples allow, what is tried first."""
_TRIED = 3
"""Quadratic forms that are tried in earnest."""


def prove(loop: Loop, claim: Claim, *, inputs: Mapping[str, Any] | None = None, boxes: int = BOXES) -> Verdict:
    """Whether a claim about a continuous loop within its limits is true, proved in exact and ball arithmetic.

    A region or a box: V = (ζ − ζ*)ᵀ P (ζ − ζ*) with P from a Lyapunov equation, in coordinates ζ in which the loop is
    most nearly linear. Branch and bound shows that the loop is defined and V falls in one of its level sets, limits of
    the inputs included. So every run that starts in the level set stays in it and converges. Everywhere: the loop
    without limits is a linear part that errors, which decay by themselves, disturb at most in proportion to its size.
    Over parameters: Kharitonov's test of the characteristic polynomial at the equilibrium as it moves, on boxes of
    their values. docs/proof.md says more.

    Args:
        loop: without a processor; its saturation counts.
        claim: `Region()`, `StableWithin(box={...})`, `GloballyStable()` or `Over(parameters={...})`.
        inputs: SI values at which references and disturbances are held, by name; 0 where left out.
        boxes: how many the search may look at: the same answer on every machine. A part of a box of parameters counts
            as 20. The box of `UltimateBound` is not cut.

    Returns:
        Proved with a `certificate` (and `half_axes` of the ellipsoid, `level`, `boxes`; of a global claim `growth`,
        `decay_rates` and a `bound` of every run; over parameters the range of the `equilibrium`); refuted with the
        eigenvalue, the signal that holding needs beyond its limit, or a run that does not converge; undecided with how
        far it came.

    Raises:
        CertifyError: a loop that the theorem does not speak of, names that are unknown.

    Reference:
        H. K. Khalil, "Nonlinear Systems", 3rd ed., theorem 4.10; W. Tucker, "Validated Numerics", 2011, chapter 5.

    Examples:
        >>> law = ulna.state_feedback("duffing", [-1, -2])
        >>> print(ulna.prove(ulna.close_loop("duffing", law), ulna.GloballyStable()))
        proved: all runs of 'closed loop of Duffing oscillator with force' converge to one equilibrium, which is stable
    """
    if isinstance(claim, Over):
        return prove_over(loop, claim, inputs or {}, boxes // 20)
    if isinstance(claim, UltimateBound):
        return prove_ultimate(loop, claim, inputs or {})
    limited = limited_loop(loop, inputs or {})
    _check_names(limited, claim)
    form = form_of(loop, limited)
    if isinstance(claim, StableWithin) and not comes_back(form):
        form = in_states(limited)
    slopes = slopes_of(form)
    near = start_of(loop, form)
    found = rest(slopes, near)
    text = _text(limited, claim)
    if found is None:
        return _without_equilibrium(slopes, near, text)
    unstable = linear_answer(slopes, found)
    if unstable is not None:
        return unstable.restated(text)
    if isinstance(claim, GloballyStable):
        return _everywhere(loop, slopes, found, text)
    sizes = _sizes(slopes, found, claim)
    tried = candidates(slopes, found, sizes)
    if not tried:
        return Verdict.undecided(text, reason="the linearisation is not asymptotically stable")
    if isinstance(claim, StableWithin):
        best, least = _within(slopes, found, claim, tried[:_TRIED], boxes)
    else:
        best, least = _widest(slopes, found, tried[:_TRIED], boxes), {}
    if best is None:
        return _open(slopes, found, claim, text, least)
    return _proved(loop, slopes, found, claim, text, best)


_Best = tuple[Candidate, sp.Rational, Attempt]
"""A form, a level, and what shows that V falls there."""


def _within(
    slopes: Slopes, found: Rest, claim: StableWithin, tried: list[Candidate], boxes: int
) -> tuple[_Best | None, dict[str, Any]]:
    """The first form with a level set that holds the box and is proved; where the last one stuck."""
    least: dict[str, Any] = {}
    sides = {name: _exactly(size) for name, size in claim.box.items()}
    for each in tried:
        level = _level_of(each.P, slopes, found, claim)
        if inside(slopes.form, found, each.P, level, sides):
            done = attempt(slopes, found, each.P, level, boxes=boxes // len(tried))
            if done.proved:
                return (each, level, done), {}
            least = _stuck(slopes.form, done)
    return None, least


def _widest(slopes: Slopes, found: Rest, tried: list[Candidate], boxes: int) -> _Best | None:
    """The form and level of the largest ellipsoid that is proved; half of the boxes are the first form's."""
    best: _Best | None = None
    for k, each in enumerate(tried):
        level, done = _largest(slopes, found, each, boxes // 2 if k == 0 else boxes // 2 // (len(tried) - 1))
        if done is not None and (best is None or _volume(each.P, level) > _volume(best[0].P, best[1])):
            best = (each, level, done)
    return best


def _text(limited: Limited, claim: Region | StableWithin | GloballyStable) -> str:
    if isinstance(claim, GloballyStable):
        return f"all runs of '{limited.name}' converge to one equilibrium, which is stable"
    if isinstance(claim, Region):
        return f"runs of '{limited.name}' that start in an ellipsoid about the equilibrium converge to it"
    sides = ", ".join(f"{name} ± {size:g}" for name, size in claim.box.items())
    return f"runs of '{limited.name}' that start within {sides} of the equilibrium converge to it"


def _check_names(limited: Limited, claim: Region | StableWithin | GloballyStable) -> None:
    names = [s.name for s in limited.states]
    given = {} if isinstance(claim, GloballyStable) else claim.scale if isinstance(claim, Region) else claim.box
    unknown = [name for name in given if name not in names]
    if unknown:
        raise CertifyError(
            f"the state '{unknown[0]}' of the claim", "the loop has no such state.", f"Known: {', '.join(names)}."
        )


def _without_equilibrium(slopes: Slopes, near: np.ndarray, text: str) -> Verdict:
    needed = holding(slopes, near) if slopes.form.commands else None
    if needed:
        own = slopes.form.limited
        limits = {
            symbol.name: (float(low), float(high))
            for symbol, low, high in zip(own.limited, own.lower, own.upper, strict=True)
        }
        return Verdict.refuted(text, needed=needed, limits={name: limits[name] for name in needed})
    return Verdict.undecided(text, reason="no isolated equilibrium is found near the operating point")


def _sizes(slopes: Slopes, found: Rest, claim: Region | StableWithin) -> np.ndarray:
    """(n,) where each coordinate is far off: what the states' sizes make of it.

    A state is far off as told, at its range, else at 1; an estimate as what it estimates.
    """
    form = slopes.form
    told = dict(claim.scale) if isinstance(claim, Region) else {n: s for n, s in claim.box.items() if s > 0}
    states = form.limited.states
    ranges = {
        s.name: float(max(abs(s.lower), abs(s.upper))) for s in states if s.lower is not None and s.upper is not None
    }
    sizes = []
    for state in states:
        names = (state.name, state.name.removesuffix("_hat"))
        sizes.append(next((table[n] for table in (told, ranges) for n in names if table.get(n)), 1.0))
    at = dict(zip(form.symbols, found.center, strict=True))
    own = {s: e.xreplace(at) for s, e in zip(form.limited.symbols, form.inverse, strict=True)}
    slope = np.abs(np.array(sp.Matrix(form.forward).jacobian(list(form.limited.symbols)).xreplace(own), dtype=float))
    moved = slope @ np.array(sizes)
    return np.where(np.isfinite(moved) & (moved > 0), moved, 1.0)


def _level_of(P: sp.Matrix, slopes: Slopes, found: Rest, claim: StableWithin) -> sp.Rational:
    """A level whose set contains the box, as many samples of it and its corners see it, with 2 % to spare."""
    form = slopes.form
    names = [s.name for s in form.limited.states]
    rest = moved(form, found.numbers[:, None], back=True)
    places, half = [names.index(name) for name in claim.box], np.array(list(claim.box.values()))
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=len(places)))).T
    inside = np.random.default_rng(0).uniform(-1.0, 1.0, (len(places), 4000))
    # Samples on the faces, where V is largest.
    inside[np.random.default_rng(1).integers(len(places), size=2000), np.arange(2000)] = 1.0
    points = np.repeat(rest, corners.shape[1] + inside.shape[1], axis=1)
    points[places] += half[:, None] * np.hstack([corners, inside])
    d = moved(form, points) - found.numbers[:, None]
    top = float(np.max(np.einsum("ij,ij->j", d, np.array(P.tolist(), dtype=float) @ d)))
    return sp.Rational(max(1.02 * top, 1e-12))


def _exactly(value: float) -> sp.Rational:
    return sp.Rational(str(value))


def _largest(slopes: Slopes, found: Rest, candidate: Candidate, boxes: int) -> tuple[sp.Rational, Attempt | None]:
    """The largest level that is proved, by halving on a logarithmic scale below what samples allow."""
    low, high, left = 0.0, candidate.limit, boxes
    best: Attempt | None = None
    level = _FIRST * high
    while left > 0 and high > FINER * low and level > candidate.limit * 1e-18:
        # One that takes more boxes than that counts as not proved.
        done = attempt(slopes, found, candidate.P, sp.Rational(level), boxes=min(left, boxes // 2))
        left -= done.boxes
        if done.proved:
            low, best = level, done
        else:
            high = level
        level = math.sqrt(low * high) if low else level / 4
    return sp.Rational(low), best


def _volume(P: sp.Matrix, level: sp.Rational) -> float:
    _, determinant = np.linalg.slogdet(np.array(P.tolist(), dtype=float))
    return float(P.shape[0] / 2 * np.log(float(level)) - determinant / 2)


def _stuck(form: Form, done: Attempt) -> dict[str, Any]:
    if done.stuck is None:
        return {}
    middle, half = done.stuck
    return {
        "boxes": done.boxes,
        "stuck": {s.name: (float(c), float(h)) for s, c, h in zip(form.symbols, middle, half, strict=True)},
    }


def _open(slopes: Slopes, found: Rest, claim: Region | StableWithin, text: str, evidence: dict[str, Any]) -> Verdict:
    """Refuted where a run from a corner of the box is seen to stay away; undecided otherwise."""
    if isinstance(claim, StableWithin):
        corner = _run_away(slopes, found, claim)
        if corner is not None:
            return Verdict.refuted(text, **evidence, start=corner[0], end=corner[1], after=corner[2])
    return Verdict.undecided(text, reason="no quadratic form that was tried reaches so far", **evidence)


def _run_away(
    slopes: Slopes, found: Rest, claim: StableWithin
) -> tuple[dict[str, float], dict[str, float], float] | None:
    """A corner of the box, where its run is after long, and when: ten times farther off, or at rest elsewhere.

    One that is on its way still says nothing. By SciPy's LSODA, to 1e-9.
    """
    from scipy.integrate import solve_ivp

    form = slopes.form
    names = [s.name for s in form.limited.states]
    slowest = -np.linalg.eigvals(slopes.numbers(found.numbers)).real.max()
    horizon, rest = 60.0 / slowest, moved(form, found.numbers[:, None], back=True)[:, 0]
    places = [names.index(name) for name in claim.box]
    for signs in itertools.product((-1, 1), repeat=len(places)):
        start = rest.copy()
        start[places] += [sign * size for sign, size in zip(signs, claim.box.values(), strict=True)]
        run = solve_ivp(
            lambda _, z: slopes.limited_rates(z[:, None])[:, 0],
            (0.0, horizon),
            moved(form, start[:, None])[:, 0],
            method="LSODA",
            rtol=1e-9,
            atol=1e-12,
        )
        last = moved(form, run.y[:, -1:], back=True)[:, 0]
        way, off = np.abs(start - rest).max(), np.abs(last - rest).max()
        speed = np.abs(slopes.limited_rates(run.y[:, -1:])[:, 0]) / (1.0 + np.abs(run.y[:, -1]))
        if not np.isfinite(off) or off > 10.0 * way or (off > 0.01 * way and speed.max() < 1e-9 * slowest):
            end = dict(zip(names, last.tolist(), strict=True))
            return dict(zip(names, start.tolist(), strict=True)), end, float(run.t[-1])
    return None


def _proved(
    loop: Loop,
    slopes: Slopes,
    found: Rest,
    claim: Region | StableWithin,
    text: str,
    best: _Best,
) -> Verdict:
    candidate, level, done = best
    certificate = certificate_of(
        loop,
        slopes,
        found,
        theorem=THEOREM,
        P=candidate.P,
        level=str(level),
        tree=done.tree,
        box={n: str(_exactly(s)) for n, s in claim.box.items()} if isinstance(claim, StableWithin) else {},
    )
    return Verdict.proved(
        text,
        equilibrium=_resting(slopes, found),
        half_axes=dict(
            zip(_names(slopes), _reach(slopes.form, found, candidate.P, float(level)).tolist(), strict=True)
        ),
        level=float(level),
        sampled_limit=candidate.limit,
        boxes=done.boxes,
        certificate=certificate,
    )


def _everywhere(loop: Loop, slopes: Slopes, found: Rest, text: str) -> Verdict:
    """Whether the loop is globally stable, by the theorem on cascades."""
    form = slopes.form
    if not comes_back(form):
        return Verdict.undecided(text, reason="the inverse of its coordinates is not shown to be one everywhere")
    try:
        shown = cascade(slopes)
    except NotByThisTheoremError as problem:
        return Verdict.undecided(text, reason=f"not by this theorem: {problem}")
    growth = {
        f"∂({symbol}')/∂{error}": worded(bound)
        for symbol, row in zip(form.symbols, shown.growth, strict=False)
        for error, bound in zip(form.symbols[form.outer :], row, strict=True)
        if bound
    }
    return Verdict.proved(
        text,
        equilibrium=_resting(slopes, found),
        decay_rates=tuple(float(rate) for rate in shown.rates),
        **({"growth": growth} if growth else {}),
        **shown.reach(slopes, found.numbers),
        certificate=certificate_of(loop, slopes, found, theorem=CASCADE, P=shown.P, rates=shown.rates),
    )


def _names(slopes: Slopes) -> list[str]:
    return [s.name for s in slopes.form.limited.states]


def _resting(slopes: Slopes, found: Rest) -> dict[str, float]:
    """The equilibrium by state."""
    point = moved(slopes.form, found.numbers[:, None], back=True)
    return dict(zip(_names(slopes), point[:, 0].tolist(), strict=True))


def _reach(form: Form, found: Rest, P: sp.Matrix, level: float) -> np.ndarray:
    """(n,) how far each state itself goes in the level set, of many points on its edge."""
    directions = np.random.default_rng(0).normal(size=(P.shape[0], 4000))
    directions = np.hstack([directions, np.eye(P.shape[0])])
    numbers = np.array(P.tolist(), dtype=float)
    edge = np.linalg.inv(np.linalg.cholesky(numbers)).T @ (directions / np.linalg.norm(directions, axis=0))
    points = moved(form, found.numbers[:, None] + np.sqrt(level) * edge, back=True)
    middle = moved(form, found.numbers[:, None], back=True)
    return np.nanmax(np.abs(points - middle), axis=1)
