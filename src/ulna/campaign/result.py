"""`CampaignResult`: what a campaign found, read from its store when asked for."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.campaign.experiment import Experiment
from ulna.campaign.measures import Column
from ulna.campaign.part import experiment_of, label, unpacked
from ulna.campaign.runs import columns
from ulna.campaign.store import Folder, Memory, open_folder


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CampaignResult:
    """The figures of all runs. Columns are read from the store one at a time, when asked for.

    Attributes:
        store: where they are.
    """

    store: Folder | Memory

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
            CampaignError: an unknown name, or a part that is missing or damaged.
        """
        return self.read(name, 0, self.runs)

    def read(self, name: str, first: int, last: int) -> np.ndarray:
        """(last − first,) values of a column for the runs first ≤ k < last; only the parts they lie in are read.

        Raises:
            CampaignError: as `[]`.
        """
        place, column = self._column(name)
        found = np.empty(max(0, last - first), dtype=np.int8 if column.whole else float)
        size = self.store.manifest.size
        for begin, end in self.store.manifest.spans[first // size : -(-last // size) if last > first else 0]:
            values = unpacked(self.store.get((begin, end)), label(column, place))
            low, high = max(first, begin), min(last, end)
            found[low - first : high - first] = values[low - begin : high - begin]
        return found

    def run(self, number: int) -> dict[str, float]:
        """All columns of one run.

        Raises:
            CampaignError: a number that is none of the runs.
        """
        if not 0 <= number < self.runs:
            raise CampaignError(f"run {number}", f"the campaign has the runs 0 to {self.runs - 1}.")
        return {column.name: float(self.read(column.name, number, number + 1)[0]) for column in self.columns}

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` over `run`, what varied as coordinates, units as attributes; values load when used."""
        from ulna.campaign.dataset import dataset

        return dataset(self)

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame`: a column for each figure, one row a run."""
        import pandas as pd

        frame = pd.DataFrame({c.name: self[c.name] for c in self.columns}, index=pd.RangeIndex(self.runs, name="run"))
        frame.attrs["units"] = {c.name: c.unit for c in self.columns}
        return frame

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write one line a run, part by part.

        Raises:
            CampaignError: a place that cannot be written.
        """
        import pandas as pd

        target = Path(path)
        beside = target.with_name(f".{target.name}.{os.getpid()}.part")
        try:
            with beside.open("w", encoding="utf-8") as file:
                for first, last in self.store.manifest.spans:
                    rows = {c.name: self.read(c.name, first, last) for c in self.columns}
                    index = pd.RangeIndex(first, last, name="run")
                    pd.DataFrame(rows, index=index).to_csv(file, header=first == 0)
            beside.replace(target)
        except OSError as error:
            raise _unwritable(target, error) from error
        finally:
            beside.unlink(missing_ok=True)
        return target

    def to_netcdf(self, path: str | os.PathLike[str]) -> Path:
        """Write everything into one netCDF file (version 3, readable everywhere).

        Raises:
            CampaignError: a place that cannot be written.
        """
        target = Path(path)
        beside = target.with_name(f".{target.name}.{os.getpid()}.part")
        try:
            self.to_xarray().to_netcdf(beside, engine="scipy")
            beside.replace(target)
        except OSError as error:
            raise _unwritable(target, error) from error
        finally:
            beside.unlink(missing_ok=True)
        return target

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
    """
    folder = open_folder(Path(path))
    missing = folder.manifest.runs - sum(last - first for first, last in folder.done())
    if missing:
        raise CampaignError(
            f"the result folder '{path}'",
            f"{missing} of {folder.manifest.runs} runs are missing.",
            "Start the same campaign again: it goes on with them.",
        )
    return CampaignResult(store=folder)


def _unwritable(target: Path, error: OSError) -> CampaignError:
    reason = (error.strerror or str(error)).lower()
    return CampaignError(f"the file '{target}'", f"it cannot be written: {reason}.", "Choose another place.")
