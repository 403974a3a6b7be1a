"""Where runs settle: a map over two of the varied quantities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.campaign.grid import Grid
from ulna.campaign.measures import Column
from ulna.campaign.result import CampaignResult


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


def settled_map(result: CampaignResult, x: str, y: str, *, cells: int = 25) -> SettledMap:
    """The settled part over two varied quantities; with a `Grid` plan one cell for each of its values.

    Args:
        result: of the campaign.
        x, y: names of two varied quantities.
        cells: along each axis, where the plan is no grid.

    Raises:
        CampaignError: a name that was not varied, both the same, fewer than one cell.
    """
    if x == y or cells < 1:
        raise CampaignError(f"settled_map('{x}', '{y}', cells={cells})", "two different axes with cells are needed.")
    found = {column.name: column for column in result.columns if column.varied}
    for name in (x, y):
        if name not in found:
            raise CampaignError(f"map over '{name}'", "it was not varied.", f"Varied were: {', '.join(found)}.")
    at = {name: result[name] for name in (x, y)}
    edges = [_edges(result, name, at[name], cells) for name in (x, y)]
    settled = result["settled"].astype(float)
    runs, _, _ = np.histogram2d(at[x], at[y], bins=edges)
    hits, _, _ = np.histogram2d(at[x], at[y], bins=edges, weights=settled)
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


def _edges(result: CampaignResult, name: str, values: np.ndarray, cells: int) -> np.ndarray:
    plan = result.experiment.plan
    if isinstance(plan, Grid):
        axis = np.sort(np.array(dict(plan.axes)[name]))
        if len(axis) == 1:
            return np.array([axis[0] - 0.5, axis[0] + 0.5])
        middle = 0.5 * (axis[1:] + axis[:-1])
        return np.concatenate(([2 * axis[0] - middle[0]], middle, [2 * axis[-1] - middle[-1]]))
    low, high = float(values.min()), float(values.max())
    if low == high:
        low, high = low - 0.5, high + 0.5
    return np.linspace(low, high, cells + 1)
