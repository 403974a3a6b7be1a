"""A batch of a campaign as bytes: a netCDF file (version 3) of some consecutive runs."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterable, Mapping

import numpy as np

from ulna.campaign.runs import Column


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
