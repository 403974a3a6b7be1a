"""How the motion goes on from the surfaces at which its field jumps: across, along, or not to be said."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from ulna.sim.continuous.course import MOMENT, Course

ROUNDING = 1e-12
"""Rates below this part of what they are summed from are zero."""

MOST = 5
"""Surfaces at one instant of which every choice of sides is looked at; of more the one that pivoting finds."""

PIVOTS = 1000
"""Pivots at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ways:
    """What a point on some surfaces allows.

    Attributes:
        guards: which. neutral: those of them that no side moves away from zero to first order.
        found: for each way to go on the side of each guard that is not neutral: −1, 1, or 0 where it is held.
    """

    guards: tuple[int, ...]
    neutral: tuple[int, ...]
    found: tuple[Mapping[int, int], ...]


def ways(at: Course, guards: Sequence[int], leaving: Mapping[int, int]) -> Ways:
    """The ways to go on from a point at which some guards are zero.

    A guard may grow where it has the side 1, fall where it has the side −1, and is held where it keeps its value with a
    jump between those of its two sides.

    Args:
        at: the point. guards: their numbers. leaving: the sides of those that are known to leave.
    """
    field = _Field(at, guards)
    neutral = [k for k, guard in enumerate(guards) if field.neutral[k] and guard not in leaving]
    if len(guards) == 1 and not leaving and field.crossed:
        return Ways(guards=tuple(guards), neutral=(), found=({guards[0]: field.crossed},))
    free = [k for k in range(len(guards)) if k not in neutral]
    fixed = {k: leaving[guard] for k, guard in enumerate(guards) if guard in leaving}
    if len(free) > MOST:
        patterns = _pivoted(field, free, fixed)
    else:
        choices = [(fixed[k],) if k in fixed else (0, 1, -1) for k in free]
        patterns = [dict(zip(free, sides, strict=True)) for sides in product(*choices)]
    strict, weak = [], []
    for pattern in patterns:
        margin = field.margin(pattern, fixed)
        if margin > 0:
            strict.append(pattern)
        elif margin == 0:
            weak.append(pattern)
    # Where a side pushes neither way, to stay and to go on with that side are one motion.
    weak.sort(key=lambda pattern: sum(side != 0 for side in pattern.values()))
    found = strict or weak[:1]
    return Ways(
        guards=tuple(guards),
        neutral=tuple(guards[k] for k in neutral),
        found=tuple({guards[k]: side for k, side in pattern.items()} for pattern in found),
    )


