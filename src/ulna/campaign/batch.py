"""A batch of a campaign as bytes: a netCDF file (version 3) of some consecutive runs."""

from __future__ import annotations

import hashlib
import importlib.metadata
import io
import json
import platform
import sys
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from ulna.campaign.encoding import from_text
from ulna.campaign.errors import CampaignError
from ulna.campaign.experiment import Experiment
from ulna.campaign.measures import Column
from ulna.campaign.runs import columns, run_batch

_WATCHED = ("ulna", "heyoka", "numba", "llvmlite", "numpy", "scipy", "sympy")


@lru_cache(maxsize=1)
def versions() -> Mapping[str, str]:
    """What the bits of a result depend on besides the settings: libraries, Python and the kind of processor."""
    found = {"python": platform.python_version(), "machine": f"{sys.platform} {platform.machine()}"}
    for name in _WATCHED:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found


@lru_cache(maxsize=4)
def experiment_of(settings: str) -> Experiment:
    """The experiment of a text of settings, read once per process.

    Compiled loops are found by the identity of the loop, so that equal ones of several campaigns must be one object.
    """
    found = from_text(settings)
    if not isinstance(found, Experiment):
        raise CampaignError("settings of a campaign", "they describe something else.")
    return replace(found, loop=_shared(json.dumps(json.loads(settings)["loop"])))


@lru_cache(maxsize=16)
def _shared(text: str) -> Any:
    return from_text(text)


def computed_batch(settings: str, expected: Mapping[str, str], first: int, last: int, threads: int) -> bytes:
    """The file of the runs first ≤ k < last: what a worker does.

    Raises:
        CampaignError: libraries of other versions than the campaign was begun with.
    """
    check_versions(expected, "this worker")
    experiment = experiment_of(settings)
    return packed(columns(experiment), run_batch(experiment, first, last, threads=threads), first)


def check_versions(expected: Mapping[str, str], where: str) -> None:
    """Refuse to mix results of different libraries.

    Raises:
        CampaignError: naming what differs.
    """
    here = versions()
    differing = [
        f"{name} {expected[name]} (here {here.get(name)})" for name in expected if expected[name] != here.get(name)
    ]
    if differing:
        raise CampaignError(
            f"a batch of a campaign on {where}",
            f"the campaign was begun with {', '.join(differing)}.",
            "Install those versions, or begin a new campaign in another folder.",
        )


def packed(layout: tuple[Column, ...], values: Mapping[str, np.ndarray], first: int) -> bytes:
    """The columns as a netCDF file, the same bytes for the same values."""
    from scipy.io import netcdf_file

    buffer = io.BytesIO()
    # Closing would throw the buffer away before it can be read.
    file = netcdf_file(buffer, "w", version=2)
    count = len(next(iter(values.values())))
    file.createDimension("run", count)
    file.first_run = first
    for place, column in enumerate(layout):
        variable = file.createVariable(label(column, place), column.dtype, ("run",))
        variable[:] = values[column.name]
        if column.unit:
            variable.units = column.unit.encode()
        variable.long_name = column.text.encode()
    file.flush()
    return buffer.getvalue()


def unpacked(data: bytes, labels: Iterable[str]) -> list[np.ndarray]:
    """Columns of such a file, in the machine's own byte order."""
    from scipy.io import netcdf_file

    with netcdf_file(io.BytesIO(data), "r", mmap=False) as file:
        found = [file.variables[label].data for label in labels]
        return [values.astype(values.dtype.newbyteorder("=")) for values in found]


def label(column: Column, place: int) -> str:
    """The name of a column in the file, where SciPy writes Latin letters only."""
    return column.name if column.name.isascii() else f"column_{place}"


def fingerprint(data: bytes) -> str:
    """Half of the SHA-256 of the bytes, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()[:32]
