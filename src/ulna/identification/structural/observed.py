"""What the outputs' derivatives tell of start and parameters at a point: a rank in balls, and the directions unseen.

Lie derivatives dL_f^k h, k < number of unknowns, along the flow of the plant with its parameters as states
(A. Sedoglavic, J. Symbolic Computation 33 (2002)). A rank is certain from below: full at one point, it is full almost
everywhere.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
import sympy as sp
from flint import arb, arb_mat, ctx

from ulna.base import UlnaError, Verdict
from ulna.geometry import FlowAtPoint
from ulna.identification.structural.experiment import CLOCK, SEED, Motion, experiment, on_one_side
from ulna.symbolic.exact import rank_of_balls
from ulna.system import NON_SMOOTH, Parameter, System, given_point, stand_ins, system_kernel

DIGITS = 512
_SIDES = 3
"""Starts of one record of a plant with several smooth pieces: each is seen from its own start, parameters the same."""
_TRIES = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class Observed:
    """The rank of the outputs' derivatives in unknown starts and parameters, at one set of parameters.

    Attributes:
        rank, unknowns: the rank; what full rank would be.
        verdict: on the rank.
        hidden: (k, q) balls, for each direction that no output sees the speed of the unknown parameters along it.
        parameters: where the free parameters stood, by name, exact.
        smooth: whether the plant is one smooth piece.
    """

    rank: int
    unknowns: int
    verdict: Verdict
    hidden: tuple[tuple[arb, ...], ...]
    parameters: Mapping[str, sp.Expr]
    smooth: bool

    def moved(self, column: int) -> bool:
        """Whether some unseen direction changes this parameter."""
        return any(not row[column].contains(0) for row in self.hidden)


def observed(
    system: System,
    free: Sequence[str],
    motion: Motion,
    *,
    start: Mapping[str, sp.Expr] | None = None,
    known: Sequence[str] = (),
    parameters: Mapping[str, sp.Expr] | None = None,
    number: int = 0,
) -> Observed:
    """The rank at random parameters, and at a random start or the given one.

    Args:
        system: the plant; its outputs are what is logged.
        free: names of the unknown parameters.
        motion: how the inputs move.
        start: values of some states at the start; the others are random.
        known: states whose value at the start is known.
        parameters: where the unknown parameters stand; left out, at random.
        number: of the random point.

    Raises:
        UlnaError: where no point is found at which all is finite.
    """
    smooth = not any(
        e.has(*NON_SMOOTH) for e in (*system.rates, *system.readouts, *(d.expression for d in system.definitions))
    )
    unknown = [s.name for s in system.states if s.name not in known]
    sides = 1 if smooth else _SIDES
    size = len(unknown) * sides + len(free)
    levels = len(unknown) + len(free) + 1
    moved = experiment(system, free, motion, levels)
    names = [s.name for s in moved.states]
    columns, shared = [names.index(n) for n in unknown], [names.index(n) for n in free]
    blocks: list[list[list[arb]]] = []
    place: Mapping[str, sp.Expr] = {}
    for place, flow in islice(  # noqa: B007 (the parameters, the same for all flows)
        _flows(system, moved, free, start or {}, parameters, number, smooth=smooth), sides
    ):
        with ctx.workprec(DIGITS):
            blocks.append([row for level in range(levels) for row in flow.forms(level)])
    if not blocks:
        raise UlnaError(
            f"what the outputs of '{system.name}' show of {', '.join(free)}",
            f"no point was found in {_TRIES} random ones where plant and derivatives are finite and real.",
            "Give the parameters values and bounds for which the plant is defined.",
        )
    rows = [
        [e for b in range(sides) for e in ([row[j] for j in columns] if b == k else [arb(0)] * len(columns))]
        + [row[j] for j in shared]
        for k, block in enumerate(blocks)
        for row in block
    ]
    with ctx.workprec(DIGITS):
        rank = rank_of_balls(rows, point={})
        directions = list(_hidden(rows, rank.rows, rank.columns, size, len(free)))
    return Observed(
        rank=rank.value,
        unknowns=size,
        verdict=rank.verdict,
        hidden=tuple(directions),
        parameters=place,
        smooth=smooth,
    )


def _hidden(
    rows: Sequence[Sequence[arb]], chosen: Sequence[int], columns: Sequence[int], size: int, parameters: int
) -> Iterator[tuple[arb, ...]]:
    """The parameters' part of a basis of the null space, from the regular minor."""
    rest = [j for j in range(size) if j not in columns]
    if not rest:
        return
    scales = [max((e.abs_upper() for e in rows[i]), default=arb(1)) for i in chosen]
    solution = None
    if columns:
        minor = arb_mat([[rows[i][j] / s for j in columns] for i, s in zip(chosen, scales, strict=True)])
        sides = arb_mat([[-rows[i][j] / s for j in rest] for i, s in zip(chosen, scales, strict=True)])
        solution = minor.solve(sides)
    for k, j in enumerate(rest):
        vector = [arb(0)] * size
        vector[j] = arb(1)
        for place, column in enumerate(columns):
            vector[column] = solution[place, k] if solution is not None else arb(0)
        part = tuple(vector[size - parameters :])
        if any(not e.contains(0) for e in part):
            yield part


