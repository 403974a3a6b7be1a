"""Accessibility of a control-affine plant: the controllability matrix (paper eq. 24) and the distributions G_i."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import sympy as sp

from ulna.base import Verdict
from ulna.geometry.distributions import Distribution
from ulna.geometry.lie import bracket_name, lie_bracket
from ulna.geometry.numeric import NumericRank, NumericStructure
from ulna.geometry.plant_in_numbers import structure_in_numbers
from ulna.geometry.smoothness import require_smooth
from ulna.symbolic.exact import Rank, attempt, generic_rank, lowest_terms, minor_determinant, rank_at
from ulna.system import ControlAffine, System, control_affine, equilibrium

_SECONDS = 1.0
_SECONDS_FOR_BRACKETS = 3.0
_SECONDS_WHERE_NUMBERS_KNOW = 1.0
_SECONDS_PER_ENTRY = 0.15


@dataclass(frozen=True, slots=True, kw_only=True)
class Accessibility:
    """The brackets ad_f^k g_j of a plant and the dimensions of what they span.

    Attributes:
        view: the plant x' = f + g u.
        levels: level k holds the m fields ad_f^k g_1 … ad_f^k g_m, each (n, 1). Levels end with the one where the
            span stops growing: it never grows again after that.
        ranks: generic rank of G_k = span{ad_f^i g_j, i ≤ k}, one for each level.
        ranks_at_point: the same at the operating point.
        point: the operating point, value by state symbol.
        singular: expression at whose zeros the rank can drop: a minor of greatest generic rank, the determinant for
            one input; None without inputs or if it was not found in time.
        cut_short: why further brackets are missing (out of time); empty if none are.
        numbers: the structure by balls at points where brackets are missing: ranks and dimensions are its then.
    """

    view: ControlAffine
    levels: tuple[tuple[sp.ImmutableDenseMatrix, ...], ...]
    ranks: tuple[Rank, ...]
    ranks_at_point: tuple[Rank, ...]
    point: Mapping[sp.Symbol, sp.Expr]
    singular: sp.Expr | None
    cut_short: str = ""
    numbers: NumericStructure | None = None

    @property
    def matrix(self) -> sp.ImmutableDenseMatrix:
        """(n, m·levels) [g_1 … g_m, ad_f g_1 … ad_f g_m, …], for one input the paper's Q (eq. 24)."""
        return _side_by_side([field for level in self.levels for field in level], len(self.view.x))

    @property
    def rank(self) -> int:
        """The generic rank."""
        if self.numbers is not None:
            return self.numbers.rank.value or 0
        return self.ranks[-1].value if self.ranks else 0

    @property
    def rank_at_point(self) -> int | None:
        """The rank at the operating point; None where the fields are not finite there."""
        if self.numbers is not None:
            return self.numbers.rank_at_point.value
        if not self.ranks_at_point:
            return 0
        last = self.ranks_at_point[-1]
        return None if last.point is None or not last.verdict.holds else last.value

    @property
    def dimensions(self) -> tuple[int, ...]:
        """(n,) generic dimensions of G_0 ⊂ G_1 ⊂ … ⊂ G_{n−1}."""
        if self.numbers is not None:
            return tuple(d for d in self.numbers.dimensions if d is not None)
        return _padded([r.value for r in self.ranks], len(self.view.x))

    @property
    def controllable(self) -> Verdict:
        """Whether the controllability matrix has rank n on an open dense set."""
        return _full(self, self.ranks, "generically", self.numbers and self.numbers.rank)

    @property
    def controllable_at_point(self) -> Verdict:
        """Whether the controllability matrix has rank n at the operating point."""
        phrase = equilibrium(self.view.system).phrase
        return _full(self, self.ranks_at_point, phrase, self.numbers and self.numbers.rank_at_point)

    @property
    def indices(self) -> tuple[int, ...]:
        """Controllability (Brunovský) indices, largest first; they add up to the rank."""
        dimensions = (0, *(self.dimensions if self.numbers is not None else [r.value for r in self.ranks]))
        steps = [b - a for a, b in pairwise(dimensions)]
        return tuple(sum(step > j for step in steps) for j in range(steps[0] if steps else 0))

    def distribution(self, level: int) -> Distribution:
        """G_level as a generic basis: the leftmost independent ones of the fields; empty for a negative level."""
        if level < 0 or not self.levels:
            return Distribution(coordinates=self.view.x, fields=())
        level = min(level, len(self.levels) - 1)
        fields = [field for fields in self.levels[: level + 1] for field in fields]
        return Distribution(
            coordinates=self.view.x, fields=tuple(fields[column] for column in self.ranks[level].columns)
        )

    def name_of(self, field: sp.MatrixBase) -> str:
        """`g`, `ad_f g`, `ad_f^2 g2` …: what a field of the levels is called."""
        for k, level in enumerate(self.levels):
            for j, own in enumerate(level):
                if own == field:
                    return bracket_name(k, j, len(level))
        return "a field"


