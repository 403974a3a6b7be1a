"""A recording of muscles in a file: text as devices and spreadsheets write it, EDF, BDF, XDF."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ulna.base import printable
from ulna.identification import read_sheet
from ulna.studies.prosthesis.emg_channels import Channels, chosen_channels
from ulna.studies.prosthesis.emg_clock import read_clock
from ulna.studies.prosthesis.emg_formats import read_format
from ulna.studies.prosthesis.emg_kind import is_rectified
from ulna.studies.prosthesis.emg_signal import BAND, Recording, RecordingError, band_of

BRIDGED = 0.1
"""s of lost samples in one place over which a straight line is drawn."""
LOST = 0.1
"""Share of samples of a muscle that may be lost in all."""
_VOLTS = {"V": 1.0, "mV": 1e-3, "uV": 1e-6}


def read_recording(
    path: str | Path,
    *,
    rate: float | None = None,
    muscles: Sequence[str] = (),
    envelope: bool | None = None,
) -> Recording:
    """The recording in a file; `said` of the result tells in one line what was found and assumed.

    Text: columns between commas, tabs, semicolons or spaces, decimal points or commas, under titles, units and comments
    of any number. A column of times (s, ms, µs, time of day) or of sample numbers, or none and a rate that the titles
    or `rate` state. EDF, BDF and XDF need the extra `[emg]`.

    Lost samples (gaps in time, empty cells, NaN) are bridged by straight lines up to 0.1 s. An offset larger than the
    signal (half the supply of a converter) is taken off. A signal that is nowhere negative and slow or one-sided counts
    as rectified.

    Args:
        path: the file.
        rate: samples a second, where the file does not say it; where it does, both must agree.
        muscles: flexor and extensor, or the one muscle there is: names of columns, or their numbers from 1 on. Left
            out, the one or two there are, or those whose names tell flexor and extensor.
        envelope: whether the signals are rectified or envelopes already; found out where left out.

    Raises:
        RecordingError: a file that cannot be read or used, with line and column where there are any.
        OptionalDependencyError: EDF, BDF or XDF without the extra.
    """
    source = Path(path)
    found = read_format(source) or _from_text(source, rate)
    if rate is not None and abs(found.rate / rate - 1) > 1e-3:
        raise RecordingError(
            f"the recording '{source}' with rate={rate:g}",
            f"the file says {found.rate:.6g} samples a second.",
            "Leave it out.",
        )
    channels = chosen_channels(found, muscles)
    samples, bridged = _bridged(channels)
    rectified = envelope if envelope is not None else is_rectified(samples, channels.rate)
    words = [*channels.said, *bridged]
    if rectified:
        words.append("envelopes, by order" if envelope else "envelopes: nowhere negative, and slow or one-sided")
    else:
        samples, offset = _centred(samples, channels)
        words += offset
        low, high = band_of(channels.rate)
        if high < BAND[1]:
            words.append(f"band {low:g} to {high:g} Hz, as the rate allows")
    units = set(channels.units)
    if units <= set(_VOLTS):
        samples = samples * [_VOLTS[each] for each in channels.units]
    if len(channels.names) == 1:
        samples = np.column_stack([samples, np.zeros(len(samples))])
    recording = Recording(
        rate=channels.rate,
        samples=samples,
        muscles=channels.names,
        envelope=rectified,
        unit="V" if units <= set(_VOLTS) else "",
    )
    return replace(recording, said=_line(source, recording, words))


def write_recording(recording: Recording, path: str | Path) -> Path:
    """Write the recording as `read_recording` reads it; every number to the last bit."""
    target = Path(path)
    count = len(recording.muscles)
    unit = f" [{recording.unit}]" if recording.unit else ""
    with target.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(("time [s]", *(f"{name}{unit}" for name in recording.muscles)))
        for time, values in zip(recording.times, recording.samples[:, :count], strict=True):
            writer.writerow((repr(float(time)), *(repr(float(value)) for value in values)))
    return target


def _from_text(source: Path, rate: float | None) -> Channels:
    sheet = read_sheet(source, called="the recording", error=RecordingError)
    if len(sheet.lines) < 3:
        raise RecordingError(
            f"the recording '{source}'", f"it holds {len(sheet.lines)} samples.", "Record some seconds."
        )
    clock = read_clock(sheet, rate)
    muscles = [j for j in range(len(sheet.names)) if j not in clock.columns]
    count = int(clock.rows[-1]) + 1
    if count > len(clock.rows) * 2:
        at = int(np.diff(clock.rows).argmax())
        raise RecordingError(
            f"the recording '{source}'",
            f"{count - len(clock.rows)} of {count} samples are missing; the longest gap comes after line "
            f"{sheet.lines[at]}.",
            "Cut it into whole pieces or record again.",
        )
    samples = np.full((count, len(muscles)), np.nan)
    samples[clock.rows] = sheet.values[:, muscles]
    lines = np.interp(np.arange(count), clock.rows, sheet.lines).astype(np.int64)
    return Channels(
        source=source,
        names=tuple(sheet.names[j] for j in muscles),
        numbers=tuple(sheet.numbers[j] for j in muscles),
        units=tuple(sheet.units[j] for j in muscles),
        samples=samples,
        rate=clock.rate,
        said=(clock.said, *sheet.layout),
        lines=lines,
    )


def _bridged(channels: Channels) -> tuple[np.ndarray, list[str]]:
    """Samples with straight lines over what was lost, and how much that was."""
    samples = channels.samples.copy()
    at = np.arange(len(samples))
    total = 0
    for column, name in enumerate(channels.names):
        lost = ~np.isfinite(samples[:, column])
        if not lost.any():
            continue
        edges = np.diff(np.concatenate([[0], lost.astype(np.int8), [0]]))
        starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
        longest = int((ends - starts).argmax())
        seconds = float(ends[longest] - starts[longest]) / channels.rate
        if seconds > max(BRIDGED, 1.5 / channels.rate) or lost.mean() > LOST:
            where = "" if channels.lines is None else f", the longest from line {channels.lines[starts[longest]]} on"
            raise RecordingError(
                f"the recording '{channels.source}'",
                f"'{name}' lost {int(lost.sum())} of {len(lost)} samples in {len(starts)} gap(s){where} "
                f"({seconds:.3g} s); up to {BRIDGED:g} s and {LOST:.0%} are bridged.",
                "Cut it into whole pieces or record again.",
            )
        total = max(total, int(lost.sum()))
        samples[lost, column] = np.interp(at[lost], at[~lost], samples[~lost, column])
    return samples, [f"{total} lost sample{'s' * (total > 1)} bridged"] if total else []


def _centred(samples: np.ndarray, channels: Channels) -> tuple[np.ndarray, list[str]]:
    """Samples without an offset that is larger than the signal."""
    middle = np.median(samples, axis=0)
    spread = samples.std(axis=0)
    offset = np.where(np.abs(middle) > np.maximum(spread, 0.0), middle, 0.0)
    if not offset.any():
        return samples, []
    values = [f"{value:.4g}{f' {unit}' if unit else ''}" for value, unit in zip(offset, channels.units, strict=True)]
    if len(set(values)) == 1:
        return samples - offset, [f"offset {values[0]} removed"]
    parts = [f"{value} ({name})" for value, name, each in zip(values, channels.names, offset, strict=True) if each]
    return samples - offset, [f"offset {' and '.join(parts)} removed"]


def _line(source: Path, recording: Recording, words: Sequence[str]) -> str:
    names = ", ".join(recording.muscles)
    count = "2 muscles" if len(recording.muscles) == 2 else "1 muscle"
    text = f"{source.name}: {count} ({names}) at {recording.rate:.6g} Hz; {'; '.join(each for each in words if each)}"
    if len(recording.muscles) == 1:
        text += "; the other muscle counts as silent"
    if not recording.unit:
        text += "; no unit of the signals stated"
    return printable(text).replace("\n", " ").replace("\t", " ")