def _flows(
    system: System,
    moved: System,
    free: Sequence[str],
    start: Mapping[str, sp.Expr],
    given: Mapping[str, sp.Expr] | None,
    number: int,
    *,
    smooth: bool,
) -> Iterator[tuple[Mapping[str, sp.Expr], FlowAtPoint]]:
    """Flows from random starts, all with the first parameters that serve; each on a smooth piece of its own."""
    generator = np.random.default_rng([SEED, number])
    numbers = stand_ins(system)
    centres = {s.name: v.xreplace(numbers) for s, v in given_point(system).states.items()}
    nominal = {s.name: v for s, v in numbers.items()}
    seen: set[tuple[sp.Expr, ...]] = set()
    chosen = given
    for attempt in range(_TRIES):
        near = attempt % 2 == 1
        place: dict[str, sp.Expr] = {CLOCK: sp.S.Zero}
        for s in system.states:
            place[s.name] = _random(generator, centres[s.name] if near else sp.S.Zero)
        drawn = {name: _parameter(generator, _of(system, name), nominal[name], near=near) for name in free}
        place |= drawn if chosen is None else chosen
        place |= dict(start)
        there = {sp.Symbol(name, real=True): value for name, value in place.items()}
        piece = moved if smooth else on_one_side(moved, there)
        key = (*piece.rates, *piece.readouts)
        if not smooth and key in seen:
            continue
        flow = FlowAtPoint(system_kernel(piece), [place[s.name] for s in moved.states], DIGITS)
        if flow.regular:
            seen.add(key)
            chosen = chosen or drawn
            yield chosen, flow


def _of(system: System, name: str) -> Parameter:
    return next(p for p in system.parameters if p.name == name)


def _random(generator: np.random.Generator, centre: sp.Expr) -> sp.Rational:
    """A short number near the centre, on either side of it."""
    step = sp.Rational(int(generator.integers(13, 77)), 64)
    return sp.Rational(round(64 * float(centre)), 64) + (step if generator.integers(2) else -step)


def _parameter(generator: np.random.Generator, parameter: Parameter, nominal: sp.Expr, *, near: bool) -> sp.Rational:
    """A positive short number or, near and for one with bounds, one by the parameter's value."""
    step = sp.Rational(int(generator.integers(13, 77)), 64)
    if not (near or parameter.lower is not None or parameter.upper is not None):
        return step
    scale = sp.Rational(str(f"{float(nominal):.3g}")) if nominal else sp.S.One
    return scale * (1 + step / 8)