@lru_cache(maxsize=32)
def accessibility(system: System) -> Accessibility:
    """The brackets of a plant with the ranks of what they span, generically and at the operating point.

    Isidori, Nonlinear Control Systems, sections 4.2 and 5.2; brackets with the paper's sign (eq. 19).

    Raises:
        NotAffineError: if the plant is not affine in its inputs.
        UlnaError: if a field is not smooth.

    Examples:
        >>> found = ulna.accessibility(ulna.model("duffing"))
        >>> len(found.levels)
        2
    """
    view = control_affine(system)
    n, here = len(view.x), equilibrium(system)
    point = dict(here.states)
    if not view.u:
        return Accessibility(view=view, levels=(), ranks=(), ranks_at_point=(), point=point, singular=None)
    require_smooth([*view.f, *view.g], f"the brackets of '{system.name}'")
    numbers = _decided(structure_in_numbers(system))
    seconds = _SECONDS_FOR_BRACKETS if numbers is None else _SECONDS_WHERE_NUMBERS_KNOW
    levels = [view.input_fields]
    ranks = [_generic(levels, n)]
    cut_short = ""
    while not cut_short and len(levels) < n and ranks[-1].value < n:
        following = attempt(seconds, f"ad_f^{len(levels)} g", _following, view, levels[-1])
        if following.value is None:
            cut_short = following.reason
            break
        levels.append(following.value)
        ranks.append(_generic(levels, n))
        if ranks[-1].value == ranks[-2].value:
            break
    locals_ = [rank_at(_matrix(levels[: k + 1], n), here.where, seconds=0.5) for k in range(len(levels))]
    return Accessibility(
        view=view,
        levels=tuple(levels),
        ranks=tuple(ranks),
        ranks_at_point=tuple(locals_),
        point=point,
        singular=_singular(levels, ranks[-1], n),
        cut_short=cut_short,
        numbers=numbers if cut_short else None,
    )


def _decided(numbers: NumericStructure | None) -> NumericStructure | None:
    """The structure in numbers where it has all dimensions; else formulas are all there is."""
    return None if numbers is None or None in numbers.dimensions else numbers


def _following(view: ControlAffine, fields: tuple[sp.ImmutableDenseMatrix, ...]) -> tuple[sp.ImmutableDenseMatrix, ...]:
    """The next brackets, entries in lowest terms where that is not longer: unreduced they grow tenfold a level."""

    def short(entry: sp.Expr) -> sp.Expr:
        return min(lowest_terms(entry, seconds=_SECONDS_PER_ENTRY), entry, key=sp.count_ops)

    return tuple(lie_bracket(view.f, field, view.x).applyfunc(short) for field in fields)


def _singular(levels: list[tuple[sp.ImmutableDenseMatrix, ...]], rank: Rank, n: int) -> sp.Expr | None:
    if not rank.value:
        return None
    return attempt(_SECONDS, "minor", minor_determinant, _matrix(levels, n), rank, seconds=_SECONDS).value


def _generic(levels: list[tuple[sp.ImmutableDenseMatrix, ...]], n: int) -> Rank:
    return generic_rank(_matrix(levels, n), seconds=0.5)


def _matrix(levels: list[tuple[sp.ImmutableDenseMatrix, ...]], n: int) -> sp.ImmutableDenseMatrix:
    return _side_by_side([field for level in levels for field in level], n)


def _side_by_side(fields: list[sp.ImmutableDenseMatrix], n: int) -> sp.ImmutableDenseMatrix:
    return sp.ImmutableDenseMatrix.hstack(*fields) if fields else sp.ImmutableDenseMatrix(n, 0, [])


def _padded(values: list[int], length: int) -> tuple[int, ...]:
    last = values[-1] if values else 0
    return tuple(values) + (last,) * (length - len(values))


def _full(found: Accessibility, ranks: tuple[Rank, ...], where: str, numbers: NumericRank | None) -> Verdict:
    n = len(found.view.x)
    claim = f"the controllability matrix has rank {n} {where}"
    if numbers is not None:
        return _full_in_numbers(claim, numbers, n)
    if not ranks:
        return Verdict.refuted(claim, rank=0, reason="there are no inputs")
    last = ranks[-1]
    if last.point is None or not last.verdict.holds:
        return Verdict.undecided(claim, because=last.verdict.claim, **last.verdict.evidence)
    if last.value < n and found.cut_short:
        return Verdict.undecided(claim, rank_so_far=last.value, tried=found.cut_short)
    if last.value < n:
        return Verdict.refuted(claim, rank=last.value, dimensions=found.dimensions)
    return Verdict.proved(claim, rank=n, point=dict(last.point), singular=found.singular)


def _full_in_numbers(claim: str, rank: NumericRank, n: int) -> Verdict:
    """Full rank is proved by one point; less is a no at random points."""
    if rank.value is None or rank.value == n:
        return rank.verdict.restated(claim, rank=rank.value, road="numeric")
    return Verdict.refuted(claim, rank=rank.value, certainty="no larger rank at the points tried", road="numeric")
