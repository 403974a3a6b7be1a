"""The structure of a plant in numbers: brackets and Lie derivatives at points in ball arithmetic, no formula formed.

Along the flow of the drift, x(t) and what depends on it are Taylor series. With A(t) = ∂f/∂x a field follows
ad_f X = A X − X', a one-form L_f ω = ω' + ω A: a product of series for each bracket (K. Röbenack, J. Dyn. Sys. Meas.
Control 127 (2005)). Whether a number is zero is judged by its ball: one that excludes 0 is certain, whatever the scale
of its row; one that does not counts as zero only if it is zero to half of the working digits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import sympy as sp
from flint import arb, ctx

from ulna.base import Status, Verdict
from ulna.geometry.flow_series import FlowAtPoint
from ulna.geometry.lie import bracket_name
from ulna.symbolic.exact import rank_of_balls
from ulna.system import SystemKernel

SEED = 5039
POINTS = 3
DIGITS = (512, 4096)
"""Working precision in binary digits, the second where the first cannot tell."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NumericRank:
    """A rank at points: `value` is None while undecided."""

    value: int | None
    verdict: Verdict


@dataclass(frozen=True, slots=True, kw_only=True)
class NumericStructure:
    """Ranks and relative degrees of a plant at random points.

    What is at its greatest possible value is proved, as one point shows it; the rest is supported or undecided.

    Attributes:
        dimensions: dimensions of G_0 ⊂ … ⊂ G_{n−1}; None where a level is undecided.
        rank, rank_at_point: the last of them, generically and at the given point.
        dimensions_at_point: as `dimensions`, at the given point.
        commuting: whether all ad_f^i g_j, i < n, commute; a refutation tells which bracket is not zero.
        involutive: whether all G_k, k ≤ n − 2, are; a refutation tells the level, the ranks and the point.
        observability_rank, observability_rank_at_point: rank of dh, dL_f h, …; None without functions.
        degrees: relative degree of each function, None where no input reaches it.
        degrees_known: on these; undecided where a number could not be told from zero.
        decoupling_rank, decoupling_rank_at_point: of the decoupling matrix; None without one.
        degrees_at_point: whether the degrees are the same at the given point, with a regular decoupling matrix.
    """

    dimensions: tuple[int | None, ...]
    rank: NumericRank
    rank_at_point: NumericRank
    dimensions_at_point: tuple[int | None, ...]
    involutive: Verdict
    commuting: Verdict
    observability_rank: NumericRank | None
    observability_rank_at_point: NumericRank | None
    degrees: tuple[int | None, ...]
    degrees_known: Verdict
    decoupling_rank: NumericRank | None
    degrees_at_point: Verdict


def numeric_structure(field: SystemKernel) -> NumericStructure:
    """Controllability, involutivity, observability and relative degrees of a plant in numbers.

    Args:
        field: the plant's kernel, with the operating point.

    Raises:
        UlnaError: for a term without derivatives.
    """
    whole = _structure(field, DIGITS[0])
    return _structure(field, DIGITS[1]) if _doubtful(whole) else whole


def degrees_in_numbers(field: SystemKernel) -> tuple[tuple[int | None, ...], Verdict, NumericRank | None]:
    """Relative degrees, the verdict on them, and the rank of the decoupling matrix: a part of `numeric_structure`."""
    flows = _random_flows(field, DIGITS[0])
    degrees, verdict = _degrees(flows, len(field.functions))
    return degrees, verdict, _decoupling(flows, degrees)


def _doubtful(found: NumericStructure) -> bool:
    verdicts = [found.rank.verdict, found.degrees_known, found.involutive]
    verdicts += [found.observability_rank.verdict] if found.observability_rank else []
    return any(verdict.status is Status.UNDECIDED for verdict in verdicts)


def _structure(field: SystemKernel, digits: int) -> NumericStructure:
    flows = _random_flows(field, digits)
    here = FlowAtPoint(field, _given(field), digits)
    n, functions = len(field.states), len(field.functions)
    dimensions, rank = _controllability(flows, n)
    degrees, known = _degrees(flows, functions)
    seen = _ranked(flows, "forms", n) if functions else None
    return NumericStructure(
        dimensions=dimensions,
        rank=rank,
        rank_at_point=_at_point(here, "fields", n, rank),
        dimensions_at_point=_dimensions_at_point(here, n),
        involutive=_involutive(flows[:2], dimensions),
        commuting=_commuting(flows[:2], n),
        observability_rank=seen,
        observability_rank_at_point=_at_point(here, "forms", n, seen) if seen else None,
        degrees=degrees,
        degrees_known=known,
        decoupling_rank=_decoupling(flows, degrees),
        degrees_at_point=_degrees_at_point(here, degrees),
    )


