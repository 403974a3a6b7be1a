"""A campaign as an `xarray.Dataset` whose values are read from the store when they are used."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from ulna.campaign.measures import Column
from ulna.campaign.result import CampaignResult
from ulna.campaign.store import Manifest


class StoredColumn(BackendArray):
    """One column over all runs, read batch by batch.

    Args:
        result: of the campaign.
        column: which.
    """

    def __init__(self, result: CampaignResult, column: Column) -> None:
        self.shape = (result.runs,)
        self.dtype = np.dtype(np.int8 if column.whole else float)
        self._result = result
        self._name = column.name

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.BASIC, self._read)

    def _read(self, key: tuple[Any, ...]) -> Any:
        chosen = key[0]
        if not isinstance(chosen, slice):
            return self._result.read(self._name, int(chosen), int(chosen) + 1)[0]
        first, last, step = chosen.indices(self.shape[0])
        if step < 0:
            runs = range(first, last, step)
            low, high = (runs[-1], runs[0] + 1) if runs else (0, 0)
            return self._result.read(self._name, low, high)[::-1][::-step]
        return self._result.read(self._name, first, last)[::step]


def dataset(result: CampaignResult) -> xr.Dataset:
    """The dataset of a campaign; settings and versions are attributes.

    Nothing is read before it is used; `.chunk(run=100_000)` makes Dask arrays of it, for more than fits into memory.
    """
    variables: dict[str, Any] = {}
    # Of a range pandas keeps the limits only.
    coordinates: dict[str, Any] = {"run": pd.RangeIndex(result.runs)}
    for column in result.columns:
        values = indexing.LazilyIndexedArray(StoredColumn(result, column))
        attributes = {"units": column.unit, "long_name": column.text}
        where = coordinates if column.varied else variables
        where[column.name] = xr.Variable(("run",), values, attributes)
    return xr.Dataset(variables, coords=coordinates, attrs=described(result.store.manifest))


def described(manifest: Manifest) -> dict[str, str]:
    """All that is needed to repeat a campaign, as texts."""
    return {"settings": manifest.settings, "versions": json.dumps(dict(manifest.versions))}
