"""A campaign as an `xarray.Dataset` whose values are read from the store when they are used."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from ulna.campaign.runs import Column

Read = Callable[[str, int, int], np.ndarray]
"""(name, first, last) → (last − first,) values of a column for the runs first ≤ k < last."""


class StoredColumn(BackendArray):
    """One column over all runs, read batch by batch.

    Args:
        column: which. runs: how many there are. read: gives its values.
    """

    def __init__(self, column: Column, runs: int, read: Read) -> None:
        self.shape = (runs,)
        self.dtype = np.dtype(np.int8 if column.whole else float)
        self._name = column.name
        self._column = read

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.BASIC, self._read)

    def _read(self, key: tuple[Any, ...]) -> Any:
        chosen = key[0]
        if not isinstance(chosen, slice):
            return self._column(self._name, int(chosen), int(chosen) + 1)[0]
        first, last, step = chosen.indices(self.shape[0])
        if step < 0:
            runs = range(first, last, step)
            low, high = (runs[-1], runs[0] + 1) if runs else (0, 0)
            return self._column(self._name, low, high)[::-1][::-step]
        return self._column(self._name, first, last)[::step]


def dataset(columns: Iterable[Column], runs: int, read: Read, attributes: Mapping[str, str]) -> xr.Dataset:
    """The columns over `run`, what varied as coordinates, with units.

    Nothing is read before it is used; `.chunk(run=100_000)` makes Dask arrays of it, for more than fits into memory.
    """
    variables: dict[str, Any] = {}
    # Of a range pandas keeps the limits only.
    coordinates: dict[str, Any] = {"run": pd.RangeIndex(runs)}
    for column in columns:
        values = indexing.LazilyIndexedArray(StoredColumn(column, runs, read))
        shown = xr.Variable(("run",), values, {"units": column.unit, "long_name": column.text})
        (coordinates if column.varied else variables)[column.name] = shown
    return xr.Dataset(variables, coords=coordinates, attrs=attributes)
