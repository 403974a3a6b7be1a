"""A campaign as an `xarray.Dataset` whose values are read from the store when they are used."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from ulna.campaign.measures import Column
from ulna.campaign.result import CampaignResult


class StoredColumn(BackendArray):
    """One column over all runs, read part by part.

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
    """The dataset of a campaign; settings and versions are attributes."""
    variables: dict[str, Any] = {}
    coordinates: dict[str, Any] = {"run": np.arange(result.runs)}
    for column in result.columns:
        values = indexing.LazilyIndexedArray(StoredColumn(result, column))
        attributes = {"units": column.unit, "long_name": column.text}
        (coordinates if column.varied else variables)[column.name] = xr.Variable(("run",), values, attributes)
    manifest = result.store.manifest
    attributes = {"settings": manifest.settings, "versions": str(dict(manifest.versions))}
    return xr.Dataset(variables, coords=coordinates, attrs=attributes)
