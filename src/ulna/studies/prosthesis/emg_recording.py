"""A recording of two muscles in a file: time, flexor, extensor."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np

from ulna.studies.prosthesis.emg_signal import Recording, RecordingError

_LAYOUT = "A line holds time in s, flexor in V, extensor in V; one line of titles may stand first."


def read_recording(path: str | Path, *, rate: float | None = None) -> Recording:
    """The recording in a CSV file.

    Args:
        path: the file; columns time (s), flexor (V), extensor (V), separated by commas, with or without titles.
        rate: samples a second it should have; where left out, what its times say.

    Raises:
        RecordingError: a file that cannot be read, one channel or too many, text or NaN among the numbers, times that
            do not increase, a gap, an uneven or wrong rate.
    """
    source = Path(path)
    table = _numbers(source)
    times, samples = table[:, 0], table[:, 1:]
    steps = np.diff(times)
    if not (steps > 0).all():
        row = int(np.flatnonzero(~(steps > 0))[0])
        raise RecordingError(f"the recording '{source}'", f"time does not increase after {times[row]:g} s.")
    # The median is right as long as fewer than half of the samples are missing.
    step = float(np.median(steps))
    found = 1 / step
    gaps = np.flatnonzero(steps > 1.5 * step)
    if len(gaps):
        missing = round(float((steps[gaps] / step - 1).sum()))
        at = int(gaps[0])
        raise RecordingError(
            f"the recording '{source}'",
            f"{len(gaps)} gap(s), {missing} samples missing, the first after {times[at]:g} s.",
            "Cut it into whole pieces or record again; gaps are not filled in.",
        )
    if rate is not None and abs(found - rate) > 1e-3 * rate:
        raise RecordingError(
            f"the recording '{source}' at {rate:g} samples a second", f"its times say {found:.6g}.", "Give that rate."
        )
    uneven = float(np.abs(steps / step - 1).max())
    if uneven > 0.1:
        raise RecordingError(
            f"the recording '{source}'", f"its sampling is uneven: steps differ by {uneven:.0%}.", "Resample it."
        )
    exact = (len(times) - 1) / float(times[-1] - times[0])
    return Recording(rate=rate if rate is not None else float(f"{exact:.9g}"), samples=samples)


def write_recording(recording: Recording, path: str | Path) -> Path:
    """Write the recording as `read_recording` reads it; every number to the last bit."""
    target = Path(path)
    with target.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(("time", "flexor", "extensor"))
        for time, (flexor, extensor) in zip(recording.times, recording.samples, strict=True):
            writer.writerow((repr(float(time)), repr(float(flexor)), repr(float(extensor))))
    return target


def _numbers(source: Path) -> np.ndarray:
    """(N, 3), N ≥ 3."""
    try:
        with source.open(newline="", encoding="utf-8-sig") as stream:
            lines = [(stream_line, row) for stream_line, row in enumerate(csv.reader(stream), start=1) if row]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or "it is no text in UTF-8"
        raise RecordingError(f"the recording '{source}'", f"it cannot be read: {reason}.") from error
    if lines and not _is_number(lines[0][1][0]):
        lines = lines[1:]
    if len(lines) < 3:
        raise RecordingError(f"the recording '{source}'", f"it holds {len(lines)} samples.", _LAYOUT)
    rows = []
    for number, row in lines:
        if len(row) != 3:
            channels = "one channel" if len(row) == 2 else f"{max(0, len(row) - 1)} channels"
            raise RecordingError(f"the recording '{source}'", f"line {number} has {channels}, two are needed.", _LAYOUT)
        if not all(_is_number(cell) and math.isfinite(float(cell)) for cell in row):
            raise RecordingError(
                f"the recording '{source}'", f"line {number} is no three finite numbers: {row}.", _LAYOUT
            )
        rows.append([float(cell) for cell in row])
    return np.array(rows)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
