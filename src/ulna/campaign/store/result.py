"""`CampaignResult`: what a campaign found, read from its store when asked for."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from io import BufferedIOBase
from pathlib import Path
from typing import Any

import numpy as np

from ulna.base import whole_file
from ulna.campaign.errors import CampaignError
from ulna.campaign.runs import Column, Experiment, columns, experiment_of
from ulna.campaign.store.batch_file import label, netcdf_columns, unpacked
from ulna.campaign.store.folder import open_folder
from ulna.campaign.store.netcdf_writer import MOST_ROWS, NetcdfColumn, write_netcdf
from ulna.campaign.store.store import Store


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CampaignResult:
    """The figures of all runs. Columns are read from the store one at a time, when asked for.

    Attributes:
        store: where they are.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> result = ulna.sweep(spring, ulna.Grid(axes={"p": [1, 2]}), horizon=60.0)
        >>> result["settling_time_y"].round(2)
        array([14.66, 14.66])
    """

    store: Store

    @property
    def experiment(self) -> Experiment:
        """What was run, as the store has it."""
        return experiment_of(self.store.manifest.settings)

    @property
    def columns(self) -> tuple[Column, ...]:
        """What is known of every run."""
        return columns(self.experiment)

    @property
    def runs(self) -> int:
        """Number of runs."""
        return self.store.manifest.runs

    @property
    def varied(self) -> tuple[str, ...]:
        """Names of what the plan varied."""
        return self.experiment.plan.names

    def __len__(self) -> int:
        return self.runs

    def __getitem__(self, name: str) -> np.ndarray:
        """(runs,) values of a column, in SI.

        Raises:
            CampaignError: an unknown name, or a batch that is missing or damaged.
        """
        return self.read(name, 0, self.runs)

    def read(self, name: str, first: int, last: int) -> np.ndarray:
        """(last − first,) values of a column for the runs first ≤ k < last; only the batches they lie in are read.

        Raises:
            CampaignError: as `[]`.
        """
        return self._filled([name], first, last)[0]

    def blocks(self, names: Sequence[str]) -> Iterator[dict[str, np.ndarray]]:
        """The named columns batch by batch, in the order of the runs: memory for one batch, however many there are.

        Raises:
            CampaignError: as `[]`.
        """
        places = [self._column(name)[0] for name in names]
        labels = [label(self.columns[place], place) for place in places]
        for batch in self.store.manifest.batches:
            yield dict(zip(names, unpacked(self.store.get(batch), labels), strict=True))

    def run(self, number: int) -> dict[str, float]:
        """All columns of one run.

        Raises:
            CampaignError: a number that is none of the runs.
        """
        if not 0 <= number < self.runs:
            raise CampaignError(f"run {number}", f"the campaign has the runs 0 to {self.runs - 1}.")
        names = [column.name for column in self.columns]
        found = self._filled(names, number, number + 1)
        return {name: float(values[0]) for name, values in zip(names, found, strict=True)}

    def _filled(self, names: Sequence[str], first: int, last: int) -> list[np.ndarray]:
        """The columns for the runs first ≤ k < last; each batch is read once."""
        layout = [self._column(name) for name in names]
        labels = [label(column, place) for place, column in layout]
        found = [np.empty(max(0, last - first), np.int8 if column.whole else float) for _, column in layout]
        size = self.store.manifest.batch_size
        for begin, end in self.store.manifest.batches[first // size : -(-last // size) if last > first else 0]:
            low, high = max(first, begin), min(last, end)
            for into, values in zip(found, unpacked(self.store.get((begin, end)), labels), strict=True):
                into[low - first : high - first] = values[low - begin : high - begin]
        return found

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` over `run`, what varied as coordinates, units as attributes; values load when used."""
        from ulna.campaign.store.dataset import dataset

        return dataset(self.columns, self.runs, self.read, self._described)

    @property
    def _described(self) -> dict[str, str]:
        """All that is needed to repeat a campaign, as texts."""
        manifest = self.store.manifest
        return {"settings": manifest.settings, "versions": json.dumps(dict(manifest.versions))}

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame`: a column for each figure, one row a run."""
        import pandas as pd

        frame = pd.DataFrame({c.name: self[c.name] for c in self.columns}, index=pd.RangeIndex(self.runs, name="run"))
        frame.attrs["units"] = {c.name: c.unit for c in self.columns}
        return frame

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write one line a run, batch by batch.

        Raises:
            CampaignError: a place that cannot be written.
        """
        import pandas as pd

        with _written(Path(path)) as file:
            first = 0
            for rows in self.blocks([c.name for c in self.columns]):
                frame = pd.DataFrame(rows)
                frame.index = pd.RangeIndex(first, first + len(frame), name="run")
                file.write(frame.to_csv(header=first == 0).encode())
                first += len(frame)
        return Path(path)

    def to_netcdf(self, path: str | os.PathLike[str]) -> Path:
        """Write everything into one netCDF file (version 3, readable everywhere), batch by batch.

        Raises:
            CampaignError: a place that cannot be written, or more runs than such a file can hold.
        """
        if self.runs > MOST_ROWS:
            raise CampaignError(f"the file '{path}'", f"a netCDF file holds {MOST_ROWS} runs, these are {self.runs}.")
        shown = [NetcdfColumn(name="run", dtype=">i4"), *netcdf_columns(self.columns)]

        def blocks() -> Iterator[list[np.ndarray]]:
            first = 0
            for block in self.blocks([c.name for c in self.columns]):
                values = list(block.values())
                yield [np.arange(first, first + len(values[0])), *values]
                first += len(values[0])

        with _written(Path(path)) as file:
            write_netcdf(file, "run", self.runs, shown, self._described, blocks())
        return Path(path)

    def _column(self, name: str) -> tuple[int, Column]:
        for place, column in enumerate(self.columns):
            if column.name == name:
                return place, column
        known = ", ".join(c.name for c in self.columns)
        raise CampaignError(f"'{name}' of the campaign", "there is no such figure.", f"Known: {known}.")

    def __repr__(self) -> str:
        return f"CampaignResult: {self.runs} runs of '{self.experiment.system.name}' over {', '.join(self.varied)}"


def open_campaign(path: str | os.PathLike[str]) -> CampaignResult:
    """The finished campaign in a folder.

    Raises:
        CampaignError: no campaign there, one that is not finished, or a damaged manifest.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> result = ulna.sweep(spring, ulna.Grid(axes={"p": [1, 2]}), horizon=5.0, store="runs")
        >>> len(ulna.open_campaign("runs")["settling_time_y"])
        2
    """
    folder = open_folder(Path(path))
    missing = folder.manifest.runs - folder.runs_done
    if missing:
        raise CampaignError(
            f"the result folder '{path}'",
            f"{missing} of {folder.manifest.runs} runs are missing.",
            "Start the same campaign again: it goes on with them.",
        )
    return CampaignResult(store=folder)


@contextmanager
def _written(target: Path) -> Iterator[BufferedIOBase]:
    """A file that is there whole at the end, or not at all.

    Raises:
        CampaignError: a place that cannot be written.
    """
    try:
        with whole_file(target) as file:
            yield file
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise CampaignError(
            f"the file '{target}'", f"it cannot be written: {reason}.", "Choose another place."
        ) from error
