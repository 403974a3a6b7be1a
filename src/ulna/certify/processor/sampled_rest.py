"""Where a loop on its processor rests, in floating point: the proof asks for no more than a point that is near."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from flint import arb

from ulna.certify.processor.period_map import PeriodMap
from ulna.loop import Loop
from ulna.program import to_numpy
from ulna.system import starting_point

_SUBSTEPS, _NEARER = 2, 30


def resting(loop: Loop, free: PeriodMap) -> np.ndarray | None:
    """(n,) where the unlimited map rests, by Newton's method in floating point."""
    point = starting_point(loop.plant).numbers
    names = [*free.states, *free.memory]
    # Estimates at what they estimate, held inputs at theirs, what was measured at what it is there.
    near = {f"z{k}": signal.name.removesuffix("_hat") for k, signal in enumerate(loop.wiring.memory)}
    for k, signal in enumerate(loop.wiring.driven):
        near |= {name: signal.name for name in names if name == f"believed{k}" or name.startswith(f"h{k}_")}
    near |= {f"yn{k}": signal.name for k, signal in enumerate(loop.wiring.measured)}
    c = _nearer(free, np.array([float(point.get(near.get(name, name), 0.0)) for name in names]))
    quiet, off = [arb(0)] * len(free.sensors), math.inf
    for _ in range(60):
        values, rows = free.moved([arb(v) for v in c.tolist()], quiet)
        value = np.array([float(v.mid()) for v in values])
        slope = np.array([[float(v.mid()) for v in row[: free.size]] for row in rows])
        if not (np.isfinite(value).all() and np.isfinite(slope).all()):
            return None
        off = float(np.abs(value - c).max())
        change = np.linalg.lstsq(np.eye(free.size) - slope, value - c, rcond=None)[0]
        c = c + change
        if np.abs(change).max() < 1e-13 * (1 + np.abs(c).max()):
            break
    return np.round(c, 12) if off < 1e-9 * (1 + np.abs(c).max()) else None


def _nearer(free: PeriodMap, start: np.ndarray) -> np.ndarray:
    """(n,) Newton's method on the map in Runge-Kutta steps: from far off balls say nothing."""
    reading, step, motion = map(to_numpy, (free.reading, free.step, free.motion))
    n, size = len(free.states), free.size

    def moved(points: np.ndarray) -> np.ndarray:
        x, slots = points[:n], dict(zip(free.memory, points[n:], strict=True))
        slots |= dict(zip(free.reading.outputs, reading(*x), strict=True))
        done = dict(zip(free.step.outputs, step(*(slots[name] for name in free.step.inputs)), strict=True))
        for length, held in free.stretches:
            u, h = [done[slot] for slot in held], float(length) / _SUBSTEPS

            def rates(at: np.ndarray, u: Sequence[Any] = tuple(u)) -> np.ndarray:
                return np.array([np.broadcast_to(v, at.shape[1:]) for v in motion(*at, *u)])

            for _ in range(_SUBSTEPS):
                k1 = rates(x)
                k2 = rates(x + h / 2 * k1)
                k3 = rates(x + h / 2 * k2)
                x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + rates(x + h * k3))
        return np.vstack([x, *(np.broadcast_to(done[name], points.shape[1:]) for name in free.memory)])

    c = start
    for _ in range(_NEARER):
        width = 1e-6 * (1 + np.abs(c))
        points = c[:, None] + np.hstack([np.zeros((size, 1)), np.diag(width)])
        with np.errstate(all="ignore"):
            found = moved(points)
        if not np.isfinite(found).all():
            return start
        slope = (found[:, 1:] - found[:, :1]) / width
        change = np.linalg.lstsq(np.eye(size) - slope, found[:, 0] - c, rcond=None)[0]
        c = c + change
        if np.abs(change).max() < 1e-9 * (1 + np.abs(c).max()):
            break
    return c
