"""A text file of numbers as a table: delimiter, decimal sign, titles and units found from the lines themselves."""

from __future__ import annotations

import csv
import math
import re
from collections import Counter
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from ulna.base import UlnaError, UnitError, printable, unit
from ulna.identification.errors import IdentificationError

LARGEST = 500_000_000
"""Bytes that a file may have: an hour of two muscles at 2 kHz has half as many."""
_LOOKED_AT = 400
_MISSING = {"", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "?", "nil"}
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.IGNORECASE)
_CLOCK = re.compile(r"(?:(\d{4}-\d\d-\d\d)[T ])?(?:(\d{1,2}):)?(\d{1,2}):(\d{1,2}(?:\.\d+)?)Z?")
_GREATEST = 1e30
"""No device writes such a number, and its square is still one."""
_COMMENT = ("#", "%", "//")
_UNITS = {"s": "s", "sec": "s", "secs": "s", "second": "s", "seconds": "s", "ms": "ms", "msec": "ms", "us": "us"}
_UNITS |= {"millisecond": "ms", "milliseconds": "ms", "µs": "us", "μs": "us", "usec": "us", "microseconds": "us"}
_UNITS |= {"v": "V", "volt": "V", "volts": "V", "mv": "mV", "uv": "uV", "µv": "uV", "μv": "uV", "millivolts": "mV"}
_UNITS |= {"microvolts": "uV", "min": "min"}
_OTHER_UNITS = {"", "-", "a.u.", "au", "counts", "count", "adc", "1", "%", "%mvc", "n", "kg", "g", "deg", "hz"}
_SPACES = "spaces"
_SPLITS = (("\t", "tabs"), (";", "semicolons"), (",", ""), (_SPACES, "spaces"))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sheet:
    """The numbers of a file, with what stands above them.

    Attributes:
        source: the file. titles: the text above the numbers.
        numbers: of the columns in the file, from 1 on. names: "" where there is none.
        units: "s", "ms", "us", "min", "V", "mV", "uV" or "".
        written: the text that stands for a unit in the titles, or "".
        values: (N, C); NaN where nothing stands. lines: (N,) numbers of the lines in the file.
        places: (C,) the last decimal place written in a column, as a number: 0.001.
        layout: what the lines look like, where it is not numbers with commas between them.
    """

    source: Path
    titles: str
    numbers: tuple[int, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    written: tuple[str, ...]
    values: np.ndarray
    lines: np.ndarray
    places: np.ndarray
    layout: tuple[str, ...]


def read_sheet(source: Path, *, called: str = "the record", error: type[UlnaError] = IdentificationError) -> Sheet:
    """The table in a text file.

    Args:
        source: the file. called, error: what messages call it and are raised as.

    Raises:
        UlnaError: a file that cannot be read, is not text or too large, or a line that does not fit the others.
    """
    try:
        return _sheet(source)
    except _UnfitError as found:
        raise error(f"{called} '{source}'", *found.args) from found.__cause__


class _UnfitError(Exception):
    """What was found, and what to try."""


def _sheet(source: Path) -> Sheet:
    texts = re.split("\r\n|\r|\n", _text(source))
    kept = [(k, each) for k, each in enumerate(texts, start=1) if each.strip()]
    bare = [(k, each) for k, each in kept if not each.lstrip().startswith(_COMMENT)]
    delimiter, words, comma = _layout([each for _, each in bare])
    rows = [(k, _cells(each, delimiter)) for k, each in bare]
    width, first = _beginning(rows, comma)
    above = [(k, each) for k, each in kept if not rows or first >= len(rows) or k < rows[first][0]]
    if first >= len(rows):
        raise _UnfitError(
            "it holds 0 samples.",
            "A line holds the time and one value for each channel; titles may come first.",
        )
    spare = all(not cells[-1] for _, cells in rows[first:])
    names, units, written = _heads([each for _, each in above], delimiter, width, spare=spare)
    data, layout = rows[first:], [words] if words else []
    if len(data) > 3 and len(data[-1][1]) < width:
        data = data[:-1]
        layout.append("an unfinished last line left out")
    values, places = _numbers(data, names, comma)
    if comma:
        layout.insert(1, "decimal commas")
    some = np.atleast_1d(np.isfinite(values).any(axis=0))
    return Sheet(
        source=source,
        titles="\n".join(each for _, each in above),
        numbers=tuple(j + 1 for j, keep in enumerate(some) if keep),
        names=tuple(name for name, keep in zip(names, some, strict=True) if keep),
        units=tuple(name for name, keep in zip(units, some, strict=True) if keep),
        written=tuple(name for name, keep in zip(written, some, strict=True) if keep),
        values=values[:, some],
        lines=np.array([k for k, _ in data]),
        places=places[some],
        layout=tuple(layout),
    )


def _text(source: Path) -> str:
    """UTF-8, UTF-16 with its mark (spreadsheets), or Latin letters of one byte (older devices)."""
    try:
        if source.exists() and not source.is_file():
            raise _UnfitError("it cannot be read: it is not a regular file.")
        if source.stat().st_size > LARGEST:
            raise _UnfitError(f"it is larger than {LARGEST // 1_000_000} MB.", "Cut it.")
        data = source.read_bytes()
    except OSError as error:
        raise _UnfitError(f"it cannot be read: {error.strerror}.") from error
    wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    for encoding in ("utf-16",) if wide else ("utf-8-sig", "cp1252"):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if not re.search("[\x00-\x08\x0e-\x1f\x7f]", text):
            return text
    raise _UnfitError(
        "it cannot be read: it is not text.",
        "Export it as CSV.",
    )


def number(cell: str, comma: bool) -> float | None:
    """The number in a cell, NaN where it says that there is none, None where it is text."""
    text = cell.strip()
    if comma:
        text = text.replace(",", ".") if "." not in text else "x"
    if _NUMBER.fullmatch(text):
        value = float(text)
        return value if abs(value) < _GREATEST else None
    if text.lower() in _MISSING:
        return math.nan
    return _clock(text)


def _clock(text: str) -> float | None:
    """Seconds of a time of day, with or without a date."""
    match = _CLOCK.fullmatch(text)
    if not match:
        return None
    try:
        day = datetime.fromisoformat(match[1]).toordinal() if match[1] else 0
    except ValueError:
        return None
    return ((day * 24 + int(match[2] or 0)) * 60 + int(match[3])) * 60 + float(match[4])


def _cells(text: str, delimiter: str) -> list[str]:
    if delimiter == _SPACES:
        return text.split()
    if '"' in text:
        try:
            return [each.strip() for each in next(csv.reader([text], delimiter=delimiter, skipinitialspace=True))]
        except (csv.Error, StopIteration):
            return [text]
    return [each.strip() for each in text.split(delimiter)]


def _layout(lines: list[str]) -> tuple[str, str, bool]:
    """(delimiter, its name where it is no comma, decimal commas): what makes the most numbers of the later lines."""
    looked = lines[len(lines) // 2 :][:_LOOKED_AT]
    best, found = -math.inf, (",", "", False)
    for comma in (False, True):
        for delimiter, words in _SPLITS:
            if comma and delimiter == ",":
                continue
            score = 0
            for text in looked:
                for cell in _cells(text, delimiter):
                    value = number(cell, comma)
                    score += (-1 if value is None else 1) if cell else 0
            if score > best:
                best, found = score, (delimiter, words, comma)
    # '0,05' alone on a line is one number with a decimal comma: nobody writes the whole number 05.
    if found[0] == "," and any(re.fullmatch(r"\s*-?\d+,0\d+\s*|\s*-0,\d+\s*", each) for each in looked):
        found = (_SPACES, "", True)
    if all(len(_cells(each, found[0])) == 1 for each in looked):
        found = (found[0], "", found[2])
    return found


def _beginning(rows: list[tuple[int, list[str]]], comma: bool) -> tuple[int, int]:
    """(columns, the row at which the numbers begin)."""
    later = rows[len(rows) // 2 :][:_LOOKED_AT]
    width = max(Counter(len(cells) for _, cells in later).items(), key=lambda each: each[1])[0] if later else 0
    numeric = [
        j
        for j in range(width)
        if 2 * sum(number(cells[j], comma) is not None for _, cells in later if len(cells) == width) > len(later)
    ]
    for k, (_, cells) in enumerate(rows):
        if k == 0 and len(cells) == width and not cells[0] and all(each[0] for _, each in later):
            continue  # numbers of columns over a column of times without a title
        values = [number(cells[j], comma) for j in numeric] if len(cells) == width else []
        if values and None not in values and any(value is not None and math.isfinite(value) for value in values):
            return width, k
    return width, len(rows)


def _heads(above: list[str], delimiter: str, width: int, *, spare: bool) -> tuple[list[str], list[str], list[str]]:
    """Names, units and their texts of the columns: of the last line above that has as many, units apart or in brackets.

    One title fewer is that of a last column that is empty (`spare`), or of a first one of row numbers.
    """
    names, units, written = [""] * width, [""] * width, [""] * width
    for text in reversed(above):
        line = text.strip().lstrip("#%/ ") if text.lstrip().startswith(_COMMENT) else text
        cells = _title_cells(line, delimiter)
        listed = re.search(r'"columns?"\s*:\s*\[([^\[\]]*)\]', line)
        if listed:
            cells = [each.strip(' "') for each in listed[1].split(",")]
            cells += [""] * (width - len(cells))
        cells = [each.strip() for each in cells]
        if len(cells) == width + 1 and not cells[-1]:
            cells = cells[:-1]
        if len(cells) == width - 1 > 1 and delimiter != _SPACES:
            cells = [*cells, ""] if spare else ["", *cells]
        if len(cells) != width or not any(cells):
            continue
        bare = [each.strip("[]()").lower() for each in cells]
        texts = [each.strip("[]()") for each in cells]
        if all(each in _UNITS or each in _OTHER_UNITS for each in bare) or (len(above) > 1 and _units(texts)):
            units, written = [_UNITS.get(each, "") for each in bare], texts
        elif not any(re.fullmatch(r"[-+]?[\d.,]+\s*\w{0,3}", each) for each in cells):
            names = [printable(_bare_name(each))[:60] for each in cells]
            inside = [re.search(r"[\[(_ ,]\s*([^\[\]()_ ,]+)\s*[\])]?\s*$", each) for each in cells]
            own = [_UNITS.get(match[1].lower(), "") if match else "" for match in inside]
            units = [a or b for a, b in zip(units, own, strict=True)]
            told = [re.search(r"\[([^\[\]]*)\]\s*$|\((.*)\)\s*$", each) for each in cells]
            written = [
                a or (b[1] or b[2] or "" if b else "") or c for a, b, c in zip(written, told, units, strict=True)
            ]
            break
    return names, units, written


def _units(texts: list[str]) -> bool:
    """Whether all of them are units, as in a line of its own under the titles."""
    try:
        return bool([unit(each) for each in texts])
    except UnitError:
        return False


def _title_cells(line: str, delimiter: str) -> list[str]:
    if delimiter != _SPACES:
        return _cells(line, delimiter)
    apart = re.split(r"\s{2,}|\t", line.strip())
    if len(apart) > 1:
        return apart
    return [
        each.strip('"') for each in re.findall(r'"[^"]*"|[^\s\[(]+(?:\s*[\[(][^\])]*[\])])?|[\[(][^\])]*[\])]', line)
    ]


def _bare_name(cell: str) -> str:
    bare = re.sub(r"\s*[\[(][^\])]*[\])]\s*$", "", cell.strip().strip("\"'")).strip()
    name, _, unit = bare.rpartition(",")
    return name.strip() if unit.strip().lower() in _UNITS and name else bare


def _numbers(data: list[tuple[int, list[str]]], names: list[str], comma: bool) -> tuple[np.ndarray, np.ndarray]:
    width = len(names)
    values = np.full((len(data), width), np.nan)
    text_columns = _text_columns(data, width, comma)
    for row, (line, cells) in enumerate(data):
        if len(cells) != width:
            raise _UnfitError(
                f"line {line} has {len(cells)} columns, the others have {width}.",
                "Correct or delete that line.",
            )
        for column, cell in enumerate(cells):
            if column in text_columns:
                continue
            value = number(cell, comma)
            if value is None:
                raise _UnfitError(
                    f"line {line}, column {column + 1}{f' ({names[column]})' if names[column] else ''}: "
                    f"'{cell[:40]}' is not a number that can be used.",
                    "Correct or delete that line, or leave the cell empty where a sample was lost.",
                )
            values[row, column] = value
    places = np.ones(width)
    for column in set(range(width)) - text_columns:
        places[column] = min(
            (_place(cells[column], comma) for _, cells in data[:: max(1, len(data) // 997)]), default=1
        )
    return values, places


def _text_columns(data: list[tuple[int, list[str]]], width: int, comma: bool) -> set[int]:
    """Columns that are text in most lines, as notes and arrows are."""
    looked = [cells for _, cells in data[:: max(1, len(data) // _LOOKED_AT)] if len(cells) == width]
    return {j for j in range(width) if 2 * sum(number(cells[j], comma) is None for cells in looked) > len(looked)}


def _place(cell: str, comma: bool) -> float:
    """0.001 for '1.234', 1 for '12'."""
    match = re.search(r"\d*[.]?(\d*)(?:e([-+]?\d+))?$", (cell.replace(",", ".") if comma else cell).lower())
    if not match or "." not in cell.replace(",", "."):
        return 1.0
    return 10.0 ** max(-300, min(0, int(match[2] or 0) - len(match[1])))