class _Field:
    """The rates of the guards on every side of their surfaces."""

    def __init__(self, at: Course, guards: Sequence[int]) -> None:
        self._at, self._guards = at, guards
        slopes, drift = at.motion.normals(at)
        self._slopes, self._drift = slopes[list(guards)], drift[list(guards)]
        self._size = np.zeros(len(guards))
        self._adding = len(guards) < 2 or at.motion.add_up(tuple(guards))
        self._corners: dict[tuple[int, ...], np.ndarray] = {}
        count = len(guards)
        low = self._corner((-1,) * count)
        steps = [self._corner(tuple(1 if row == k else -1 for row in range(count))) - low for k in range(count)]
        self.matrix = np.stack(steps, axis=1) / 2.0
        self.middle = low + self.matrix.sum(axis=1)
        if not self._adding and count <= MOST:
            for sides in product((-1, 1), repeat=count):
                self._corner(sides)
        rates = np.array(list(self._corners.values()))
        # Nothing is said where a field is not finite.
        self.neutral = np.all(np.abs(rates) <= self.least, axis=0) | ~np.isfinite(rates).all()

    @property
    def crossed(self) -> int:
        """1 or −1 where the first guard moves that way on both sides of its surface, else 0."""
        rates = [rates[0] for rates in self._corners.values()]
        if min(rates) > self.least[0]:
            return 1
        return -1 if max(rates) < -self.least[0] else 0

    @property
    def least(self) -> np.ndarray:
        """Rates up to this are zero."""
        return ROUNDING * self._size

    def _side(self, sides: Sequence[int]) -> Course:
        modes = list(self._at.modes)
        for guard, side in zip(self._guards, sides, strict=True):
            modes[guard] = float(side)
        return replace(self._at, modes=modes, held=())

    def _corner(self, sides: tuple[int, ...]) -> np.ndarray:
        if sides not in self._corners:
            there = self._side(sides)
            rates, _ = there.motion(there, there.time, there.state)
            size = np.abs(self._slopes * rates).sum(axis=1) + np.abs(self._drift)
            self._size = np.maximum(self._size, size)
            here = self._slopes @ rates + self._drift
            soon = self._slopes @ there.motion(there, *self._later)[0] + self._drift
            # Of a rate that is about to change its sign rounding has left either.
            self._corners[sides] = np.where(np.abs(here) <= np.abs(soon - here), soon, here)
        return self._corners[sides]

    @cached_property
    def _later(self) -> tuple[float, np.ndarray]:
        """Time and state a moment later, the same for all sides."""
        at, count = self._at, len(self._guards)
        ends = [self._side([side] * count) for side in (-1, 1)]
        mean = np.mean([end.motion(end, at.time, at.state)[0] for end in ends], axis=0)
        moment = MOMENT * at.span
        return at.time + moment, at.state + moment * mean

    def _rates(self, levels: np.ndarray) -> np.ndarray:
        """The rates with jumps between their sides."""
        if self._adding:
            return self.middle + self.matrix @ levels
        found = np.zeros(len(levels))
        for sides, rates in self._corners.items():
            found += rates * np.prod((1.0 + np.array(sides) * levels) / 2.0)
        return found

    def margin(self, pattern: Mapping[int, int], fixed: Mapping[int, int]) -> int:
        """1 where the motion goes on like this, 0 where it just does, −1 where it does not."""
        held = [k for k, side in pattern.items() if side == 0]
        levels = np.zeros(len(self._guards))
        for k, side in pattern.items():
            levels[k] = side
        if held:
            if len(held) > 1 and not self._adding:
                return -1
            there = self._rates(levels)[held]
            slopes = []
            for k in held:
                one = levels.copy()
                one[k] = 1.0
                slopes.append(self._rates(one)[held] - there)
            matrix = np.stack(slopes, axis=1)
            if np.linalg.matrix_rank(matrix) < len(held):
                return -1
            levels[held] = np.linalg.solve(matrix, -there)
            if np.abs(levels[held]).max() > 1.0 + ROUNDING:
                return -1
        rates = self._rates(levels)
        just = bool(held) and np.abs(levels[held]).max() > 1.0 - ROUNDING
        for k, side in pattern.items():
            if side == 0 or k in fixed:
                continue
            if side * rates[k] < -self.least[k]:
                return -1
            just = just or abs(rates[k]) <= self.least[k]
        return 0 if just else 1


def _pivoted(field: _Field, free: Sequence[int], fixed: Mapping[int, int]) -> list[dict[int, int]]:
    """The one way to go on of jumps that add up, by the least index first (Murty's principal pivoting)."""
    sides = {k: fixed.get(k, 0) for k in free}
    for _ in range(PIVOTS):
        held = [k for k in free if not sides[k]]
        levels = np.zeros(len(field.middle))
        for k in free:
            levels[k] = sides[k]
        if held:
            right = -(field.middle + field.matrix @ levels)[held]
            levels[held] = np.linalg.lstsq(field.matrix[np.ix_(held, held)], right, rcond=None)[0]
        rates = field.middle + field.matrix @ levels
        beyond = (abs(levels[k]) > 1.0 + ROUNDING or sides[k] * rates[k] < -field.least[k] for k in free)
        first = next((k for k, wrong in zip(free, beyond, strict=True) if wrong and k not in fixed), None)
        if first is None:
            return [sides]
        sides[first] = 0 if sides[first] else int(np.sign(levels[first]))
    return []
