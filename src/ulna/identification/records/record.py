"""`Record`: what was measured, in SI, from a file, a table or a simulation."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ulna.base import UnitError, unit
from ulna.identification.errors import IdentificationError
from ulna.identification.records.sheet import read_sheet
from ulna.sim import Trajectory

GAP = 10.0
"""An even record is cut where two samples lie so many times further apart than usual: what acted there is unknown."""

_TIME = re.compile(r"time|zeit|temps|tiempo|tempo|t", re.IGNORECASE)
_NETCDF = (b"CDF\x01", b"CDF\x02", b"CDF\x05", b"\x89HDF")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Record:
    """Signals measured in one experiment, in SI.

    Attributes:
        times: (N,) s, increasing. columns: (N,) values by name; NaN where a sample was lost.
        units: by name the unit that the numbers were written in; "" where none was told and SI is taken.
        name: what messages call it. digest: SHA-256 of the file, "" of anything else.
        joined: whether inputs follow straight lines between samples; else they are held until the next one.
        delay: s by which inputs act later than they were written down.
        said: what was done to read it.

    Raises:
        IdentificationError: times that do not increase, columns of another length, values that are not finite.

    Examples:
        >>> record = ulna.Record(times=np.linspace(0, 1, 3), columns={"y": np.zeros(3)}, name="first try")
        >>> record.name
        'first try'
    """

    times: np.ndarray
    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str] = field(default_factory=dict)
    name: str = "record"
    digest: str = ""
    joined: bool = False
    delay: float = 0.0
    said: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        times = np.array(self.times, dtype=float)
        columns = {str(name): np.array(values, dtype=float) for name, values in self.columns.items()}
        _check(self.name, times, columns, [f"sample {k + 1}" for k in range(len(times))])
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "columns", columns)

    def __len__(self) -> int:
        return len(self.times)

    def __repr__(self) -> str:
        span = f"{self.times[0]:g} s to {self.times[-1]:g} s"
        shown = ", ".join(f"{n} [{u}]" if (u := self.units.get(n)) else n for n in self.columns)
        said = "".join(f"; {each}" for each in self.said)
        return f"Record '{self.name}': {len(self)} samples from {span}, {shown}{said}"

    def between(self, begin: float, end: float) -> Record:
        """The samples from `begin` to `end`, s."""
        return self.at((self.times >= begin) & (self.times <= end))

    def at(self, kept: np.ndarray | slice) -> Record:
        """Some of the samples."""
        return replace(self, times=self.times[kept], columns={n: v[kept] for n, v in self.columns.items()})


def read_record(
    path: str | Path,
    *,
    time: str | None = None,
    names: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    lost: bool = False,
    joined: bool = False,
    delay: float = 0.0,
) -> Record:
    r"""The record in a text file (CSV, tabs, semicolons) or in the netCDF of a `Trajectory`.

    Titles carry units, `theta [deg]` or a line of units below; a column without one is taken as SI.

    Args:
        path: the file. time: title of the column of times; left out, one that is called so, else the first.
        names: what a signal of the plant is called in the file, where that is another name: {"y": "encoder"}.
        units: units by name of columns, where the titles say nothing or something wrong.
        lost: whether empty cells and NaN mean a lost sample, which counts for nothing; else they are refused.
        joined, delay: see `Record`.

    Raises:
        IdentificationError: a file that cannot be read, times that do not increase, cells without a number.
        UnitError: a unit that is unknown.

    Examples:
        >>> from pathlib import Path
        >>> _ = Path("log.csv").write_text("t,y\n0,0\n0.1,90\n")
        >>> ulna.read_record("log.csv", units={"y": "deg"}).columns["y"].round(3)
        array([0.   , 1.571])
    """
    place = Path(path)
    try:
        data = place.read_bytes()[:4] if place.is_file() else b""
    except OSError:
        data = b""
    if data.startswith(_NETCDF):
        found = as_record(_dataset(place), name=place.name)
    else:
        found = _from_sheet(place, time, dict(units or {}), lost=lost)
    columns, told = dict(found.columns), dict(found.units)
    for name, title in (names or {}).items():
        if title not in columns:
            raise missing_column(found.name, title, list(columns))
        columns[name], told[name] = columns[title], told.get(title, "")
    digest = hashlib.sha256(place.read_bytes()).hexdigest()
    return replace(found, columns=columns, units=told, digest=digest, joined=joined, delay=delay)


def as_record(given: Any, *, name: str = "record") -> Record:
    """The record that something stands for: a `Record`, a file, a `Trajectory`, a table of pandas or xarray, a mapping.

    Columns of a mapping or a table have their units in the names, `theta [deg]`, or, as `Trajectory.to_pandas` and
    `to_xarray` write them, in `attrs`. Times are the index or the column `time`.

    Raises:
        IdentificationError: anything else, or what `Record` raises.
    """
    if isinstance(given, Record):
        return given
    if isinstance(given, str | Path):
        return read_record(given)
    if isinstance(given, Trajectory):
        rows = {s.name: given[s.name] for s in (*given.system.states, *given.system.outputs, *given.system.inputs)}
        rows |= {label: each.values for label, each in given.further.items()}
        return Record(times=given.times, columns=rows, name=f"simulation of {given.system.name}")
    table, attributes, time = _table(given)
    if time is None:
        label = next((key for key in table if _TIME.fullmatch(_title(key)[0])), None)
        if label is None:
            hint = "Give a column 'time', in s or with its unit: 'time [ms]'."
            raise IdentificationError(f"the record '{name}'", f"no times among {', '.join(table) or 'nothing'}.", hint)
        time = np.asarray(table.pop(label), dtype=float) * _factor(_title(label)[1] or attributes.get(label, ""), label)
    columns, units = {}, {}
    for key, values in table.items():
        bare, written = _title(key)
        units[bare] = written or attributes.get(key, "")
        columns[bare] = np.asarray(values, dtype=float) * _factor(units[bare], key)
    return Record(times=time, columns=columns, units=units, name=name)


def as_records(given: Any) -> tuple[Record, ...]:
    """The experiments: one record, or a sequence of them; each cut at its gaps.

    Raises:
        IdentificationError: none at all.
    """
    several = isinstance(given, Sequence) and not isinstance(given, str)
    records = [as_record(each) for each in given] if several else [as_record(given)]
    found = tuple(piece for record in records for piece in pieces(record))
    if not found:
        raise IdentificationError("records to identify from", "there are none.", "Give a file or a Record.")
    return found


def pieces(record: Record) -> tuple[Record, ...]:
    """The record, or where it is even but for gaps, its parts between them."""
    steps = np.diff(record.times)
    usual = float(np.median(steps)) if len(steps) else 0.0
    if len(steps) < 3 or (np.abs(steps - usual) < 0.2 * usual).mean() < 0.8:
        return (record,)
    cuts = np.flatnonzero(steps > GAP * usual) + 1
    if not len(cuts):
        return (record,)
    parts = np.split(np.arange(len(record)), cuts)
    told = f"cut into {len(parts)} at gaps"
    return tuple(
        replace(record.at(part), name=f"{record.name}, part {k + 1}", said=(*record.said, told))
        for k, part in enumerate(parts)
        if len(part) > 1
    )


def missing_column(where: str, wanted: str, known: Sequence[str], hint: str = "") -> IdentificationError:
    """That a column is missing, with its nearest match."""
    from difflib import get_close_matches

    lower = {each.lower(): each for each in known}
    near = [lower[each] for each in get_close_matches(wanted.lower(), lower, n=2, cutoff=0.5)]
    guess = f"Did you mean {' or '.join(near)}? " if near else ""
    tell = hint or f'Rename it, or say so: names={{"{wanted}": "{near[0] if near else "title"}"}}.'
    found = f"there is no column '{wanted}'; its columns are {', '.join(known) or 'none'}."
    return IdentificationError(f"the record '{where}'", found, f"{guess}{tell}")


def factor_of(text: str) -> float:
    """What numbers in a unit are multiplied by to be SI."""
    found = unit(text)
    return float(found.factor) * float(np.pi / 180) ** found.degrees


def _factor(text: str, column: str) -> float:
    try:
        return factor_of(text)
    except UnitError as error:
        raise UnitError(f"column '{column}'", f"the {error.asked}: {error.found}", error.hint) from None


def _title(text: str) -> tuple[str, str]:
    """(name, unit) of a title such as `theta [deg]`."""
    match = re.fullmatch(r"\s*(.*?)\s*\[([^\[\]]*)\]\s*|\s*(.*?)\s*\((.*)\)\s*", str(text))
    if match is None:
        return str(text).strip(), ""
    return (match[1], match[2].strip()) if match[1] is not None else (match[3], match[4].strip())


def _from_sheet(place: Path, time: str | None, units: dict[str, str], *, lost: bool) -> Record:
    sheet = read_sheet(place)
    names = [name or f"column {k}" for name, k in zip(sheet.names, sheet.numbers, strict=True)]
    at = _time_column(place.name, names, time)
    clock = sheet.written[at] or sheet.units[at]
    columns, told = {}, {}
    for k, name in enumerate(names):
        if k == at:
            continue
        told[name] = units.get(name, sheet.written[k])
        columns[name] = sheet.values[:, k] * _factor(told[name], name)
    where = [f"line {line}" for line in sheet.lines]
    times = sheet.values[:, at] * _factor(units.get(names[at], clock), names[at])
    _check(place.name, times, columns, where, lost=lost)
    said = (*sheet.layout, *(() if clock or names[at] in units else ("times without unit taken as s",)))
    return Record(times=times, columns=columns, units=told, name=place.name, said=said)


def _time_column(where: str, names: Sequence[str], asked: str | None) -> int:
    if asked is not None:
        if asked not in names:
            raise missing_column(where, asked, names, "Say which column holds the times: time=….")
        return names.index(asked)
    named = [k for k, name in enumerate(names) if _TIME.fullmatch(name)]
    named += [k for k, name in enumerate(names) if re.match(r"time|t_|t\b", name, re.IGNORECASE) and k not in named]
    return named[0] if named else 0


def _check(
    name: str, times: np.ndarray, columns: Mapping[str, np.ndarray], where: Sequence[str], *, lost: bool = True
) -> None:
    """Refuse what is not a record; `where` says where each sample stands."""
    asked = f"the record '{name}'"
    if times.ndim != 1 or len(times) < 2:
        raise IdentificationError(asked, f"it holds {len(times)} samples.", "At least two are needed.")
    if not np.isfinite(times).all():
        at = where[int(np.argmin(np.isfinite(times)))]
        raise IdentificationError(asked, f"{at} has no time.", "Correct or delete that line.")
    for title, values in columns.items():
        if values.shape != times.shape:
            found = f"column '{title}' has {values.size} values for {len(times)} times."
            raise IdentificationError(asked, found, "Give one of each.")
        wrong = ~np.isfinite(values)
        if np.isinf(values).any() or (wrong.any() and not lost):
            at = where[int(np.argmax(wrong))]
            found = f"column '{title}' holds no number at {at} ({int(wrong.sum())} of {len(times)} in all)."
            raise IdentificationError(
                asked, found, "Correct those lines, or say that they are lost samples: lost=True."
            )
    steps = np.diff(times)
    if not (steps > 0).all():
        at = int(np.argmax(steps <= 0))
        verb = "stands still" if steps[at] == 0 else "goes back"
        found = f"time {verb}: {times[at + 1]:.9g} s at {where[at + 1]} follows {times[at]:.9g} s."
        raise IdentificationError(asked, found, "Sort the samples, drop repeated ones, or split separate runs.")


def _table(given: Any) -> tuple[dict[str, Any], dict[str, str], np.ndarray | None]:
    """(columns by title, units by title, times in s where they are an index)."""
    if hasattr(given, "data_vars"):
        titles = {str(key): each for key, each in given.data_vars.items() if each.dims == ("time",)}
        units = {key: str(each.attrs.get("units", "")) for key, each in titles.items()}
        if "time" not in given.coords:
            return {key: each.values for key, each in titles.items()}, units, None
        clock = given["time"]
        times = np.asarray(clock.values, dtype=float) * _factor(str(clock.attrs.get("units", "")), "time")
        return {key: each.values for key, each in titles.items()}, units, times
    if hasattr(given, "columns") and hasattr(given, "index"):
        units = {str(k): str(v) for k, v in dict(given.attrs.get("units", {})).items()}
        table = {str(key): given[key].to_numpy() for key in given.columns}
        indexed = given.index.name is not None and _TIME.fullmatch(_title(str(given.index.name))[0])
        if not indexed:
            return table, units, None
        return table, units, given.index.to_numpy(dtype=float) * _factor(_title(str(given.index.name))[1], "index")
    if isinstance(given, Mapping):
        return {str(key): values for key, values in given.items()}, {}, None
    raise IdentificationError(
        f"a record from a {type(given).__name__}",
        "it is not a record.",
        "Give a file, a Record, a Trajectory, a table of pandas or xarray, or a mapping with 'time'.",
    )


def _dataset(place: Path) -> Any:
    """The variables along the time of a netCDF file, as an `xarray.Dataset` would show them."""
    if place.read_bytes()[:4] == _NETCDF[-1]:
        import xarray as xr

        with xr.open_dataset(place, decode_times=False) as data:
            return data.load()
    from scipy.io import netcdf_file

    table: dict[str, np.ndarray] = {}
    with netcdf_file(place, "r", mmap=False) as file:
        for label, variable in file.variables.items():
            if variable.dimensions != ("time",):
                continue
            name, told = (getattr(variable, key, b"").decode() for key in ("name", "units"))
            table[f"{name or label} [{told}]" if told else name or label] = np.array(variable[:], dtype=float)
    return table
