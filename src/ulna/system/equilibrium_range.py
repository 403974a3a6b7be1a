"""`equilibria`: all of a system in a box, by linear elimination and interval search for what remains."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, islice
from typing import Any

import numpy as np
import sympy as sp

from ulna.base import PlantError, Verdict
from ulna.symbolic.exact import attempt
from ulna.symbolic.formulas import put_in
from ulna.symbolic.solving import BoxZeros, zeros_in_box
from ulna.system.equilibrium_point import Equilibrium, as_point
from ulna.system.holder import SystemLike, as_system
from ulna.system.linear_reduction import Box, reduced
from ulna.system.many_starts import inside, period, reached_points
from ulna.system.operating_point import operating_point
from ulna.system.system import System

_DIGITS = 15
_SECONDS = 3.0
"""s, for putting in what follows linearly."""
_SEAM = 1e-3
"""rad, by which a turn is moved so that no equilibrium stands at both of its ends."""
_LOOSE = 1e-4
"""Relative distance below which what Newton's method reaches near a double zero counts as one."""
_CHOICES = 4
"""Ways to choose as many equations as unknowns that are tried where there are more."""
_VANISHES = 1e-12
_ROUNDING, _LEAST = 1e-15, 1e-22
"""Relative to the range, and in SI at all, below which a coordinate is 0."""
_MOST_DOUBTFUL = 8
"""Points in undecided boxes beyond which they are taken for parts of a line of equilibria, and one is shown."""
_ONE_SHOWN = "equilibria are not isolated, one is shown"
_LINE = f"a line or surface of them passes through the box: {_ONE_SHOWN}"
_OPEN = "nothing could be decided in parts of the box: take a smaller one (--within) or more time (--seconds)"


@dataclass(frozen=True, slots=True, kw_only=True)
class Equilibria:
    """The equilibria found, in ascending order of the states, and whether they are all there are in the box.

    Attributes:
        points: each with the inputs held.
        complete: on "these are all in the box": proved, or undecided with the boxes that are `unresolved`.
        within: (lower, upper) by the name of each state that was searched or bounded.
        free: states that no rate depends on: each point stands for one with any value of them.

    Examples:
        >>> found = ulna.equilibria(ulna.model("duffing"), within={"x1": (-5, 5)})
        >>> len(found.points), found.complete.holds
        (1, True)
    """

    points: tuple[Equilibrium, ...]
    complete: Verdict
    within: Mapping[str, tuple[float, float]]
    free: tuple[str, ...] = ()

    @property
    def line(self) -> bool:
        """Whether equilibria are not isolated, but for `free`: a line or surface of them passes through one shown."""
        return str(self.complete.evidence.get("reason", "")).endswith(_ONE_SHOWN)

    def __iter__(self) -> Iterator[Equilibrium]:
        return iter(self.points)

    def __len__(self) -> int:
        return len(self.points)


