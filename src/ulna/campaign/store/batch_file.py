"""A batch of a campaign as bytes: a netCDF file (version 3) of some consecutive runs."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterable, Mapping

import numpy as np

from ulna.campaign.runs import Column
from ulna.campaign.store.netcdf_writer import NetcdfColumn, write_netcdf


def packed(layout: tuple[Column, ...], values: Mapping[str, np.ndarray]) -> bytes:
    """The columns as a netCDF file, the same bytes for the same values."""
    rows = [values[column.name] for column in layout]
    buffer = io.BytesIO()
    write_netcdf(buffer, "run", len(rows[0]), netcdf_columns(layout), {}, [rows])
    return buffer.getvalue()


def netcdf_columns(layout: tuple[Column, ...]) -> list[NetcdfColumn]:
    """The columns as they stand in a file; what varied is marked as xarray marks coordinates."""
    varied = " ".join(label(column, place) for place, column in enumerate(layout) if column.varied)
    return [
        NetcdfColumn(
            name=label(column, place),
            dtype=column.dtype,
            attributes={"units": column.unit, "long_name": column.text}
            | ({} if column.varied else {"coordinates": varied}),
        )
        for place, column in enumerate(layout)
    ]


def unpacked(data: bytes, labels: Iterable[str]) -> list[np.ndarray]:
    """Columns of such a file, in the machine's own byte order."""
    from scipy.io import netcdf_file

    with netcdf_file(io.BytesIO(data), "r", mmap=False) as file:
        found = [file.variables[label].data for label in labels]
        return [values.astype(values.dtype.newbyteorder("=")) for values in found]


def label(column: Column, place: int) -> str:
    """The name of a column in the file, where SciPy reads Latin letters only."""
    return column.name if column.name.isascii() else f"column_{place}"


def fingerprint(data: bytes) -> str:
    """Half of the SHA-256 of the bytes, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()[:32]
