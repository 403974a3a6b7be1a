"""A netCDF file (version 3, 64-bit offsets) of many columns, written block by block: its size is no matter of memory.

Reference:
    "The NetCDF Classic Format Specification", Unidata.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from io import BufferedIOBase

import numpy as np

MOST_ROWS = 2**31 - 1
"""What the length of a dimension has room for."""

_DIMENSION, _VARIABLE, _ATTRIBUTE = 10, 11, 12
_KINDS = {"i1": 1, ">i4": 4, ">f8": 6}
_TEXT = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class NetcdfColumn:
    """A variable over the rows. dtype: `i1`, `>i4` or `>f8`. attributes: texts."""

    name: str
    dtype: str
    attributes: Mapping[str, str] = field(default_factory=dict)


def write_netcdf(
    file: BufferedIOBase,
    dimension: str,
    rows: int,
    columns: Sequence[NetcdfColumn],
    attributes: Mapping[str, str],
    blocks: Iterable[Sequence[np.ndarray]],
) -> None:
    """Write the columns, of whose values each block holds some further rows.

    Args:
        file: to be written to, empty. dimension: its name. rows: length of all columns, at most `MOST_ROWS`.
        columns: what is written. attributes: of the whole file.
        blocks: for each column the values of the next rows.
    """
    sizes = [_padded(rows * np.dtype(column.dtype).itemsize) for column in columns]
    head = b"CDF\x02" + _number(0)
    head += _number(_DIMENSION) + _number(1) + _text(dimension) + _number(rows) + _attributes(attributes)
    head += _number(_VARIABLE) + _number(len(columns))
    # The places stand in the head, whose length they do not change.
    first = len(head + b"".join(_variable(column, 0, 0) for column in columns))
    places = [first + sum(sizes[:k]) for k in range(len(columns))]
    file.write(head + b"".join(map(_variable, columns, sizes, places)))
    done = 0
    for block in blocks:
        for column, place, values in zip(columns, places, block, strict=True):
            file.seek(place + done * np.dtype(column.dtype).itemsize)
            file.write(np.ascontiguousarray(values, dtype=column.dtype).tobytes())
        done += len(block[0])
    # The last column ends padded, too.
    file.write(bytes(first + sum(sizes) - file.seek(0, 2)))


def _variable(column: NetcdfColumn, size: int, place: int) -> bytes:
    shape = _number(1) + _number(0)
    kind = _number(_KINDS[column.dtype])
    # A size that does not fit is written as the largest number: readers know it from the shape.
    written = struct.pack(">I", min(size, 2**32 - 1))
    return _text(column.name) + shape + _attributes(column.attributes) + kind + written + struct.pack(">q", place)


def _attributes(given: Mapping[str, str]) -> bytes:
    if not given:
        return _number(0) + _number(0)
    entries = (_text(name) + _number(_TEXT) + _text(value) for name, value in given.items())
    return _number(_ATTRIBUTE) + _number(len(given)) + b"".join(entries)


def _text(text: str) -> bytes:
    data = text.encode()
    return _number(len(data)) + data.ljust(_padded(len(data)), b"\0")


def _number(value: int) -> bytes:
    return struct.pack(">i", value)


def _padded(size: int) -> int:
    return -(-size // 4) * 4