def equilibria(
    system: SystemLike,
    within: Mapping[str, tuple[float, float]] | None = None,
    inputs: Mapping[str, Any] | None = None,
    *,
    seconds: float = 5.0,
) -> Equilibria:
    """Every equilibrium with the states inside their ranges, the inputs held.

    States that follow linearly from others need no range. A state without one, neither in `within` nor in the plant
    file, is searched around what Newton's method reaches from many starts, an angle through one turn.

    Args:
        system: all its parameters need values.
        within: (lower, upper) by state, SI; left out, the range that the plant file declares.
        inputs: constant SI value by input; left out, what the file gives, else zero where that lies in its range, else
            what it is at the operating point.
        seconds: s of search, after which what is left is `unresolved`.

    Raises:
        PlantError: for parameters without value, unknown names, an empty range, or if no range can be found.

    Examples:
        >>> found = ulna.equilibria(ulna.model("cart_pole"), {"th": (-1, 4), "om": (-1, 1)})
        >>> [round(point["th"], 3) for point in found]
        [0.0, 3.142]
    """
    given = as_system(system)
    numeric = given.with_values()
    if numeric.parameters:
        names = ", ".join(p.name for p in numeric.parameters)
        raise PlantError(f"equilibria of '{given.name}'", f"parameters without a value: {names}.", "Give them values.")
    held = _held(given, inputs or {})
    rates = [put_in(r, held) for r in numeric.balances]
    box = _box(given, within or {})
    free = tuple(s.name for s in given.state_symbols if not any(r.has(s) for r in rates))
    sought = [s for s in given.state_symbols if s.name not in free]
    found = attempt(_SECONDS, "elimination", reduced, rates, sought, box)
    equations, rest = found.value or (rates, {})
    unknowns = [s for s in given.state_symbols if s not in rest and s.name not in free]
    box = _surroundings(given, equations, unknowns, box)
    roots, complete = _searched(equations, {x: box[x] for x in unknowns}, seconds)
    points = []
    for root in roots:
        fixed = {sp.Symbol(name, real=True): given_or_zero(given, name) for name in free}
        values = {**root, **{s: sp.N(put_in(e, root), 30) for s, e in rest.items()}, **fixed}
        if all(inside(values[s], box[s]) for s in box if s.name not in free):
            points.append(_point(given, {s: _whole(v, box.get(s)) for s, v in values.items()}, held))
    claim = f"'{given.name}' has {_count(len(points))} {_where(box)}"
    return Equilibria(
        points=tuple(points),
        complete=replace(complete, claim=claim),
        within={s.name: sides for s, sides in box.items()},
        free=free,
    )


def given_or_zero(system: System, name: str) -> sp.Expr:
    """What the file gives for a state or input, else zero."""
    return dict(system.operating_point).get(name, sp.Integer(0))


def _held(system: System, inputs: Mapping[str, Any]) -> dict[sp.Symbol, sp.Expr]:
    asked, held = as_point(system, inputs), {}
    for signal in system.inputs:
        value = asked.get(signal.symbol, given_or_zero(system, signal.name))
        known = signal.symbol in asked or signal.name in dict(system.operating_point)
        if not known and not inside(value, (signal.lower, signal.upper)):
            value = operating_point(system.with_values()).inputs[signal.symbol]
        held[signal.symbol] = value.xreplace(system.values)
    return held


def _box(system: System, within: Mapping[str, tuple[float, float]]) -> dict[sp.Symbol, tuple[float, float]]:
    """What is asked, and for other states the declared range; one-sided ranges leave a side infinite."""
    as_point(system, {name: lower for name, (lower, _) in within.items()})
    box = {}
    for signal in system.states:
        lower, upper = within.get(signal.name, (signal.lower, signal.upper))
        if lower is None and upper is None:
            continue
        sides = (-np.inf if lower is None else float(lower), np.inf if upper is None else float(upper))
        if not sides[0] <= sides[1]:
            raise PlantError(f"equilibria of '{system.name}'", f"the range of {signal.name} is empty: {sides}.")
        box[signal.symbol] = sides
    return box


def _surroundings(
    system: System, equations: list[sp.Expr], unknowns: list[sp.Symbol], box: Box
) -> dict[sp.Symbol, tuple[float, float]]:
    """The box with a finite range for every unknown: around all that Newton's method reaches, an angle's whole turn."""
    endless = (-np.inf, np.inf)
    open_sides = [x for x in unknowns if not np.isfinite(box.get(x, endless)).all()]
    if not open_sides:
        return dict(box)
    start = np.array([float(given_or_zero(system, s.name)) for s in unknowns])
    reached = reached_points(equations, unknowns, start, [box.get(s, endless) for s in unknowns])
    places = reached if len(reached) else start[None, :]
    whole = dict(box)
    for x in open_sides:
        k = unknowns.index(x)
        turn = period(equations, x)
        low, high = float(places[:, k].min()), float(places[:, k].max())
        around = max(high - low, 0.5 * max(abs(low), abs(high)), 1.0 if low == high == 0 else 0.0)
        middle = float(start[k]) + _SEAM
        sides = (middle - turn / 2, middle + turn / 2) if turn else (low - around, high + around)
        asked = box.get(x, endless)
        whole[x] = (max(float(f"{sides[0]:.6g}"), asked[0]), min(float(f"{sides[1]:.6g}"), asked[1]))
    return whole