def _random_flows(field: SystemKernel, digits: int) -> list[FlowAtPoint]:
    """Flows from random points with short coordinates, near 1 and near the operating point."""
    generator = np.random.default_rng(SEED)
    flows = []
    for number in range(2 * POINTS):
        steps = generator.integers(13, 77, len(field.states))
        centre = list(map(_near, _given(field))) if number % 2 else [sp.S.Zero] * len(field.states)
        flow = FlowAtPoint(field, [c + sp.Rational(int(s), 64) for c, s in zip(centre, steps, strict=True)], digits)
        if flow.regular:
            flows.append(flow)
        if len(flows) == POINTS:
            break
    return flows


def _given(field: SystemKernel) -> list[sp.Expr]:
    given = dict(field.point)
    return [given[name] for name in field.states]


def _near(value: sp.Expr) -> sp.Rational:
    """A short number near a coordinate of the operating point, whatever digits that has."""
    return sp.Rational(round(64 * float(value)), 64)


def _of_level(flow: FlowAtPoint, kind: str, level: int) -> Iterator[list[arb]]:
    """All rows up to a level."""
    for k in range(level + 1):
        yield from (flow.fields(k) if kind == "fields" else flow.forms(k))


def _best(flows: Sequence[FlowAtPoint], kind: str, level: int, n: int) -> NumericRank:
    """The greatest rank at the points, as sure as the points agree."""
    found = []
    for flow in flows:
        with ctx.workprec(flow.digits):
            found.append(rank_of_balls(list(_of_level(flow, kind, level)), point=flow.place))
        if found[-1].value == n:
            break
    if not found:
        return NumericRank(value=None, verdict=Verdict.undecided("the rank", tried="no point where all is finite"))
    best = max(found, key=lambda rank: rank.value)
    if best.value == n:
        claim = f"the rank is {n}, as at one point"
        return NumericRank(value=n, verdict=Verdict.proved(claim, point=best.point))
    doubtful = next((rank.verdict for rank in found if not rank.verdict.holds), None)
    if doubtful is not None:
        return NumericRank(value=None, verdict=doubtful)
    verdict = Verdict.supported(f"the rank is {best.value}", points=len(found), seed=SEED, digits=flows[0].digits)
    return NumericRank(value=best.value, verdict=verdict)


def _controllability(flows: Sequence[FlowAtPoint], n: int) -> tuple[tuple[int | None, ...], NumericRank]:
    dimensions: list[int | None] = []
    rank = NumericRank(value=0, verdict=Verdict.proved("there is no input"))
    for level in range(n):
        rank = _best(flows, "fields", level, n)
        dimensions.append(rank.value)
        if rank.value in (None, n) or (level and dimensions[-2] == rank.value):
            break
    return tuple(dimensions + [dimensions[-1]] * (n - len(dimensions))) if dimensions else (), rank


def _ranked(flows: Sequence[FlowAtPoint], kind: str, n: int) -> NumericRank:
    before: int | None = 0
    rank = NumericRank(value=0, verdict=Verdict.proved("there is nothing"))
    for level in range(n):
        rank = _best(flows, kind, level, n)
        if rank.value in (before, None, n):
            break
        before = rank.value
    return rank


def _at_point(here: FlowAtPoint, kind: str, n: int, generic: NumericRank) -> NumericRank:
    """The rank at the operating point, where higher levels may be needed than elsewhere."""
    claim = "the rank at the operating point"
    if not here.regular:
        return NumericRank(value=None, verdict=Verdict.undecided(claim, tried="the plant is not finite there"))
    rank = None
    with ctx.workprec(here.digits):
        for level in range(n):
            rank = rank_of_balls(list(_of_level(here, kind, level)), point=here.place)
            if rank.value == n:
                return NumericRank(value=n, verdict=rank.verdict.restated(claim))
            if rank.value == generic.value:  # more there is nowhere, as sure as that is
                verdict = Verdict.supported(claim, point=here.place, generic=generic.value, digits=here.digits)
                return NumericRank(value=rank.value, verdict=verdict)
    if rank is None:
        return NumericRank(value=0, verdict=Verdict.proved(claim))
    return NumericRank(value=rank.value if rank.verdict.holds else None, verdict=rank.verdict.restated(claim))


def _dimensions_at_point(here: FlowAtPoint, n: int) -> tuple[int | None, ...]:
    """The dimensions of G_0 … G_{n−1} at the operating point; None where a level is undecided."""
    if not here.regular or not here.inputs:
        return (None,) * n
    found: list[int | None] = []
    with ctx.workprec(here.digits):
        for level in range(n):
            rank = rank_of_balls(list(_of_level(here, "fields", level)), point=here.place)
            found.append(rank.value if rank.value == n or rank.verdict.holds else None)
            if rank.value == n:
                break
    return tuple(found + [n] * (n - len(found)))


