"""Where runs settle: a map over two of the varied quantities."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.campaign.plans import Grid
from ulna.campaign.runs import Column
from ulna.campaign.store import CampaignResult


@dataclass(frozen=True, slots=True, kw_only=True)
class SettledMap:
    """The settled part of the runs in each cell.

    Attributes:
        x, y: what runs along the axes.
        x_edges, y_edges: (nx + 1,), (ny + 1,) edges of the cells, SI.
        fraction: (ny, nx) settled part; NaN in a cell without runs.
        runs: (ny, nx) how many.
    """

    x: Column
    y: Column
    x_edges: np.ndarray
    y_edges: np.ndarray
    fraction: np.ndarray
    runs: np.ndarray


def settled_map(result: CampaignResult, x: str, y: str, *, cells: int | None = None) -> SettledMap:
    """The settled part over two varied quantities; with a `Grid` plan one cell for each of its values.

    Args:
        result: of the campaign.
        x, y: names of two varied quantities.
        cells: along each axis, where the plan is no grid; by default so that a cell holds some ten runs, 50 at most.

    Raises:
        CampaignError: a name that was not varied, both the same, fewer than one cell.
    """
    if cells is None:
        cells = min(50, max(4, math.isqrt(result.runs // 10)))
    if x == y or cells < 1:
        raise CampaignError(
            f"settled_map('{x}', '{y}', cells={cells})", "expected two different axes, each with at least one cell."
        )
    found = {column.name: column for column in result.columns if column.varied}
    for name in (x, y):
        if name not in found:
            raise CampaignError(f"map over '{name}'", "it was not varied.", f"Varied were: {', '.join(found)}.")
    edges = _edges(result, x, y, cells)
    shape = tuple(len(axis) - 1 for axis in edges)
    runs, hits = np.zeros(shape), np.zeros(shape)
    for block in result.blocks([x, y, "settled"]):
        runs += np.histogram2d(block[x], block[y], bins=edges)[0]
        hits += np.histogram2d(block[x], block[y], bins=edges, weights=block["settled"].astype(float))[0]
    with np.errstate(invalid="ignore"):
        fraction = np.where(runs > 0, hits / runs, np.nan)
    return SettledMap(
        x=found[x],
        y=found[y],
        x_edges=edges[0],
        y_edges=edges[1],
        fraction=fraction.T,
        runs=runs.T.astype(np.int64),
    )


def _edges(result: CampaignResult, x: str, y: str, cells: int) -> list[np.ndarray]:
    plan = result.experiment.plan
    if isinstance(plan, Grid):
        return [_around(np.sort(np.array(plan.axes[name]))) for name in (x, y)]
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for block in result.blocks([x, y]):
        low = np.minimum(low, [block[x].min(), block[y].min()])
        high = np.maximum(high, [block[x].max(), block[y].max()])
    wide = np.where(low == high, 0.5, 0.0)
    return [np.linspace(*limits, cells + 1) for limits in zip(low - wide, high + wide, strict=True)]


def _around(values: np.ndarray) -> np.ndarray:
    """Edges half-way between the values."""
    if len(values) == 1:
        return np.array([values[0] - 0.5, values[0] + 0.5])
    middle = 0.5 * (values[1:] + values[:-1])
    return np.concatenate(([2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]))
