"""`Linearised`: a period of a loop on its processor as a linear map, and how far off that is on a box."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from flint import arb

from ulna.certify.processor.decay_sums import DecaySums, decay_sums
from ulna.certify.processor.period_map import PeriodMap

SEGMENTS = 4
"""Of the line from the rest point, over which the mean of the slopes is taken."""
UNIT = 2.0**60
"""A and N are whole numbers of its inverse."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Linearised:
    """d⁺ = A d + N δ + r about a point c, in coordinates divided by powers of two.

    Attributes:
        map: the period. center: (n,) c. scale: (n,) the powers of two. A: (n, n). N: (n, m). noise: (m,) largest |δ|.
        left: (2, n) largest |F(c) − c|, of any period and of the first one. sums: of A.
        begins: (n,) how far from c each state starts in any case.
    """

    map: PeriodMap
    center: np.ndarray
    scale: np.ndarray
    A: np.ndarray
    N: np.ndarray
    noise: np.ndarray
    left: np.ndarray
    sums: DecaySums
    begins: np.ndarray

    @property
    def driven(self) -> np.ndarray:
        """(n,) what the disturbances of the sensors alone come to, were r = 0."""
        return self.sums.pushed @ self.noise

    def rest(self, box: np.ndarray) -> np.ndarray:
        """(n,) largest |r| where |d| ≤ box."""
        low, high = self.slopes(box, first=False)
        n = len(box)
        off = np.maximum(np.abs(low - np.hstack([self.A, self.N])), np.abs(high - np.hstack([self.A, self.N])))
        return (off[:, :n] @ box + off[:, n:] @ self.noise + self.left[0]) * (1 + 1e-12)

    def begun(self, start: np.ndarray) -> np.ndarray:
        """(n,) largest |d| after the first period of a run from |d| ≤ start."""
        low, high = self.slopes(start, first=True)
        most, n = np.maximum(np.abs(low), np.abs(high)), len(start)
        return (most[:, :n] @ start + most[:, n:] @ self.noise + self.left[1]) * (1 + 1e-12)

    def slopes(self, box: np.ndarray, *, first: bool) -> tuple[np.ndarray, np.ndarray]:
        """(n, n + m) ends of the secant slopes from c to c + d."""
        total = [[arb(0)] * (len(box) + len(self.noise))] * len(box)
        for k in range(SEGMENTS):
            part = arb((k + 0.5) / SEGMENTS, 0.5 / SEGMENTS)
            point = [arb(c) + part * arb(0, s * b) for c, s, b in _rows(self.center, self.scale, box)]
            _, rows = self.map.moved(point, [part * arb(0, d) for d in self.noise.tolist()], first=first)
            total = [[a + b for a, b in zip(old, row, strict=True)] for old, row in zip(total, rows, strict=True)]
        return _ends(total, self.scale)


def _rows(*columns: np.ndarray) -> list[tuple[float, ...]]:
    return list(zip(*(column.tolist() for column in columns), strict=True))


def _ends(rows: Sequence[Sequence[arb]], scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper ends of mean slopes in scaled coordinates; floating point rounds by less than is added."""
    m = len(rows[0]) - len(rows)
    factor = np.hstack([scale, np.ones(m)])[None, :] / scale[:, None] / SEGMENTS
    low, high = (
        np.array([[float(getattr(v, name)()) if v.is_finite() else math.nan for v in row] for row in rows]) * factor
        for name in ("lower", "upper")
    )
    slack = 1e-15 * (np.abs(low) + np.abs(high))
    return low - slack, high + slack


def linearised(found: PeriodMap, center: np.ndarray, shape: np.ndarray) -> Linearised | float:
    """The linear part, and the sums of its powers; the size of its largest eigenvalue where they do not end."""
    n = found.size
    values, rows = found.moved([arb(v) for v in center.tolist()], [arb(0)] * len(found.sensors))
    whole = np.array([[float(v.mid()) for v in row] for row in rows])
    noise = np.array([each.half_step for each in found.sensors])
    largest = float(np.abs(np.linalg.eigvals(whole[:, :n])).max())
    rough = decay_sums(whole[:, :n], whole[:, n:]) if largest < 1 else None
    if rough is None:
        return largest
    reach = rough.pushed @ noise + rough.largest @ (shape / max(1.0, shape.max() * 100))
    scale = 2.0 ** np.round(np.log2(reach + 1e-3 * reach.max()))
    factor = np.hstack([scale, np.ones(len(noise))])[None, :] / scale[:, None]
    whole = np.round(whole * factor * UNIT) / UNIT
    begun, _ = found.moved([arb(v) for v in center.tolist()], [arb(0)] * len(found.sensors), first=True)
    left = [[float(abs(v - c).upper()) for v, c in zip(row, center.tolist(), strict=True)] for row in (values, begun)]
    begins = np.array(
        [
            abs(c) if name.startswith("h") else 0.0
            for name, c in zip(found.memory, center[len(found.states) :], strict=True)
        ]
    )
    sums = decay_sums(whole[:, :n], whole[:, n:])
    if sums is None:
        return largest
    return Linearised(
        map=found,
        center=center,
        scale=scale,
        A=whole[:, :n],
        N=whole[:, n:],
        noise=noise,
        left=np.array(left) / scale,
        sums=sums,
        begins=np.concatenate([np.zeros(len(found.states)), begins]) / scale,
    )