def _commuting(flows: Sequence[FlowAtPoint], n: int) -> Verdict:
    """Whether the brackets of all ad_f^i g_j, i < n, vanish: the shortest first, as one that does not is enough."""
    claim = "all ad_f^i g_j commute"
    if not flows:
        return Verdict.undecided(claim, tried="no point where all is finite")
    for flow in flows:
        places = sorted(((k, j) for k in range(n) for j in range(flow.inputs)), key=lambda place: place[0])
        with ctx.workprec(flow.digits):
            small = arb(2) ** (-flow.digits // 2)
            for one, other in sorted(combinations(places, 2), key=lambda pair: pair[0][0] + pair[1][0]):
                entries = flow.bracket(one, other)
                if any(not entry.contains(0) for entry in entries):
                    name = f"[{bracket_name(*one, flow.inputs)}, {bracket_name(*other, flow.inputs)}]"
                    return Verdict.refuted(claim, bracket=name, point=flow.place, digits=flow.digits)
                if not all(entry.is_zero() or entry.abs_upper() < small for entry in entries):
                    return Verdict.undecided(claim, tried=f"{flow.digits} binary digits")
    return Verdict.supported(claim, points=len(flows), seed=SEED, digits=flows[0].digits)


def _involutive(flows: Sequence[FlowAtPoint], dimensions: Sequence[int | None]) -> Verdict:
    claim = "all G_k, k <= n - 2, are involutive"
    if not flows or None in dimensions:
        return Verdict.undecided(claim, tried="the dimensions of the G_k")
    n = len(dimensions)
    for flow in flows:
        with ctx.workprec(flow.digits):
            for level in range(max(n - 1, 1)):
                if dimensions[level] == n:
                    break
                own = list(_of_level(flow, "fields", level))
                places = [(k, j) for k in range(level + 1) for j in range(flow.inputs)]
                brackets = [flow.bracket(a, b) for a, b in combinations(places, 2)]
                if not brackets:
                    continue
                rank = rank_of_balls([*own, *brackets], point=flow.place)
                if rank.value > (dimensions[level] or 0):
                    return Verdict.refuted(
                        claim,
                        level=level,
                        rank=dimensions[level],
                        rank_with_brackets=rank.value,
                        point=flow.place,
                        digits=flow.digits,
                    )
                if not rank.verdict.holds:
                    return rank.verdict.restated(claim)
                if level and dimensions[level] == dimensions[level - 1]:
                    break
    return Verdict.supported(claim, points=len(flows), seed=SEED, digits=flows[0].digits)


def _degrees(flows: Sequence[FlowAtPoint], functions: int) -> tuple[tuple[int | None, ...], Verdict]:
    """The relative degrees; None in the tuple where every derivative up to n is zero at all points."""
    claim = "the relative degrees are these"
    if not flows:
        return (None,) * functions, Verdict.undecided(claim, tried="no point where all is finite")
    degrees: list[int | None] = [None] * functions
    for level in range(len(flows[0].place)):
        waiting = [i for i in range(functions) if degrees[i] is None]
        if not waiting or not flows[0].inputs:
            break
        for i in waiting:
            reached = [flow.reached(level, i) for flow in flows]
            if True in reached:
                degrees[i] = level + 1
            elif None in reached:
                tried = f"{flows[0].digits} binary digits: derivative {level + 1} may depend on an input or not"
                return tuple(degrees), Verdict.undecided(claim, tried=tried, output=i + 1)
    evidence = {"points": len(flows), "seed": SEED, "digits": flows[0].digits}
    return tuple(degrees), Verdict.supported(claim, **evidence)


def _decoupling_rows(flow: FlowAtPoint, degrees: Sequence[int | None]) -> list[list[arb]]:
    return [flow.along_inputs(r - 1, i) for i, r in enumerate(degrees) if r is not None]


def _decoupling(flows: Sequence[FlowAtPoint], degrees: Sequence[int | None]) -> NumericRank | None:
    if not flows or None in degrees or not degrees:
        return None
    ranks = []
    for flow in flows:
        with ctx.workprec(flow.digits):
            ranks.append(rank_of_balls(_decoupling_rows(flow, degrees), point=flow.place))
    best = max(ranks, key=lambda rank: rank.value)
    if best.value < len(degrees) and not all(rank.verdict.holds for rank in ranks):
        return NumericRank(value=None, verdict=Verdict.undecided("the rank of the decoupling matrix"))
    return NumericRank(value=best.value, verdict=best.verdict)


def _degrees_at_point(here: FlowAtPoint, degrees: Sequence[int | None]) -> Verdict:
    claim = "the relative degrees hold at the operating point"
    if not here.regular or None in degrees or not degrees:
        return Verdict.undecided(claim, tried="the plant or its degrees at the operating point")
    with ctx.workprec(here.digits):
        rank = rank_of_balls(_decoupling_rows(here, degrees), point=here.place)
    if rank.value == len(degrees):
        return Verdict.supported(claim, rank=rank.value)
    if rank.verdict.status is Status.PROVED:
        return Verdict.refuted(claim, rank=rank.value, outputs=len(degrees))
    return Verdict.undecided(claim, rank=rank.value)