def _searched(equations: list[sp.Expr], box: Box, seconds: float) -> tuple[list[dict[sp.Symbol, sp.Expr]], Verdict]:
    """The zeros, and whether they are all."""
    claim, unknowns = "all zeros are found", list(box)
    if any(e.is_number and e.is_nonzero for e in equations):
        return [], Verdict.proved(claim, because="a rate is another number than zero everywhere")
    if len(equations) < len(box):
        middle = np.array([(a + b) / 2 for a, b in box.values()])
        one = reached_points(equations, unknowns, middle, list(box.values())) if equations else middle[None, :]
        reason = f"{len(equations)} independent rates for {len(box)} states: {_ONE_SHOWN}"
        return [dict(zip(unknowns, map(sp.Float, p), strict=True)) for p in one[:1]], Verdict.undecided(
            claim, reason=reason
        )
    tried = list(islice(combinations(equations, len(box)), _CHOICES))
    searched = [(tried[0], zeros_in_box(tried[0], box, seconds=seconds / len(tried)))]
    while searched[-1][1].unresolved and len(searched) < len(tried):
        choice = tried[len(searched)]
        searched.append((choice, zeros_in_box(choice, box, seconds=seconds / len(tried))))
    chosen, zeros = searched[-1]
    doubtful = _by_newton(chosen, box, zeros) if zeros.unresolved else []
    line = len(doubtful) > _MOST_DOUBTFUL
    found = [*zeros.values, *(doubtful[:1] if line else doubtful)]
    rest = [e for e in equations if e not in chosen]
    found = [z for z in found if all(abs(sp.N(put_in(e, z), 20)) < _VANISHES for e in rest)]
    complete = zeros.complete(claim)
    if zeros.unresolved:
        complete = replace(complete, evidence={"reason": _LINE if line else _OPEN, **complete.evidence})
    return sorted(found, key=lambda z: [float(v) for v in z.values()]), complete


def _by_newton(equations: Sequence[sp.Expr], box: Box, zeros: BoxZeros) -> list[dict[sp.Symbol, sp.Expr]]:
    """What Newton's method reaches in the boxes that could not be decided, double zeros among them."""
    unknowns = list(box)
    middle = np.array([(a + b) / 2 for a, b in box.values()])
    old = [np.array([float(v) for v in z.values()]) for z in zeros.values]
    new: list[np.ndarray] = []
    for point in reached_points(equations, unknowns, middle, list(box.values())):
        near = _LOOSE * (1 + np.abs(point))
        left = any(
            all(a - d <= p <= b + d for p, d, (a, b) in zip(point, near, piece, strict=True))
            for piece in zeros.unresolved
        )
        if left and not any((np.abs(point - other) <= near).all() for other in (*old, *new)):
            new.append(point)
    return [dict(zip(unknowns, map(sp.Float, p), strict=True)) for p in new]


def _point(system: System, values: Mapping[sp.Symbol, sp.Expr], held: Mapping[sp.Symbol, sp.Expr]) -> Equilibrium:
    return Equilibrium(
        system=system,
        states={s: sp.Rational(str(sp.N(values[s], _DIGITS))) for s in system.state_symbols},
        inputs=held,
        verdict=Verdict.supported(f"'{system.name}' rests there", method="interval arithmetic", digits=_DIGITS),
        parameters=system.values,
    )


def _whole(value: sp.Expr, sides: tuple[float, float] | None) -> sp.Expr:
    """A value, 0 where it is nothing but rounding beside the range that was searched."""
    size = max(map(abs, sides)) if sides and np.isfinite(sides).all() else 1.0
    return sp.Integer(0) if abs(value) < max(_ROUNDING * size, _LEAST) else value


def _count(number: int) -> str:
    return "no equilibrium" if not number else f"{number} equilibri{'um' if number == 1 else 'a'}"


def _where(box: Box) -> str:
    return "with " + ", ".join(f"{a:g} <= {s.name} <= {b:g}" for s, (a, b) in box.items()) if box else "at all"
