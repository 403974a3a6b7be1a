"""Results as datasets and files: nothing is read before it is used, and what is written repeats the campaign."""

from __future__ import annotations

import io
from pathlib import Path
from tempfile import TemporaryFile

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from campaign_loops import SPRING
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import netcdf_file

from ulna.campaign import CampaignError, CampaignResult, Experiment, Measures, Random, Uniform, sweep
from ulna.campaign.runs.settings import from_text
from ulna.campaign.store import MemoryStore
from ulna.campaign.store.netcdf_writer import NetcdfColumn, write_netcdf
from ulna.system import system_from_mapping

PLAN = Random(vary={"x": Uniform(low=-1, high=1), "k": Uniform(low=1, high=9)}, runs=95, seed=5)
MEASURES = Measures(outputs=("y",), effort=("u",), samples=20)


class Watched(MemoryStore):
    """Counts what is read of it."""

    def __init__(self, other: MemoryStore) -> None:
        super().__init__(other.manifest)
        self.read: list[tuple[int, int]] = []
        for batch in other.done():
            self.put(batch, other.get(batch))

    def get(self, batch: tuple[int, int]) -> bytes:
        """A batch, noted."""
        self.read.append(batch)
        return super().get(batch)


def watched() -> tuple[CampaignResult, Watched]:
    found = sweep(SPRING, PLAN, MEASURES, horizon=2.0, batch_size=10)
    assert isinstance(found.store, MemoryStore)
    store = Watched(found.store)
    return CampaignResult(store=store), store


def test_a_dataset_reads_only_the_batches_that_are_used() -> None:
    result, store = watched()
    data = result.to_xarray()
    assert store.read == []
    value = data["peak_u"][42].item()
    assert store.read == [(40, 50)]
    assert value == result["peak_u"][42]
    assert data.sel(run=42)["peak_u"].item() == value
    assert data["peak_u"].attrs["units"] == "m/s^2"
    assert data["k"].attrs["units"] == "1/s^2"
    assert set(data.coords) == {"run", "x", "k"}


@pytest.mark.parametrize("key", [slice(None), slice(88, 3, -7), slice(5, 5), 7, -1, [3, 50, 4], slice(0, 95, 13)])
def test_a_dataset_is_cut_as_arrays_are(key) -> None:
    result, _ = watched()
    assert np.array_equal(result.to_xarray()["final_x"][key].values, result["final_x"][key])


def test_a_dataset_in_chunks_is_worked_on_batch_by_batch() -> None:
    pytest.importorskip("dask")
    result, store = watched()
    data = result.to_xarray().chunk(run=20)
    assert store.read == []
    assert data["final_x"].chunks == ((20, 20, 20, 20, 15),)
    assert data["final_x"].mean().compute().item() == pytest.approx(result["final_x"].mean(), rel=1e-14)


def test_a_file_holds_all_columns_their_units_and_what_repeats_the_campaign(tmp_path: Path) -> None:
    result, store = watched()
    path = result.to_netcdf(tmp_path / "runs.nc")
    assert len(store.read) == len(set(store.read)) == 10
    with xr.open_dataset(path, engine="scipy") as stored:
        assert stored.load().drop_vars("outcome").equals(result.to_xarray().load().drop_vars("outcome"))
        for column in result.columns:
            assert stored[column.name].values.tobytes() == result[column.name].tobytes()
            assert stored[column.name].attrs["units"] == column.unit
        found = from_text(stored.attrs["settings"])
    assert isinstance(found, Experiment)
    again = sweep(
        found.loop,
        found.plan,
        found.measures,
        horizon=found.horizon,
        engine=found.engine,
        initial=found.initial,
        parameters=found.parameters,
        inputs=found.inputs,
    )
    for column in result.columns:
        assert again[column.name].tobytes() == result[column.name].tobytes()


def test_a_table_has_a_row_for_each_run_and_reads_back_what_was_written(tmp_path: Path) -> None:
    result, store = watched()
    read = pd.read_csv(result.to_csv(tmp_path / "runs.csv"), index_col="run")
    assert len(store.read) == 10
    frame = result.to_pandas()
    pd.testing.assert_frame_equal(read.astype(float), frame.astype(float), check_exact=True)
    assert frame.attrs["units"]["peak_u"] == "m/s^2"


def test_names_beyond_latin_letters_are_kept_as_long_names(tmp_path: Path) -> None:
    loop = system_from_mapping({"states": {"θ": "-θ"}, "outputs": {"y": "θ"}})
    result = sweep(loop, Random(vary={"θ": Uniform(low=1, high=2)}, runs=4), horizon=1.0)
    with xr.open_dataset(result.to_netcdf(tmp_path / "runs.nc"), engine="scipy") as stored:
        assert np.array_equal(stored["column_0"].values, result["θ"])


@pytest.mark.parametrize("write", ["to_csv", "to_netcdf"])
def test_a_file_that_cannot_be_written_is_one_clear_error(tmp_path: Path, write: str) -> None:
    (tmp_path / "file").write_text("")
    result, _ = watched()
    with pytest.raises(CampaignError, match="it cannot be written"):
        getattr(result, write)(tmp_path / "file" / "runs")


@given(
    values=st.lists(st.tuples(st.floats(width=64), st.integers(-128, 127)), max_size=30),
    size=st.integers(1, 7),
    texts=st.dictionaries(st.text("abcde", min_size=1), st.text("xyz ", min_size=1, max_size=9), max_size=3),
)
def test_scipy_reads_what_is_written_block_by_block(values: list, size: int, texts: dict[str, str]) -> None:
    wide = np.array([value for value, _ in values], dtype=float)
    small = np.array([value for _, value in values], dtype=np.int8)
    columns = [
        NetcdfColumn(name="wide", dtype=">f8", attributes={"units": "m"}),
        NetcdfColumn(name="small", dtype="i1", attributes=texts),
    ]
    blocks = ([wide[k : k + size], small[k : k + size]] for k in range(0, len(wide), size))
    with TemporaryFile() as file:
        write_netcdf(file, "row", len(wide), columns, texts, blocks)
        file.seek(0)
        data = file.read()
    if not len(wide):
        return  # SciPy takes a dimension of length 0 for one that grows
    with netcdf_file(io.BytesIO(data), "r", mmap=False) as found:
        assert found.dimensions == {"row": len(wide)}
        assert np.array_equal(found.variables["wide"].data, wide, equal_nan=True)
        assert np.array_equal(found.variables["small"].data, small)
        assert found.variables["wide"].units == b"m"
        assert {name: getattr(found, name).decode() for name in texts} == texts
