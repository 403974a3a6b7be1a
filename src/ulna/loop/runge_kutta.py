"""The sums of explicit Runge-Kutta steps."""

from __future__ import annotations

from collections.abc import Sequence

from ulna.program import Scalar

Row = Sequence[Scalar]


def moved(x: Row, h: Scalar, rates: Row) -> list[Scalar]:
    """x + h x'."""
    return [h.fused(b, a) for a, b in zip(x, rates, strict=True)]


def combined(x: Row, sixth: Scalar, k: tuple[Row, Row, Row, Row]) -> list[Scalar]:
    """x + h/6 (k1 + 2 k2 + 2 k3 + k4)."""
    return [sixth.fused(sixth.like(2.0).fused(c + d, b + e), a) for a, b, c, d, e in zip(x, *k, strict=True)]


def mean(parts: Row, rows: Sequence[Row]) -> list[Scalar]:
    """The sum of the rows, each times its part."""
    total = [parts[0].like(0.0) for _ in rows[0]]
    for part, row in zip(parts, rows, strict=True):
        total = [part.fused(value, before) for value, before in zip(row, total, strict=True)]
    return total
