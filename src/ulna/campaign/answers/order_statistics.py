"""Exact quantiles of more values than fit into memory: digit by digit, one pass over the values for each digit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

DIGIT = 16
"""Bits of a digit: a number has four of them."""

_SIGN = np.uint64(1 << 63)


@dataclass(slots=True)
class _Search:
    """The order statistics of one column. ranks: the places sought for, those of equal beginnings by these."""

    count: int = 0
    ranks: list[int] = field(default_factory=list)
    beginnings: list[int] = field(default_factory=list)
    counts: dict[int, np.ndarray] = field(default_factory=dict)


def order_statistics(
    blocks: Callable[[], Iterable[Mapping[str, np.ndarray]]], names: Sequence[str], levels: Sequence[float]
) -> dict[str, tuple[np.ndarray, int]]:
    """By name (L,) quantiles, and how many values they were taken of.

    The quantile at level q of N values is the value number ⌈q N⌉ in order (the first for q = 0). NaN is left out; where
    there is no other value the quantiles are NaN.

    Args:
        blocks: gives all values by name, cut in any way; it is called four times.
        names: of the columns.
        levels: (L,) between 0 and 1.
    """
    searches = {name: _Search(beginnings=[0] * len(levels)) for name in names}
    for shift in range(64 - DIGIT, -1, -DIGIT):
        for search in searches.values():
            search.counts = {
                beginning: np.zeros(1 << DIGIT, dtype=np.int64) for beginning in set(search.beginnings) or {0}
            }
        for block in blocks():
            for name, search in searches.items():
                _count(search, _ordered(block[name]), shift)
        for search in searches.values():
            _narrow(search, levels, first=shift == 64 - DIGIT)
    return {
        name: (_numbers(search.beginnings) if search.count else np.full(len(levels), np.nan), search.count)
        for name, search in searches.items()
    }


def _ordered(values: np.ndarray) -> np.ndarray:
    """Whole numbers in the order of the values, without NaN."""
    # Adding 0 makes −0 the same as 0.
    bits = (values[~np.isnan(values)].astype(float) + 0.0).view(np.uint64)
    return np.where(bits & _SIGN, ~bits, bits | _SIGN)


def _numbers(ordered: Sequence[int]) -> np.ndarray:
    bits = np.array(ordered, dtype=np.uint64)
    return np.where(bits & _SIGN, bits ^ _SIGN, ~bits).view(float)


def _count(search: _Search, ordered: np.ndarray, shift: int) -> None:
    digits = (ordered >> np.uint64(shift)) & np.uint64((1 << DIGIT) - 1)
    beginnings = ordered >> np.uint64(shift) >> np.uint64(DIGIT)
    for beginning, counts in search.counts.items():
        # The first digit has nothing before it.
        chosen = digits if shift == 64 - DIGIT else digits[beginnings == beginning]
        np.add.at(counts, chosen, 1)


def _narrow(search: _Search, levels: Sequence[float], *, first: bool) -> None:
    """Find the next digit of every quantile, and its rank among the values that begin alike."""
    if first:
        search.count = int(next(iter(search.counts.values())).sum())
        search.ranks = [max(0, int(np.ceil(level * search.count)) - 1) for level in levels]
    for place, (rank, beginning) in enumerate(zip(search.ranks, search.beginnings, strict=True)):
        below = np.cumsum(search.counts[beginning])
        digit = min(int(np.searchsorted(below, rank, side="right")), (1 << DIGIT) - 1)
        search.ranks[place] = rank - int(below[digit - 1] if digit else 0)
        search.beginnings[place] = beginning << DIGIT | digit
